"""Discs on a grid, and the nearest cell outside of them."""

from __future__ import annotations

import math

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def raise_discs(cells, origin_x_m, origin_y_m, resolution_m, centres, radius_m, value):
    """Raise to ``value`` the cells, uint8[H, W], whose centres lie within a radius of a centre.

    centres: float64[n, 2]. Cells that are higher stay.
    """
    size_y, size_x = cells.shape
    for k in range(centres.shape[0]):
        x = (centres[k, 0] - origin_x_m) / resolution_m - 0.5
        y = (centres[k, 1] - origin_y_m) / resolution_m - 0.5
        reach = radius_m / resolution_m
        for row in range(max(0, math.ceil(y - reach)), min(size_y - 1, math.floor(y + reach)) + 1):
            half = math.sqrt(max(reach * reach - (row - y) * (row - y), 0.0))
            for column in range(
                max(0, math.ceil(x - half)), min(size_x - 1, math.floor(x + half)) + 1
            ):
                if cells[row, column] < value:
                    cells[row, column] = value


@njit(cache=True, nogil=True)
def nearest_cell(blocked, unwanted, start_x, start_y):
    """The cell that is fewest steps away over cells that are not blocked, and not unwanted.

    blocked, unwanted: uint8[H, W], 0 or not. Steps go to the four neighbours; the start
    may be blocked. Returns (x, y), or (-1, -1) when there is none.
    """
    size_y, size_x = blocked.shape
    seen = np.zeros((size_y, size_x), np.bool_)
    queue = np.empty((blocked.size, 2), np.int32)
    queue[0, 0], queue[0, 1] = start_x, start_y
    seen[start_y, start_x] = True
    head, tail = 0, 1
    while head < tail:
        x, y = queue[head]
        head += 1
        if not unwanted[y, x] and not blocked[y, x]:
            return x, y
        for dx, dy in ((1, 0), (0, 1), (-1, 0), (0, -1)):
            to_x, to_y = x + dx, y + dy
            if (
                0 <= to_x < size_x
                and 0 <= to_y < size_y
                and not seen[to_y, to_x]
                and not blocked[to_y, to_x]
            ):
                seen[to_y, to_x] = True
                queue[tail, 0], queue[tail, 1] = to_x, to_y
                tail += 1
    return -1, -1
