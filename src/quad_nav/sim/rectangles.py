"""Marked cells covered with few rectangles."""

from __future__ import annotations

from typing import Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.files.kernel_cache import njit


@njit(cache=True, nogil=True)
def cover(
    left: NDArray[np.bool_], rectangles: NDArray[np.int64], first_row: int
) -> Tuple[int, int]:
    """Cover marked cells with disjoint rectangles that hold no other cells.

    Greedy: from the first cell in row order that is not covered yet, a rectangle is grown as wide
    as it goes and then as high as it goes, and another one the other way round; the larger one is
    kept.

    Args:
        left: bool[H, W], the cells to cover, none before ``first_row``;
            covered ones become False.
        rectangles: int64[n, 4], filled with first column, first row, width, height.
        first_row: Row to start from.

    Returns:
        The number of rectangles filled in, and the row to continue from with room for more;
        H when everything is covered.
    """
    count = 0
    for row in range(first_row, left.shape[0]):
        for column in range(left.shape[1]):
            if not left[row, column]:
                continue
            if count == rectangles.shape[0]:
                return count, row
            w, h = _grow(left, row, column)
            other_h, other_w = _grow(left.T, column, row)
            if other_w * other_h > w * h:
                w, h = other_w, other_h
            for y in range(row, row + h):
                for x in range(column, column + w):
                    left[y, x] = False
            rectangles[count, 0], rectangles[count, 1] = column, row
            rectangles[count, 2], rectangles[count, 3] = w, h
            count += 1
    return count, left.shape[0]


@njit(cache=True, nogil=True)
def _grow(left: NDArray[np.bool_], row: int, column: int) -> Tuple[int, int]:
    """Return width and height of the rectangle that grows along the row first."""
    height, width = left.shape
    end = column + 1
    while end < width and left[row, end]:
        end += 1
    below = row + 1
    while below < height and _all(left, below, column, end):
        below += 1
    return end - column, below - row


@njit(cache=True, nogil=True)
def _all(left: NDArray[np.bool_], row: int, column: int, end: int) -> bool:
    """Tell whether every cell of a part of a row is still to be covered."""
    for x in range(column, end):
        if not left[row, x]:
            return False
    return True
