"""Voxel layer: rays in three dimensions that clear, points that mark.

Mirrors ``costmap/voxel.py``.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.costmap.collision import Triple
from quad_nav.costmap.cost_grid_kernel import cell_index, include
from quad_nav.files.kernel_cache import njit
from quad_nav.grid import FREE, LETHAL, UNKNOWN


class VoxelGrid(NamedTuple):
    """Voxels and the costs of their columns."""

    voxels: NDArray[np.uint8]  # [H, W, Z], FREE, LETHAL or UNKNOWN
    costs: NDArray[np.uint8]  # [H, W]
    origin: NDArray[np.float64]  # [3], corner of voxel (0, 0, 0) in the global frame, metres
    size: NDArray[np.float64]  # [3], edges of a voxel along x, y, z, metres
    unknown_threshold: int  # a column with more unknown voxels is unknown
    mark_threshold: int  # a column with more marked voxels is lethal


class RayLimits(NamedTuple):
    """Limits of the rays that clear."""

    range_m: float  # length to which they clear
    max_height_m: float  # height at which they are cut
    clip: bool  # cut at all borders, never backwards, with the end inside; else as upstream


@njit(cache=True, nogil=True)
def clear_voxel_rays(
    grid: VoxelGrid,
    sensor: NDArray[np.float64],
    points: NDArray[np.float32],
    limits: RayLimits,
    bounds: NDArray[np.float64],
) -> bool:
    """Free the voxels from a sensor towards each of its points, and their columns' costs.

    Sensor, float64[3], and points, float32[n, 3], are in the global frame. Bounds, float64[4], grow
    by the ends of rays, and by the sensor if rays are clipped. A sensor outside of the voxels
    clears nothing; then the result is False.
    """
    origin, size = grid.origin, grid.size
    if not is_inside(grid, sensor[0], sensor[1], sensor[2]):
        return False
    if limits.clip:
        include(bounds, sensor[0], sensor[1])
    range_m = limits.range_m
    max_voxels = max(0.0, math.ceil(range_m / size[0]))
    begin = (
        (sensor[0] - origin[0]) / size[0],
        (sensor[1] - origin[1]) / size[1],
        (sensor[2] - origin[2]) / size[2],
    )
    for k in range(points.shape[0]):
        x, y, z = ray_end(grid, sensor, points[k], limits)
        if not is_inside(grid, x, y, z):
            continue
        end = (x - origin[0]) / size[0], (y - origin[1]) / size[1], (z - origin[2]) / size[2]
        clear_voxel_line(grid, begin, end, max_voxels)
        dx, dy = x - sensor[0], y - sensor[1]
        length = math.hypot(dx, dy)
        scale = range_m / length if length > range_m else 1.0
        include(bounds, sensor[0] + dx * scale, sensor[1] + dy * scale)
    return True


@njit(cache=True, nogil=True)
def is_inside(grid: VoxelGrid, x: float, y: float, z: float) -> bool:
    """Tell whether a point is in one of the voxels."""
    origin, size = grid.origin, grid.size
    size_y, size_x, size_z = grid.voxels.shape
    return (
        cell_index(x, origin[0], size[0], size_x) >= 0
        and cell_index(y, origin[1], size[1], size_y) >= 0
        and cell_index(z, origin[2], size[2], size_z) >= 0
    )


@njit(cache=True, nogil=True)
def ray_ends(
    grid: VoxelGrid, sensor: NDArray[np.float64], points: NDArray[np.float32], limits: RayLimits
) -> NDArray[np.float32]:
    """Return the ends of the rays that clear, float32[n, 3]; see ``clear_voxel_rays``."""
    ends, count = np.empty((points.shape[0], 3), np.float32), 0
    for k in range(points.shape[0]):
        x, y, z = ray_end(grid, sensor, points[k], limits)
        if is_inside(grid, x, y, z):
            ends[count, 0], ends[count, 1], ends[count, 2] = x, y, z
            count += 1
    return ends[:count]


@njit(cache=True, nogil=True)
def ray_end(
    grid: VoxelGrid, sensor: NDArray[np.float64], point: NDArray[np.float32], limits: RayLimits
) -> Triple:
    """Return the point (x, y, z) where the ray from a sensor, float64[3], to a point ends.

    It is two cells short of the point, so that a ray does not clear the obstacle that it met, and
    before the borders of the voxels. The order of operations is that of costmap_2d. Without
    ``clip`` the end can be outside of the voxels by rounding, or above them, and behind the sensor
    if that is in the last half cell.
    """
    origin, size = grid.origin, grid.size
    size_y, size_x, size_z = grid.voxels.shape
    dx, dy, dz = point[0] - sensor[0], point[1] - sensor[1], point[2] - sensor[2]
    length = math.sqrt(dx * dx + dy * dy + dz * dz)
    if not math.isfinite(length):
        return math.nan, math.nan, math.nan
    short = 0.0
    if length > 2.0 * size[0]:
        short = min(1.0, (length - 2.0 * size[0]) / length)
    x, y, z = short * dx + sensor[0], short * dy + sensor[1], short * dz + sensor[2]
    dx, dy, dz = x - sensor[0], y - sensor[1], z - sensor[2]
    high_x = origin[0] + (size_x - 0.5) * size[0]
    high_y = origin[1] + (size_y - 0.5) * size[1]
    top = limits.max_height_m
    if limits.clip:
        top = min(top, origin[2] + size_z * size[2])
    t = 1.0
    if z > top or (limits.clip and z == top):
        t = max(0.0, _cut(t, top - 0.01 - sensor[2], dz))
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
    if not limits.clip:
        return sensor[0] + dx * t, sensor[1] + dy * t, sensor[2] + dz * t
    t = max(0.0, t)
    return (
        max(sensor[0] + dx * t, origin[0]),
        max(sensor[1] + dy * t, origin[1]),
        max(sensor[2] + dz * t, origin[2]),
    )


@njit(cache=True, nogil=True)
def _cut(t: float, to_border: float, step: float) -> float:
    """Return the part of a ray up to a border, if less than ``t``; division as in C++."""
    if step == 0.0:
        return -math.inf if to_border < 0.0 else t
    return to_border / step if to_border / step < t else t


@njit(cache=True, nogil=True)
def clear_voxel_line(grid: VoxelGrid, begin: Triple, end: Triple, max_voxels: float) -> None:
    """Free the voxels of Bresenham's line between two points, in voxels from the corner.

    Both of its ends are included. It is cut to ``max_voxels``, measured along the line.
    """
    x0, y0, z0 = begin
    x1, y1, z1 = end
    length = math.sqrt((x1 - x0) ** 2 + (y1 - y0) ** 2 + (z1 - z0) ** 2)
    scale = max_voxels / length if length > max_voxels else 1.0
    x, y, z = int(x0), int(y0), int(z0)
    dx, dy, dz = int(x1) - x, int(y1) - y, int(z1) - z
    steps = max(abs(dx), abs(dy), abs(dz))
    error_x = error_y = error_z = steps // 2
    for _ in range(int(scale * steps)):
        clear_voxel(grid, x, y, z)
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
    clear_voxel(grid, x, y, z)


@njit(cache=True, nogil=True)
def clear_voxel(grid: VoxelGrid, x: int, y: int, z: int) -> None:
    """Free a voxel, and its column's cost unless the column still holds an obstacle.

    A column with more unknown voxels than the threshold becomes unknown.
    """
    voxels = grid.voxels
    voxels[y, x, z] = FREE
    marked = unknown = 0
    for k in range(voxels.shape[2]):
        marked += voxels[y, x, k] == LETHAL
        unknown += voxels[y, x, k] == UNKNOWN
    if marked <= grid.mark_threshold:
        grid.costs[y, x] = FREE if unknown <= grid.unknown_threshold else UNKNOWN


@njit(cache=True, nogil=True)
def mark_voxels(
    grid: VoxelGrid,
    sensor: NDArray[np.float64],
    points: NDArray[np.float32],
    range_m: float,
    max_height_m: float,
    bounds: NDArray[np.float64],
) -> None:
    """Mark the voxels of points, and make lethal the columns with enough marked voxels.

    Points below the voxels go into the lowest one; points above them, above ``max_height_m``, or
    ``range_m`` or more from the sensor are ignored. Bounds, float64[4], grow by lethal columns.
    """
    voxels, origin, size = grid.voxels, grid.origin, grid.size
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
        if marked > grid.mark_threshold:
            grid.costs[cell_y, cell_x] = LETHAL
            include(bounds, x, y)
