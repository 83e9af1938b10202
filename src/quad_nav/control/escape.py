"""Escape of a robot whose footprint touches an obstacle, so that no trajectory is legal.

Every trajectory begins where the robot is. When that pose collides, all of them collide, also those
that lead away. A round robot sweeps no new cells when it turns: it turns its front or its back,
whichever is nearer, towards the lowest costs near by, and goes there slowly.
"""

from __future__ import annotations

import math
from typing import Optional

import numpy as np
from numpy.typing import NDArray

from quad_nav.footprint import radii
from quad_nav.geometry import Pose2D, Twist2D, angle_difference
from quad_nav.grid import INSCRIBED, UNKNOWN, GridSpec

SPEED_MPS, TURN_RADPS = 0.1, 0.4
_STEPS_M = np.array([0.05, 0.1, 0.15])
_BEARINGS_RAD = np.arange(32) * (2.0 * math.pi / 32)
_AHEAD_RAD = 0.3
_ROUND = 0.9  # inscribed by circumscribed radius


def escape(
    spec: GridSpec, costs: NDArray[np.uint8], footprint: NDArray[np.float64], pose: Pose2D
) -> Optional[Twist2D]:
    """Return a command that leads to lower costs, uint8[H, W] on the local costmap's grid.

    Returns:
        The command; None if no direction leads to lower costs, or the footprint, float64[n, 2], is
        not round: the cells that it would sweep are not examined.
    """
    here = spec.cell_of(pose.x_m, pose.y_m)
    if here is None or not is_round(footprint):
        return None
    ahead = _costs_around(spec, costs, pose)
    cost_here = int(costs[here[1], here[0]])
    legal = (ahead.max(axis=1) <= max(cost_here, INSCRIBED)) & (
        ahead[:, -1] < min(cost_here, INSCRIBED)
    )
    if not legal.any():
        return None
    turns = np.array([angle_difference(bearing, pose.yaw_rad) for bearing in _BEARINGS_RAD])
    sides = np.minimum(np.abs(turns), math.pi - np.abs(turns))
    best = min(np.flatnonzero(legal), key=lambda k: (ahead[k, -1], sides[k]))
    turn_rad, backwards = float(turns[best]), abs(turns[best]) > math.pi / 2
    if backwards:
        turn_rad -= math.copysign(math.pi, turn_rad)
    if abs(turn_rad) > _AHEAD_RAD:
        return Twist2D(0.0, 0.0, math.copysign(TURN_RADPS, turn_rad))
    return Twist2D(-SPEED_MPS if backwards else SPEED_MPS)


def is_round(footprint: NDArray[np.float64]) -> bool:
    """Tell whether a footprint, float64[n, 2], is nearly a circle around the robot's centre."""
    inscribed_m, circumscribed_m = radii(footprint)
    return inscribed_m >= _ROUND * circumscribed_m


def _costs_around(spec: GridSpec, costs: NDArray[np.uint8], pose: Pose2D) -> NDArray[np.int_]:
    """Return costs some steps along each bearing, int[bearings, steps]; UNKNOWN off the map."""
    x = pose.x_m + np.outer(np.cos(_BEARINGS_RAD), _STEPS_M)
    y = pose.y_m + np.outer(np.sin(_BEARINGS_RAD), _STEPS_M)
    columns = np.floor((x - spec.origin_x_m) / spec.resolution_m).astype(int)
    rows = np.floor((y - spec.origin_y_m) / spec.resolution_m).astype(int)
    inside = (columns >= 0) & (columns < spec.size_x) & (rows >= 0) & (rows < spec.size_y)
    found = costs[np.where(inside, rows, 0), np.where(inside, columns, 0)].astype(int)
    return np.where(inside, found, UNKNOWN)
