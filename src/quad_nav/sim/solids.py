"""Obstacles and walls of a scene as arrays for the LIDAR's kernel, and as groups for the engine."""

from __future__ import annotations

import math
from typing import List, Sequence, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.geometry import yaw_rotations
from quad_nav.sim.lidar_kernel import SolidGrid, Solids
from quad_nav.sim.obstacles import Box, Obstacle
from quad_nav.sim.rays import CYLINDER, KINDS, SPHERE
from quad_nav.sim.scene import Scene

_MANY = 500
"""Number of solids up to which projecting each is as fast as walking beams through a grid."""
_LARGE_CELLS = 32
"""Number of the grid's cells above which a solid is projected instead."""
_MIN_CELL_M = 0.25
_PADDING_M = 1e-6
"""More than rounding errors, so that a solid is in every cell that its faces touch."""
_MANY_BOXES = 256
_STRIPE_M = 4.0
_BOXES_PER_BODY = 16
"""pybullet's limit for the number of shapes in a body."""


def split_scene(scene: Scene) -> Tuple[Solids, SolidGrid]:
    """Split a scene into solids that are projected one by one and those in a grid.

    Up to ``_MANY`` solids all are projected, otherwise only the large ones.
    """
    solids = solids_of([*scene.wall_boxes(), *scene.obstacles])
    count = len(solids.kinds)
    if count <= _MANY:
        return solids, grid_of(select(solids, np.zeros(0, int)), _MIN_CELL_M)
    low, high = extents(solids)
    area_m2 = float(np.prod((high.max(axis=0) - low.min(axis=0))[:2]))
    cell_m = max(_MIN_CELL_M, math.sqrt(area_m2 / count))
    covered = np.prod((high - low)[:, :2] / cell_m + 1.0, axis=1)
    return (
        select(solids, np.flatnonzero(covered > _LARGE_CELLS)),
        grid_of(select(solids, np.flatnonzero(covered <= _LARGE_CELLS)), cell_m),
    )


def grouped(solids: Sequence[Obstacle]) -> Tuple[Sequence[Obstacle], List[List[Box]]]:
    """Split solids into those with a body each and groups of near boxes with a body per group.

    Only scenes with many boxes have groups.
    """
    boxes = [solid for solid in solids if isinstance(solid, Box)]
    if len(boxes) < _MANY_BOXES:
        return solids, []
    boxes.sort(key=lambda b: (b.x_m // _STRIPE_M, b.y_m))
    return (
        [solid for solid in solids if not isinstance(solid, Box)],
        [boxes[k : k + _BOXES_PER_BODY] for k in range(0, len(boxes), _BOXES_PER_BODY)],
    )


def solids_of(obstacles: Sequence[Obstacle]) -> Solids:
    """Return the solids with a row for each obstacle."""
    yaws = np.array([solid.yaw_rad for solid in obstacles], float)
    return Solids(
        np.array([KINDS[solid.shape] for solid in obstacles], np.int64),
        np.array([solid.centre_m for solid in obstacles], float).reshape(-1, 3),
        np.ascontiguousarray(np.swapaxes(yaw_rotations(yaws), 1, 2)),
        np.array([solid.half_m for solid in obstacles], float).reshape(-1, 3),
    )


def select(solids: Solids, rows: NDArray[np.int64]) -> Solids:
    """Return the solids in some rows, int64[k]."""
    return Solids(*(column[rows] for column in solids))


def join(first: Solids, second: Solids) -> Solids:
    """Return the solids of both."""
    return Solids(*(np.concatenate(columns) for columns in zip(first, second)))


def place(solids: Solids, poses: NDArray[np.float64]) -> None:
    """Move solids in place to poses (x_m, y_m, yaw_rad) in ``map``, float64[s, 3]."""
    solids.centres[:, :2] = poses[:, :2]
    turning = (solids.kinds != CYLINDER) & (solids.kinds != SPHERE)
    solids.rotations[turning] = np.swapaxes(yaw_rotations(poses[turning, 2]), 1, 2)


def extents(solids: Solids) -> Tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return lower and upper corners float64[s, 3] of the solids' bounding boxes in ``map``."""
    reach = np.sum(np.abs(solids.rotations) * solids.sizes[:, :, None], axis=1) + _PADDING_M
    return solids.centres - reach, solids.centres + reach


def grid_of(solids: Solids, cell_m: float) -> SolidGrid:
    """Sort static solids into the square cells of a horizontal grid that they reach into."""
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
