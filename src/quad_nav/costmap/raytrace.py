"""Obstacle layer: Bresenham rays that clear, points that mark.

Mirrors ``costmap/obstacle.py``.
"""

from __future__ import annotations

import math
from typing import Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.costmap.cost_grid_kernel import CostmapView, cell_index, cell_of, draw_line
from quad_nav.costmap.observation_kernel import ObservationStack, clip_to_grid, include_rays
from quad_nav.costmap.obstructed_cells import (
    MAX_OBSTRUCTED,
    SECTORS,
    find_obstructed,
    find_sectors,
    keep_obstructed,
)
from quad_nav.files.kernel_cache import njit
from quad_nav.grid import FREE, LETHAL

MAX_LINES = 2**16  # that an update remembers: in grids up to 256 x 256 one to each cell


@njit(cache=True, nogil=True)
def clear_rays(
    costmap: CostmapView,
    seen: ObservationStack,
    slot: int,
    range_m: float,
    wanted: NDArray[np.bool_],
    cleared: NDArray[np.int64],
) -> None:
    """Free the cells between a sensor on the costmap and each of the points of its slot.

    Args:
        costmap: The costmap, changed in place.
        seen: Observations.
        slot: Slot of the one whose rays clear.
        range_m: Length to which rays are cleared.
        wanted: bool[SECTORS]; lines into sectors that are False are skipped.
        cleared: int64[2 ** b], -1 at first; remembers the last line that was cleared to each
            cell, or to one of several cells of a large grid. A slow robot's scans have most
            lines in common. May be empty.
    """
    costs, origin_x, origin_y, resolution = costmap
    size_y, size_x = costs.shape
    sensor_x, sensor_y = seen.sensors[slot, 0], seen.sensors[slot, 1]
    x0 = cell_index(sensor_x, origin_x, resolution, size_x)
    y0 = cell_index(sensor_y, origin_y, resolution, size_y)
    high_x, high_y = origin_x + size_x * resolution, origin_y + size_y * resolution
    max_cells = max(0.0, math.ceil(range_m / resolution))
    flat_costs = costs.reshape(-1)
    start = y0 * size_x + x0
    places = np.uint64(max(cleared.size - 1, 0))
    ends, sectors = seen.ends[slot], seen.sectors[slot]
    for k in range(seen.counts[slot, 0]):
        if not wanted[sectors[k]]:
            continue
        x, y = float(ends[k, 0]), float(ends[k, 1])
        x, y = clip_to_grid(sensor_x, sensor_y, x, y, origin_x, origin_y, high_x, high_y)
        x1 = cell_index(x, origin_x, resolution, size_x)
        y1 = cell_index(y, origin_y, resolution, size_y)
        if x1 < 0 or y1 < 0:
            continue
        if cleared.size > 0:
            line = start * costs.size + y1 * size_x + x1
            place = np.uint64(y1 * size_x + x1) & places
            if cleared[place] == line:
                continue
            cleared[place] = line
        draw_line(flat_costs, size_x, x0, y0, x1, y1, max_cells, FREE)


@njit(cache=True, nogil=True)
def clear_all_rays(
    costmap: CostmapView,
    seen: ObservationStack,
    newest: int,
    count: int,
    range_m: float,
    bounds: NDArray[np.float64],
) -> None:
    """Apply ``clear_rays`` and ``include_rays`` to ``count`` observations, the newest first.

    A line through nothing but free cells changes nothing. Mostly the first observation leaves few
    cells that are not free; from then on only lines towards those are cleared. A sensor off the
    costmap clears nothing.
    """
    no_lines = np.empty(0, dtype=np.int64)
    lines = no_lines
    everywhere = np.ones(SECTORS, dtype=np.bool_)
    wanted = np.empty(SECTORS, dtype=np.bool_)
    obstructed = np.empty(MAX_OBSTRUCTED, dtype=np.int64)
    costs, resolution = costmap.costs, costmap.resolution_m
    window = _reached(costmap, seen.sensors, newest, count, range_m)
    left = find_obstructed(costs, window, obstructed)
    for k in range(count):
        slot = (newest - k) % seen.sensors.shape[0]
        x, y = seen.sensors[slot, 0], seen.sensors[slot, 1]
        cell_x, cell_y = cell_of(costmap, x, y)
        if cell_x < 0 or cell_y < 0:
            continue
        include_rays(costmap, seen, slot, range_m, bounds)
        if left == 0:
            continue
        if left <= MAX_OBSTRUCTED:
            find_sectors(
                obstructed[:left],
                costs.shape[1],
                (x - costmap.origin_x_m) / resolution,
                (y - costmap.origin_y_m) / resolution,
                wanted,
            )
            clear_rays(costmap, seen, slot, range_m, wanted, no_lines)
            left = keep_obstructed(costs.reshape(-1), obstructed, left)
        else:
            if lines.size == 0:
                lines = np.full(_power_of_two(costs.size), -1, dtype=np.int64)
            clear_rays(costmap, seen, slot, range_m, everywhere, lines)
            if k == 0:  # what is still much after the first mostly stays so
                left = find_obstructed(costs, window, obstructed)


@njit(cache=True, nogil=True)
def _reached(
    costmap: CostmapView, sensors: NDArray[np.float64], newest: int, count: int, range_m: float
) -> Tuple[int, int, int, int]:
    """Window of the cells that rays of a length reach from any of the sensors of a ring."""
    costs, origin_x, origin_y, resolution = costmap
    size_y, size_x = costs.shape
    reach = range_m + 2 * resolution
    low_x, high_x, low_y, high_y = np.inf, -np.inf, np.inf, -np.inf
    for k in range(count):
        x, y = sensors[(newest - k) % sensors.shape[0], :2]
        low_x, high_x = min(low_x, x), max(high_x, x)
        low_y, high_y = min(low_y, y), max(high_y, y)
    x0 = min(max((low_x - reach - origin_x) / resolution, 0.0), float(size_x))
    xn = min(max((high_x + reach - origin_x) / resolution + 1, 0.0), float(size_x))
    y0 = min(max((low_y - reach - origin_y) / resolution, 0.0), float(size_y))
    yn = min(max((high_y + reach - origin_y) / resolution + 1, 0.0), float(size_y))
    return int(x0), int(xn), int(y0), int(yn)


@njit(cache=True, nogil=True)
def _power_of_two(cells: int) -> int:
    """Return the first power of two not below ``cells``, but ``MAX_LINES`` at most."""
    size = 1
    while size < cells and size < MAX_LINES:
        size *= 2
    return size


@njit(cache=True, nogil=True)
def mark_all_points(
    costmap: CostmapView,
    seen: ObservationStack,
    newest: int,
    count: int,
    bounds: NDArray[np.float64],
) -> None:
    """Make the cells of the points that mark lethal, and grow bounds, float64[4], by those."""
    costs, origin_x, origin_y, resolution = costmap
    size_y, size_x = costs.shape
    min_x, min_y, max_x, max_y = bounds[0], bounds[1], bounds[2], bounds[3]
    for one in range(count):
        slot = (newest - one) % seen.sensors.shape[0]
        for k in range(seen.counts[slot, 1]):
            x, y = float(seen.marks[slot, k, 0]), float(seen.marks[slot, k, 1])
            cell_x = cell_index(x, origin_x, resolution, size_x)
            cell_y = cell_index(y, origin_y, resolution, size_y)
            if cell_x >= 0 and cell_y >= 0:
                costs[cell_y, cell_x] = LETHAL
                min_x, max_x = min(min_x, x), max(max_x, x)
                min_y, max_y = min(min_y, y), max(max_y, y)
    bounds[0], bounds[1], bounds[2], bounds[3] = min_x, min_y, max_x, max_y
