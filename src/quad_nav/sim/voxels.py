"""Triangles rasterised into cells of a volume, and filled cells covered with few boxes."""

from __future__ import annotations

import math
from typing import Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.files.kernel_cache import njit

_MOST_CORNERS = 16
"""Corners of a triangle that four planes have cut are 7 at most."""
_ROUNDING = 1e-6
"""A face on the border of two cells fills one of them."""


@njit(cache=True, nogil=True)
def fill(triangles: NDArray[np.float64], filled: NDArray[np.bool_]) -> None:
    """Fill the cells that triangles reach into; what is outside the volume is left out.

    Args:
        triangles: float64[n, 3, 3], corners in cells from the volume's lowest corner.
        filled: bool[X, Y, Z], cells that become True.
    """
    buffers = np.empty((5, _MOST_CORNERS, 3))
    for number in range(len(triangles)):
        buffers[0, :3] = triangles[number]
        first_x, end_x = _cells_between(buffers[0, :3, 0], filled.shape[0])
        for x in range(first_x, end_x):
            strip = _between(buffers[0], 3, 0, x, buffers[1], buffers[2])
            if strip == 0:
                continue
            first_y, end_y = _cells_between(buffers[2, :strip, 1], filled.shape[1])
            for y in range(first_y, end_y):
                corners = _between(buffers[2], strip, 1, y, buffers[3], buffers[4])
                if corners == 0:
                    continue
                first_z, end_z = _cells_between(buffers[4, :corners, 2], filled.shape[2])
                filled[x, y, first_z:end_z] = True


@njit(cache=True, nogil=True)
def _cells_between(values: NDArray[np.float64], count: int) -> Tuple[int, int]:
    """Return the first of ``count`` cells that values reach into, and the one after the last."""
    low, high = values.min(), values.max()
    if high < -_ROUNDING or low > count + _ROUNDING:
        return 0, 0
    first = min(max(int(math.floor(low + _ROUNDING)), 0), count - 1)
    last = min(max(int(math.floor(high - _ROUNDING)), first), count - 1)
    return first, last + 1


@njit(cache=True, nogil=True)
def _between(
    corners: NDArray[np.float64],
    count: int,
    axis: int,
    cell: int,
    above: NDArray[np.float64],
    inside: NDArray[np.float64],
) -> int:
    """Cut a convex polygon to a cell's extent along an axis; return the number of corners."""
    count = _cut(corners, count, axis, cell - _ROUNDING, 1.0, above)
    return _cut(above, count, axis, cell + 1.0 + _ROUNDING, -1.0, inside)


@njit(cache=True, nogil=True)
def _cut(
    corners: NDArray[np.float64],
    count: int,
    axis: int,
    limit: float,
    side: float,
    kept: NDArray[np.float64],
) -> int:
    """Keep the part of a convex polygon on one side of a plane (Sutherland, Hodgman, 1974)."""
    number = 0
    for k in range(count):
        here, after = corners[k], corners[(k + 1) % count]
        distance = side * (here[axis] - limit)
        distance_after = side * (after[axis] - limit)
        if distance >= 0.0:
            kept[number] = here
            number += 1
        if (distance > 0.0 > distance_after) or (distance < 0.0 < distance_after):
            kept[number] = here + (after - here) * (distance / (distance - distance_after))
            number += 1
    return number


@njit(cache=True, nogil=True)
def cover_volume(left: NDArray[np.bool_], boxes: NDArray[np.int64]) -> int:
    """Cover filled cells with disjoint boxes that hold no other cells; see ``rectangles.cover``.

    Greedy: from the first cell that is not covered yet, a box grows upwards, along y, and along x.

    Args:
        left: bool[X, Y, Z], the cells to cover; covered ones become False.
        boxes: int64[n, 2, 3], filled with the first cell of each box and the one after its last.

    Returns:
        The number of boxes, or n + 1 if there are more.
    """
    count = 0
    for x in range(left.shape[0]):
        for y in range(left.shape[1]):
            for z in range(left.shape[2]):
                if not left[x, y, z]:
                    continue
                if count == len(boxes):
                    return count + 1
                end = boxes[count, 1]
                boxes[count, 0] = x, y, z
                end[:] = x + 1, y + 1, z + 1
                while end[2] < left.shape[2] and left[x, y, end[2]]:
                    end[2] += 1
                while end[1] < left.shape[1] and left[x, end[1], z : end[2]].all():
                    end[1] += 1
                while end[0] < left.shape[0] and left[end[0], y : end[1], z : end[2]].all():
                    end[0] += 1
                left[x : end[0], y : end[1], z : end[2]] = False
                count += 1
    return count
