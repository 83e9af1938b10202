"""A scene's obstacles and walls as the arrays that the LIDAR's kernel casts beams at."""

from __future__ import annotations

import math
from typing import List, Sequence, Tuple

import numpy as np

from quad_nav.geometry import yaw_rotations
from quad_nav.kernels.lidar import SolidGrid, Solids
from quad_nav.kernels.rays import BOX, CYLINDER, SPHERE
from quad_nav.sim.scene import Box, Obstacle, Scene, Sphere

_MANY = 500
"""Solids that are projected one by one in as long as beams need to walk through a grid."""
_LARGE_CELLS = 32
"""Columns that a solid may cover in the grid; a larger one is projected."""
_MIN_CELL_M = 0.25
_PADDING_M = 1e-6
"""More than rounding: a solid is in every column that its faces touch."""


def split_scene(scene: Scene) -> Tuple[Solids, SolidGrid]:
    """The solids to project one by one, and those to walk through in a grid.

    Up to some hundreds all are projected; beyond, only the large ones.
    """
    solids = solids_of([*scene.wall_boxes(), *scene.obstacles])
    count = len(solids.kinds)
    if count <= _MANY:
        return solids, grid_of(take(solids, np.zeros(0, int)), _MIN_CELL_M)
    low, high = extents(solids)
    area_m2 = float(np.prod((high.max(axis=0) - low.min(axis=0))[:2]))
    cell_m = max(_MIN_CELL_M, math.sqrt(area_m2 / count))
    covered = np.prod((high - low)[:, :2] / cell_m + 1.0, axis=1)
    return (
        take(solids, np.flatnonzero(covered > _LARGE_CELLS)),
        grid_of(take(solids, np.flatnonzero(covered <= _LARGE_CELLS)), cell_m),
    )


def solids_of(obstacles: Sequence[Obstacle]) -> Solids:
    """One row for each obstacle."""
    kinds, centres, yaws, sizes = [], [], [], []
    for solid in obstacles:
        kind, yaw_rad, size = _shape(solid)
        kinds.append(kind)
        centres.append((solid.x_m, solid.y_m, solid.bottom_m + solid.height_m / 2))
        yaws.append(yaw_rad)
        sizes.append(size)
    return Solids(
        np.array(kinds, np.int64),
        np.array(centres, float).reshape(-1, 3),
        np.ascontiguousarray(np.swapaxes(yaw_rotations(np.array(yaws, float)), 1, 2)),
        np.array(sizes, float).reshape(-1, 3),
    )


def _shape(solid: Obstacle) -> Tuple[int, float, Tuple[float, float, float]]:
    """Kind, yaw and sizes as in ``kernels.rays``."""
    if isinstance(solid, Box):
        return BOX, solid.yaw_rad, (solid.size_x_m / 2, solid.size_y_m / 2, solid.height_m / 2)
    if isinstance(solid, Sphere):
        return SPHERE, 0.0, (solid.radius_m, solid.radius_m, solid.radius_m)
    return CYLINDER, 0.0, (solid.radius_m, solid.radius_m, solid.height_m / 2)


def take(solids: Solids, rows: np.ndarray) -> Solids:
    """Some of them, int64[k]."""
    return Solids(*(column[rows] for column in solids))


def join(first: Solids, second: Solids) -> Solids:
    """All of both."""
    return Solids(*(np.concatenate(columns) for columns in zip(first, second)))


def extents(solids: Solids) -> Tuple[np.ndarray, np.ndarray]:
    """Lower and upper corners float64[s, 3] of upright boxes around solids."""
    reach = np.sum(np.abs(solids.rotations) * solids.sizes[:, :, None], axis=1) + _PADDING_M
    round_ = solids.kinds != BOX
    reach[round_] = solids.sizes[round_] + _PADDING_M  # they have no corners, and stand upright
    return solids.centres - reach, solids.centres + reach


def grid_of(solids: Solids, cell_m: float) -> SolidGrid:
    """Solids that rest, sorted into the square columns that they reach into."""
    if len(solids.kinds) == 0:
        return SolidGrid(
            solids,
            np.zeros(3),
            np.zeros(3),
            cell_m,
            np.zeros((1, 2), np.int32),
            np.zeros(0, np.int32),
        )
    lows, highs = extents(solids)
    low, high = lows.min(axis=0), highs.max(axis=0)
    columns, rows = (np.floor((high - low)[:2] / cell_m).astype(int) + 1).tolist()
    first = np.floor((lows - low)[:, :2] / cell_m).astype(int).tolist()
    last = np.floor((highs - low)[:, :2] / cell_m).astype(int).tolist()
    cells: List[List[int]] = [[] for _ in range(rows * columns)]
    for number, ((x0, y0), (x1, y1)) in enumerate(zip(first, last)):
        for y in range(y0, y1 + 1):
            for x in range(x0, x1 + 1):
                cells[y * columns + x].append(number)
    starts = np.concatenate([[0], np.cumsum([len(cell) for cell in cells])])
    rows_of_starts = starts[np.arange(rows)[:, None] * columns + np.arange(columns + 1)]
    return SolidGrid(
        solids,
        low,
        high,
        float(cell_m),
        rows_of_starts.astype(np.int32),
        np.array([number for cell in cells for number in cell], np.int32),
    )
