"""Loops of the obstacle layer: Bresenham rays that clear, points that mark."""
from __future__ import annotations

import math

import numpy as np
from numba import njit

from quad_nav.grid import FREE, LETHAL
from quad_nav.kernels.cells import cell_index


@njit(cache=True, nogil=True)
def clear_line(flat_costs, size_x, x0, y0, x1, y1, max_cells):
    """Free the cells from (x0, y0) towards (x1, y1), both inside the grid.

    flat_costs: uint8[H * W], rows of ``size_x`` cells. The line is cut to about
    ``max_cells``, measured along it; both of its ends are freed.
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
def clip_to_grid(sensor_x, sensor_y, x, y, low_x, low_y, high_x, high_y):
    """The ray's end pulled back along the ray to the grid's border.

    Ends beyond the high borders land 1 mm inside, so that they fall into a cell.
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
def clear_rays(costs, origin_x, origin_y, resolution, sensor_x, sensor_y, points, range_m,
               cleared, bounds):
    """Free the cells between the sensor and each point, up to ``range_m``.

    points: float32[n, 3] in the frame of the grid. ``cleared``, int64[2 ** b], -1 at
    first, remembers the last line that was cleared to each cell, of large grids to one of
    several cells: a slow robot's scans have most lines in common. ``bounds``, float64[4] (min x,
    min y, max x, max y in metres), grows by what was touched. A sensor outside the
    grid clears nothing: returns False.
    """
    size_y, size_x = costs.shape
    x0 = cell_index(sensor_x, origin_x, resolution, size_x)
    y0 = cell_index(sensor_y, origin_y, resolution, size_y)
    if x0 < 0 or y0 < 0:
        return False
    include(bounds, sensor_x, sensor_y)
    high_x, high_y = origin_x + size_x * resolution, origin_y + size_y * resolution
    max_cells = max(0.0, math.ceil(range_m / resolution))
    flat_costs = costs.reshape(-1)
    start = y0 * size_x + x0
    places = np.uint64(cleared.size - 1)
    surely_near = (1.0 - 1e-9) * range_m * range_m
    for k in range(points.shape[0]):
        x, y = clip_to_grid(sensor_x, sensor_y, float(points[k, 0]), float(points[k, 1]),
                            origin_x, origin_y, high_x, high_y)
        x1 = cell_index(x, origin_x, resolution, size_x)
        y1 = cell_index(y, origin_y, resolution, size_y)
        if x1 < 0 or y1 < 0:
            continue
        end = y1 * size_x + x1
        line = start * costs.size + end
        place = np.uint64(end) & places
        if cleared[place] != line:
            cleared[place] = line
            clear_line(flat_costs, size_x, x0, y0, x1, y1, max_cells)
        dx, dy = x - sensor_x, y - sensor_y
        scale = 1.0
        if dx * dx + dy * dy > surely_near:  # hypot is slow, and most points are near
            length = math.hypot(dx, dy)
            scale = range_m / length if length > range_m else 1.0
        include(bounds, sensor_x + dx * scale, sensor_y + dy * scale)
    return True


@njit(cache=True, nogil=True)
def clear_all_rays(costs, origin_x, origin_y, resolution, sensors, points, ends, range_m, cleared,
                   bounds):
    """``clear_rays`` of several observations, in order.

    Observation k has sensors[k], float64[3], and points from ends[k - 1], or 0, to ends[k].
    """
    begin = 0
    for k in range(len(ends)):
        clear_rays(costs, origin_x, origin_y, resolution, sensors[k, 0], sensors[k, 1],
                   points[begin:ends[k]], range_m, cleared, bounds)
        begin = ends[k]


@njit(cache=True, nogil=True)
def mark_all_points(costs, origin_x, origin_y, resolution, sensors, points, ends, range_m,
                    max_height_m, bounds):
    """``mark_points`` of several observations, as in ``clear_all_rays``."""
    begin = 0
    for k in range(len(ends)):
        mark_points(costs, origin_x, origin_y, resolution, sensors[k], points[begin:ends[k]],
                    range_m, max_height_m, bounds)
        begin = ends[k]


@njit(cache=True, nogil=True)
def mark_points(costs, origin_x, origin_y, resolution, sensor, points, range_m, max_height_m,
                bounds):
    """Make lethal the cell of each point nearer than ``range_m`` and not too high.

    sensor: float64[3], points: float32[n, 3], in the frame of the grid. ``bounds`` as
    in ``clear_rays``.
    """
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
def include(bounds, x, y):
    """Grow float64[4] (min x, min y, max x, max y) to hold a point."""
    bounds[0] = min(bounds[0], x)
    bounds[1] = min(bounds[1], y)
    bounds[2] = max(bounds[2], x)
    bounds[3] = max(bounds[3], y)
