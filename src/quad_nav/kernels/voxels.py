"""Loops of the voxel layer: rays in three dimensions that clear, points that mark.

``voxels``, uint8[H, W, Z], are FREE, LETHAL or UNKNOWN; ``costs``, uint8[H, W], is what
their columns come to. ``origin`` and ``size``, float64[3], are the corner of voxel
(0, 0, 0) and the edges of one voxel, x, y, z in metres.
"""

from __future__ import annotations

import math

from numba import njit

from quad_nav.grid import FREE, LETHAL, UNKNOWN
from quad_nav.kernels.cells import cell_index
from quad_nav.kernels.raytrace import include


@njit(cache=True, nogil=True)
def clear_voxel_rays(
    voxels,
    costs,
    origin,
    size,
    sensor,
    points,
    range_m,
    max_height_m,
    unknown_threshold,
    mark_threshold,
    bounds,
):
    """Free the voxels from the sensor towards each point, and their columns' costs.

    sensor: float64[3], points: float32[n, 3], in the frame of the grid. ``bounds``,
    float64[4] (min x, min y, max x, max y in metres), grows by what was touched. A sensor
    outside the voxels clears nothing: returns False.
    """
    size_y, size_x, size_z = voxels.shape
    if (
        cell_index(sensor[0], origin[0], size[0], size_x) < 0
        or cell_index(sensor[1], origin[1], size[1], size_y) < 0
        or cell_index(sensor[2], origin[2], size[2], size_z) < 0
    ):
        return False
    include(bounds, sensor[0], sensor[1])
    max_voxels = max(0.0, math.ceil(range_m / size[0]))
    for k in range(points.shape[0]):
        x, y, z = ray_end(origin, size, size_x, size_y, sensor, points[k], max_height_m)
        if (
            cell_index(x, origin[0], size[0], size_x) < 0
            or cell_index(y, origin[1], size[1], size_y) < 0
            or cell_index(z, origin[2], size[2], size_z) < 0
        ):
            continue
        clear_voxel_line(
            voxels,
            costs,
            (sensor[0] - origin[0]) / size[0],
            (sensor[1] - origin[1]) / size[1],
            (sensor[2] - origin[2]) / size[2],
            (x - origin[0]) / size[0],
            (y - origin[1]) / size[1],
            (z - origin[2]) / size[2],
            max_voxels,
            unknown_threshold,
            mark_threshold,
        )
        dx, dy = x - sensor[0], y - sensor[1]
        length = math.hypot(dx, dy)
        scale = range_m / length if length > range_m else 1.0
        include(bounds, sensor[0] + dx * scale, sensor[1] + dy * scale)
    return True


@njit(cache=True, nogil=True)
def ray_end(origin, size, size_x, size_y, sensor, point, max_height_m):
    """Where the ray to a point stops: two cells short of it, and inside the voxels.

    Two cells, so that a ray does not clear the obstacle that it has met.
    """
    dx, dy, dz = point[0] - sensor[0], point[1] - sensor[1], point[2] - sensor[2]
    length = math.sqrt(dx * dx + dy * dy + dz * dz)
    short = 0.0 if length <= 2.0 * size[0] else (length - 2.0 * size[0]) / length
    dx, dy, dz = short * dx, short * dy, short * dz
    x, y, z = sensor[0] + dx, sensor[1] + dy, sensor[2] + dz
    high_x = origin[0] + (size_x - 0.5) * size[0]
    high_y = origin[1] + (size_y - 0.5) * size[1]
    t = 1.0
    if z > max_height_m:
        t = _cut(t, max_height_m - 0.01 - sensor[2], dz)
    elif z < origin[2]:
        t = _cut(t, origin[2] - sensor[2], dz)
    if x < origin[0]:
        t = _cut(t, origin[0] - sensor[0], dx)
    if y < origin[1]:
        t = _cut(t, origin[1] - sensor[1], dy)
    if x > high_x:
        t = _cut(t, high_x - sensor[0], dx)
    if y > high_y:
        t = _cut(t, high_y - sensor[1], dy)
    # Rounding must not put an end on the low border outside.
    return (
        max(sensor[0] + dx * t, origin[0]),
        max(sensor[1] + dy * t, origin[1]),
        max(sensor[2] + dz * t, origin[2]),
    )


@njit(cache=True, nogil=True)
def _cut(t, to_border, step):
    """The part of a ray up to a border, if that is less than ``t``; never backwards."""
    if step == 0.0:
        return 0.0
    return max(0.0, min(t, to_border / step))


@njit(cache=True, nogil=True)
def clear_voxel_line(
    voxels, costs, x0, y0, z0, x1, y1, z1, max_voxels, unknown_threshold, mark_threshold
):
    """Free the voxels between two points, in voxels from the corner, both ends included.

    Bresenham's line in three dimensions, cut to about ``max_voxels`` along it.
    """
    length = math.sqrt((x1 - x0) ** 2 + (y1 - y0) ** 2 + (z1 - z0) ** 2)
    scale = max_voxels / length if length > max_voxels else 1.0
    x, y, z = int(x0), int(y0), int(z0)
    dx, dy, dz = int(x1) - x, int(y1) - y, int(z1) - z
    steps = max(abs(dx), abs(dy), abs(dz))
    error_x = error_y = error_z = steps // 2
    for _ in range(int(scale * steps)):
        clear_voxel(voxels, costs, x, y, z, unknown_threshold, mark_threshold)
        error_x += abs(dx)
        error_y += abs(dy)
        error_z += abs(dz)
        if error_x >= steps:
            x += 1 if dx > 0 else -1
            error_x -= steps
        if error_y >= steps:
            y += 1 if dy > 0 else -1
            error_y -= steps
        if error_z >= steps:
            z += 1 if dz > 0 else -1
            error_z -= steps
    clear_voxel(voxels, costs, x, y, z, unknown_threshold, mark_threshold)


@njit(cache=True, nogil=True)
def clear_voxel(voxels, costs, x, y, z, unknown_threshold, mark_threshold):
    """Free one voxel, and its column's cost unless the column still holds an obstacle.

    A column with more than ``unknown_threshold`` unknown voxels is unknown.
    """
    voxels[y, x, z] = FREE
    marked = unknown = 0
    for k in range(voxels.shape[2]):
        marked += voxels[y, x, k] == LETHAL
        unknown += voxels[y, x, k] == UNKNOWN
    if marked <= mark_threshold:
        costs[y, x] = FREE if unknown <= unknown_threshold else UNKNOWN


@njit(cache=True, nogil=True)
def mark_voxels(
    voxels, costs, origin, size, sensor, points, range_m, max_height_m, mark_threshold, bounds
):
    """Mark the voxel of each point nearer than ``range_m`` and not too high.

    The cost is lethal in columns with more than ``mark_threshold`` marked voxels. What is
    below the voxels goes into the lowest one, what is above them nowhere. Arguments as in
    ``clear_voxel_rays``.
    """
    size_y, size_x, size_z = voxels.shape
    for i in range(points.shape[0]):
        x, y, z = float(points[i, 0]), float(points[i, 1]), float(points[i, 2])
        if z > max_height_m:
            continue
        dx, dy, dz = x - sensor[0], y - sensor[1], z - sensor[2]
        if dx * dx + dy * dy + dz * dz >= range_m * range_m:
            continue
        cell_x = cell_index(x, origin[0], size[0], size_x)
        cell_y = cell_index(y, origin[1], size[1], size_y)
        cell_z = cell_index(max(z, origin[2]), origin[2], size[2], size_z)
        if cell_x < 0 or cell_y < 0 or cell_z < 0:
            continue
        voxels[cell_y, cell_x, cell_z] = LETHAL
        marked = 0
        for k in range(size_z):
            marked += voxels[cell_y, cell_x, k] == LETHAL
        if marked > mark_threshold:
            costs[cell_y, cell_x] = LETHAL
            include(bounds, x, y)
