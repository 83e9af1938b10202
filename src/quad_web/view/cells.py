"""Voronoi cells of the robots, as polygons.

A robot's buffered cell is bounded by the arena and, for each peer, by the bisector between the
two, shifted towards the robot by the safety radius: see ``peers.voronoi_cell``, which keeps
commands inside of it.
"""

from __future__ import annotations

import math
from typing import Any, List, Mapping, Sequence, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.sim.scene import Scene
from quad_web.view.items import line_item
from quad_web.view.state import Item

Point = Tuple[float, float]


def cell_items(scene: Scene, positions: Any, radii_m: Mapping[int, float]) -> List[Item]:
    """Return the cells of some robots; without a point for a robot whose cell is empty.

    Args:
        scene: Has the arena.
        positions: float64[n, 2], of all robots, in ``map``; NaN for an unknown one.
        radii_m: Radius plus the margin, by the numbers of the robots whose cells are wanted.
    """
    corners = (
        (scene.origin_x_m, scene.origin_y_m),
        (scene.end_x_m, scene.origin_y_m),
        (scene.end_x_m, scene.end_y_m),
        (scene.origin_x_m, scene.end_y_m),
    )
    positions = np.asarray(positions, np.float64)
    return [
        line_item("cell", robot, buffered_cell(positions, robot, corners, radius_m))
        for robot, radius_m in radii_m.items()
        if np.isfinite(positions[robot]).all()
    ]


def buffered_cell(
    positions: NDArray[np.float64],
    robot: int,
    corners: Sequence[Point],
    safety_radius_m: float,
) -> List[Point]:
    """Return the corners of a robot's buffered Voronoi cell, counter-clockwise.

    Args:
        positions: float64[n, 2], of all robots; NaN for an unknown one.
        robot: Number of the robot.
        corners: Corners of the arena, counter-clockwise.
        safety_radius_m: Distance by which each bisector is shifted towards the robot. A bisector
            is shifted at most as far as the robot.
    """
    x_m, y_m = positions[robot].tolist()
    offsets = positions - positions[robot]
    distances_m = np.hypot(offsets[:, 0], offsets[:, 1])
    polygon = list(corners)
    reach_m = _reach_m(polygon, x_m, y_m)
    for peer in np.argsort(distances_m).tolist():
        distance_m = float(distances_m[peer])
        if peer == robot or distance_m == 0.0 or not math.isfinite(distance_m):
            continue
        room_m = max(distance_m / 2.0 - safety_radius_m, 0.0)
        if room_m >= reach_m:
            break  # the further ones do not cut it either
        ux, uy = (offsets[peer] / distance_m).tolist()
        polygon = _cut(polygon, ux, uy, room_m + ux * x_m + uy * y_m)
        reach_m = _reach_m(polygon, x_m, y_m)
    return polygon


def _reach_m(polygon: Sequence[Point], x_m: float, y_m: float) -> float:
    return max((math.hypot(px - x_m, py - y_m) for px, py in polygon), default=0.0)


def _cut(polygon: Sequence[Point], ux: float, uy: float, limit_m: float) -> List[Point]:
    """Return the part of a convex polygon where ``x ux + y uy <= limit_m``."""
    kept: List[Point] = []
    beyond = [ux * x + uy * y - limit_m for x, y in polygon]
    for k, (x, y) in enumerate(polygon):
        here, before = beyond[k], beyond[k - 1]
        if (here > 0.0) != (before > 0.0):
            part = before / (before - here)
            px, py = polygon[k - 1]
            kept.append((px + part * (x - px), py + part * (y - py)))
        if here <= 0.0:
            kept.append((x, y))
    return kept
