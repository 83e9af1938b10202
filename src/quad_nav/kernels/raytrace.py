"""Obstacle layer: Bresenham rays that clear, points that mark.

Mirrors ``costmap/obstacle.py``.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.grid import FREE, LETHAL
from quad_nav.kernels.cost_grid import CostmapView, cell_index
from quad_nav.kernels.jit import njit
from quad_nav.kernels.obstructed_cells import (
    MAX_OBSTRUCTED,
    SECTORS,
    find_obstructed,
    find_sectors,
    keep_obstructed,
    sector_of,
)

MAX_LINES = 2**16  # that an update remembers: in grids up to 256 x 256 one to each cell


class ObservationStack(NamedTuple):
    """Observations of one source, newest first, metres in the frame of the costmap.

    Observation k has the points from ``begins[k]`` to ``ends[k]``; other points are old.
    """

    sensors: NDArray[np.float64]  # [k, 3], where the rays start
    points: NDArray[np.float32]  # [n, 3]
    begins: NDArray[np.int64]  # [k]
    ends: NDArray[np.int64]  # [k]


@njit(cache=True, nogil=True)
def clear_line(
    flat_costs: NDArray[np.uint8], size_x: int, x0: int, y0: int, x1: int, y1: int, max_cells: float
) -> None:
    """Free the cells of Bresenham's line, both of its ends included.

    Args:
        flat_costs: uint8[H * W], changed in place.
        size_x: Cells in a row.
        x0: Column of the first cell, inside the grid.
        y0: Row of the first cell.
        x1: Column of the cell that the line leads to, inside the grid.
        y1: Row of that cell.
        max_cells: Length, measured along the line, to which it is cut.
    """
    dx, dy = x1 - x0, y1 - y0
    scale = 1.0
    if dx * dx + dy * dy > max_cells * max_cells:
        scale = max_cells / math.hypot(dx, dy)
    along, across = abs(dx), abs(dy)
    step_along = 1 if dx > 0 else -1
    step_across = size_x if dy > 0 else -size_x
    if across > along:
        along, across = across, along
        step_along, step_across = step_across, step_along
    cell = y0 * size_x + x0
    error = along // 2
    for _ in range(int(scale * along)):
        flat_costs[np.uint64(cell)] = FREE  # unsigned indices save the test for a negative one
        cell += step_along
        error += across
        if error >= along:
            cell += step_across
            error -= along
    flat_costs[np.uint64(cell)] = FREE


@njit(cache=True, nogil=True)
def clip_to_grid(
    sensor_x: float,
    sensor_y: float,
    x: float,
    y: float,
    low_x: float,
    low_y: float,
    high_x: float,
    high_y: float,
) -> Tuple[float, float]:
    """Pull the end (x, y) of a ray back along the ray to the grid's border.

    Ends beyond the high borders land 1 mm inside, so that they fall into a cell. All
    numbers are metres in the frame of the grid.
    """
    dx, dy = x - sensor_x, y - sensor_y
    if x < low_x:
        t = (low_x - sensor_x) / dx
        x, y = low_x, sensor_y + dy * t
    if y < low_y:
        t = (low_y - sensor_y) / dy
        x, y = sensor_x + dx * t, low_y
    if x > high_x:
        t = (high_x - sensor_x) / dx
        x, y = high_x - 0.001, sensor_y + dy * t
    if y > high_y:
        t = (high_y - sensor_y) / dy
        x, y = sensor_x + dx * t, high_y - 0.001
    return x, y


@njit(cache=True, nogil=True)
def clear_rays(
    costmap: CostmapView,
    sensor_x: float,
    sensor_y: float,
    points: NDArray[np.float32],
    range_m: float,
    sectors: NDArray[np.bool_],
    cleared: NDArray[np.int64],
    bounds: NDArray[np.float64],
) -> bool:
    """Free the cells between a sensor and each of its points.

    Args:
        costmap: The costmap, changed in place.
        sensor_x: x of the sensor in the frame of the costmap, metres.
        sensor_y: y of the sensor.
        points: float32[n, 3], metres in the frame of the costmap.
        range_m: Length to which rays are cleared.
        sectors: bool[SECTORS]; lines into sectors that are False are skipped. Empty skips all.
        cleared: int64[2 ** b], -1 at first; remembers the last line that was cleared to each
            cell, or to one of several cells of a large grid. A slow robot's scans have most
            lines in common. May be empty.
        bounds: float64[4], min x, min y, max x, max y in metres, grown by what rays reach.

    Returns:
        False if the sensor is off the costmap and nothing was cleared.
    """
    costs, origin_x, origin_y, resolution = costmap
    size_y, size_x = costs.shape
    x0 = cell_index(sensor_x, origin_x, resolution, size_x)
    y0 = cell_index(sensor_y, origin_y, resolution, size_y)
    if x0 < 0 or y0 < 0:
        return False
    include(bounds, sensor_x, sensor_y)
    high_x, high_y = origin_x + size_x * resolution, origin_y + size_y * resolution
    # A ray that leaves the grid ends in it. The last millimetre makes no other cell.
    whole = (
        bounds[0] <= origin_x
        and bounds[1] <= origin_y
        and bounds[2] >= high_x - 0.001
        and bounds[3] >= high_y - 0.001
    )
    max_cells = max(0.0, math.ceil(range_m / resolution))
    flat_costs = costs.reshape(-1)
    start = y0 * size_x + x0
    places = np.uint64(max(cleared.size - 1, 0))
    surely_near, surely_far = (1.0 - 1e-9) * range_m * range_m, (1.0 + 1e-9) * range_m * range_m
    for k in range(points.shape[0]):
        x, y = float(points[k, 0]), float(points[k, 1])
        wanted = sectors.size > 0 and sectors[sector_of(x - sensor_x, y - sensor_y)]
        if not wanted:
            if bounds[0] <= x <= bounds[2] and bounds[1] <= y <= bounds[3]:
                continue
            if whole and not (origin_x <= x <= high_x and origin_y <= y <= high_y):
                continue
            if _range_ends_inside(
                bounds, sensor_x, sensor_y, x - sensor_x, y - sensor_y, surely_far
            ):
                continue
        x, y = clip_to_grid(sensor_x, sensor_y, x, y, origin_x, origin_y, high_x, high_y)
        x1 = cell_index(x, origin_x, resolution, size_x)
        y1 = cell_index(y, origin_y, resolution, size_y)
        if x1 < 0 or y1 < 0:
            continue
        dx, dy = x - sensor_x, y - sensor_y
        if wanted:
            line = start * costs.size + y1 * size_x + x1
            place = np.uint64(y1 * size_x + x1) & places
            if cleared.size == 0 or cleared[place] != line:
                if cleared.size > 0:
                    cleared[place] = line
                clear_line(flat_costs, size_x, x0, y0, x1, y1, max_cells)
        scale = 1.0
        if dx * dx + dy * dy > surely_near:  # hypot is slow, and most points are near
            length = math.hypot(dx, dy)
            scale = range_m / length if length > range_m else 1.0
        include(bounds, sensor_x + dx * scale, sensor_y + dy * scale)
    return True


@njit(cache=True, nogil=True)
def _range_ends_inside(
    bounds: NDArray[np.float64], x: float, y: float, dx: float, dy: float, square_m2: float
) -> bool:
    """Tell whether the point of a ray in direction (dx, dy) is inside the bounds, as (x, y) is.

    ``square_m2`` is the square of its distance.
    """
    to_x = bounds[2] - x if dx > 0.0 else x - bounds[0]
    to_y = bounds[3] - y if dy > 0.0 else y - bounds[1]
    length = dx * dx + dy * dy
    return (
        length * to_x * to_x >= square_m2 * dx * dx and length * to_y * to_y >= square_m2 * dy * dy
    )


@njit(cache=True, nogil=True)
def clear_all_rays(
    costmap: CostmapView, seen: ObservationStack, range_m: float, bounds: NDArray[np.float64]
) -> None:
    """Apply ``clear_rays`` to several observations, in order.

    A line through nothing but free cells changes nothing. Mostly the first observation
    leaves few cells that are not free; from then on only lines towards those are cleared.

    Args:
        costmap: The costmap, changed in place.
        seen: The observations.
        range_m: Length to which rays are cleared.
        bounds: float64[4], as for ``clear_rays``.
    """
    no_lines = np.empty(0, dtype=np.int64)
    lines = no_lines
    everywhere = np.ones(SECTORS, dtype=np.bool_)
    sectors = np.empty(SECTORS, dtype=np.bool_)
    obstructed = np.empty(MAX_OBSTRUCTED, dtype=np.int64)
    costs, resolution = costmap.costs, costmap.resolution_m
    window = _reached(costmap, seen.sensors, range_m)
    count = find_obstructed(costs, window, obstructed)
    for k in range(len(seen.ends)):
        points = seen.points[seen.begins[k] : seen.ends[k]]
        x, y = seen.sensors[k, 0], seen.sensors[k, 1]
        if count == 0:
            clear_rays(costmap, x, y, points, range_m, everywhere[:0], no_lines, bounds)
        elif count <= MAX_OBSTRUCTED:
            find_sectors(
                obstructed[:count],
                costs.shape[1],
                (x - costmap.origin_x_m) / resolution,
                (y - costmap.origin_y_m) / resolution,
                sectors,
            )
            clear_rays(costmap, x, y, points, range_m, sectors, no_lines, bounds)
            count = keep_obstructed(costs.reshape(-1), obstructed, count)
        else:
            if lines.size == 0:
                lines = np.full(_power_of_two(costs.size), -1, dtype=np.int64)
            clear_rays(costmap, x, y, points, range_m, everywhere, lines, bounds)
            if k == 0:  # what is still much after the first mostly stays so
                count = find_obstructed(costs, window, obstructed)


@njit(cache=True, nogil=True)
def _reached(
    costmap: CostmapView, sensors: NDArray[np.float64], range_m: float
) -> Tuple[int, int, int, int]:
    """Window of the cells that rays of a length from any of float64[k, 3] sensors reach."""
    costs, origin_x, origin_y, resolution = costmap
    size_y, size_x = costs.shape
    reach = range_m + 2 * resolution
    low_x, high_x, low_y, high_y = np.inf, -np.inf, np.inf, -np.inf
    for k in range(sensors.shape[0]):
        low_x, high_x = min(low_x, sensors[k, 0]), max(high_x, sensors[k, 0])
        low_y, high_y = min(low_y, sensors[k, 1]), max(high_y, sensors[k, 1])
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
    range_m: float,
    max_height_m: float,
    bounds: NDArray[np.float64],
) -> None:
    """Apply ``mark_points`` to several observations, in order.

    Args:
        costmap: The costmap, changed in place.
        seen: The observations.
        range_m: As for ``mark_points``.
        max_height_m: As for ``mark_points``.
        bounds: float64[4], as for ``clear_rays``.
    """
    for k in range(len(seen.ends)):
        points = seen.points[seen.begins[k] : seen.ends[k]]
        mark_points(costmap, seen.sensors[k], points, range_m, max_height_m, bounds)


@njit(cache=True, nogil=True)
def mark_points(
    costmap: CostmapView,
    sensor: NDArray[np.float64],
    points: NDArray[np.float32],
    range_m: float,
    max_height_m: float,
    bounds: NDArray[np.float64],
) -> None:
    """Make the cells of points lethal.

    Args:
        costmap: The costmap, changed in place.
        sensor: float64[3], position of the sensor in the frame of the costmap, metres.
        points: float32[n, 3], metres in the frame of the costmap.
        range_m: Points at this distance from the sensor, or farther, are ignored.
        max_height_m: Points with a higher z are ignored.
        bounds: float64[4], as for ``clear_rays``, grown by the marked points.
    """
    costs, origin_x, origin_y, resolution = costmap
    size_y, size_x = costs.shape
    for k in range(points.shape[0]):
        x, y, z = float(points[k, 0]), float(points[k, 1]), float(points[k, 2])
        if z > max_height_m:
            continue
        dx, dy, dz = x - sensor[0], y - sensor[1], z - sensor[2]
        if dx * dx + dy * dy + dz * dz >= range_m * range_m:
            continue
        cell_x = cell_index(x, origin_x, resolution, size_x)
        cell_y = cell_index(y, origin_y, resolution, size_y)
        if cell_x < 0 or cell_y < 0:
            continue
        costs[cell_y, cell_x] = LETHAL
        include(bounds, x, y)


@njit(cache=True, nogil=True)
def include(bounds: NDArray[np.float64], x: float, y: float) -> None:
    """Grow bounds, float64[4] min x, min y, max x, max y in metres, to hold a point."""
    bounds[0] = min(bounds[0], x)
    bounds[1] = min(bounds[1], y)
    bounds[2] = max(bounds[2], x)
    bounds[3] = max(bounds[3], y)
