"""Cells of a grid that a scene's walls and obstacles take, and the parts that they leave.

Every solid looks only at the cells around it: the time depends on the area that the solids cover,
not on that of the scene.
"""

from __future__ import annotations

import math
from typing import Sequence

import numpy as np
from numpy.typing import NDArray

from quad_nav.files.kernel_cache import njit
from quad_nav.grid import GridSpec
from quad_nav.sim.obstacles import Box
from quad_nav.sim.scene import Scene


def touched_cells(scene: Scene, spec: GridSpec, margin_m: float = 0.0) -> NDArray[np.bool_]:
    """Return the cells of a grid in ``map`` that a hull in flight cannot have its axis in.

    These are the cells of bool[H, W] whose centres are in a solid of ``Scene.in_flight``, or at
    most ``margin_m`` from one.
    """
    touched = np.zeros(spec.shape, np.bool_)
    columns_rows = (np.arange(size, dtype=np.float64) for size in (spec.size_x, spec.size_y))
    x_m, y_m = ((cells + 0.5) * spec.resolution_m for cells in columns_rows)
    x_m, y_m = spec.origin_x_m + x_m, spec.origin_y_m + y_m
    boxes = [solid for solid in scene.in_flight if isinstance(solid, Box)]
    _mark_boxes(touched, x_m, y_m, _rows_of(boxes), margin_m)
    for solid in scene.in_flight:
        if isinstance(solid, Box):
            continue
        reach_m = solid.reach_m + margin_m
        columns = slice(*np.searchsorted(x_m, (solid.x_m - reach_m, solid.x_m + reach_m)))
        rows = slice(*np.searchsorted(y_m, (solid.y_m - reach_m, solid.y_m + reach_m)))
        around = x_m[None, columns], y_m[rows, None]
        distances_m = solid.surface_distance_m(*around, scene.altitude_m)
        touched[rows, columns] |= distances_m <= margin_m
    return touched


def _rows_of(boxes: Sequence[Box]) -> NDArray[np.float64]:
    """Return centre, half sizes, cosine and sine of the yaw of boxes, float64[n, 6]."""
    rows = [
        (one.x_m, one.y_m, one.size_x_m / 2, one.size_y_m / 2, one.yaw_rad, one.yaw_rad)
        for one in boxes
    ]
    table = np.array(rows, np.float64).reshape(-1, 6)
    table[:, 4], table[:, 5] = np.cos(table[:, 4]), np.sin(table[:, 5])
    return table


@njit(cache=True, nogil=True)
def _mark_boxes(
    touched: NDArray[np.bool_],
    x_m: NDArray[np.float64],
    y_m: NDArray[np.float64],
    boxes: NDArray[np.float64],
    margin_m: float,
) -> None:
    """Mark the cells, with centres at these x and y, that are at most a margin from a box."""
    for box in range(len(boxes)):
        x, y, half_x, half_y, cos, sin = boxes[box]
        reach_x = half_x * abs(cos) + half_y * abs(sin) + margin_m
        reach_y = half_x * abs(sin) + half_y * abs(cos) + margin_m
        first_column, end_column = np.searchsorted(x_m, x - reach_x), len(x_m)
        for row in range(np.searchsorted(y_m, y - reach_y), len(y_m)):
            dy = y_m[row] - y
            if dy > reach_y:
                break
            for column in range(first_column, end_column):
                dx = x_m[column] - x
                if dx > reach_x:
                    break
                outside_x = max(abs(cos * dx + sin * dy) - half_x, 0.0)
                outside_y = max(abs(cos * dy - sin * dx) - half_y, 0.0)
                if math.hypot(outside_x, outside_y) <= margin_m:
                    touched[row, column] = True


def parts_of(free: NDArray[np.bool_]) -> NDArray[np.int32]:
    """Number the parts of a grid that hang together.

    Args:
        free: bool[H, W]; free cells that have a side in common are of one part.

    Returns:
        int32[H, W], the number of each cell's part, from 1; 0 where it is not free.
    """
    parts = np.zeros(free.shape, np.int32)
    _number(free.ravel(), parts.ravel(), free.shape[1], np.empty(free.size, np.int64))
    return parts


@njit(cache=True, nogil=True)
def _number(
    free: NDArray[np.bool_], parts: NDArray[np.int32], width: int, stack: NDArray[np.int64]
) -> None:
    """Fill ``parts``, one part after the other, each from its first cell."""
    part = 0
    for first in range(free.size):
        if not free[first] or parts[first]:
            continue
        part += 1
        parts[first], stack[0], count = part, first, 1
        while count:
            count -= 1
            cell = stack[count]
            column = cell % width
            for step, is_inside in (
                (-1, column > 0),
                (1, column < width - 1),
                (-width, cell >= width),
                (width, cell < free.size - width),
            ):
                near = cell + step
                if is_inside and free[near] and not parts[near]:
                    parts[near] = part
                    stack[count] = near
                    count += 1
