"""Passive safety: whether the robot rests before an obstacle reaches it that leaves its prediction.

Source: K. Macek, D. Vasquez, T. Fraichard, R. Siegwart, "Towards Safe Vehicle Navigation in Dynamic
Urban Scenarios", Automatika 50, 2009: if a collision cannot be avoided, the robot is at rest then.
"""

from __future__ import annotations

import math
from typing import Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.kernels.body_response import Body, move_bodies
from quad_nav.kernels.jit import njit
from quad_nav.kernels.standing_obstacles import StandingObstacles, gap_at

AT_REST_MPS = 0.05
"""Speed below which a robot rests."""
_DEEPER_M = 0.01  # by which standing obstacles may be overlapped more than now


@njit(cache=True, nogil=True)
def rest_in_time(
    body: Body,
    discs: NDArray[np.float64],
    period_s: float,
    deviation_mps: float,
    standing: StandingObstacles,
    start: Tuple[float, float, float, float],
    commands: NDArray[np.float64],
    hold: int,
    early: int,
) -> NDArray[np.bool_]:
    """Return after which commands the robot can brake and rest before any obstacle reaches it.

    Until it rests no obstacle is where the robot is, nor gets there soon after. It comes into no
    standing obstacle either, or no deeper than it is.

    Args:
        body: Response of the body.
        discs: float64[t, n, 4], where obstacles are predicted, x, y and radius with the robot's;
            the first ones are those of now.
        period_s: Time between two predictions.
        deviation_mps: How fast obstacles may leave their predictions.
        standing: Obstacles that do not move.
        start: Velocity of the robot, m/s, and its acceleration, m/s^2, along x and y.
        commands: float64[c, 2], vx and vy in m/s.
        hold: The number of predictions until the robot brakes.
        early: The number of predictions by which it rests before an obstacle gets there.

    Returns:
        bool[c].
    """
    moving, flown = np.zeros((6, len(commands))), commands.copy()
    for i in range(len(start)):
        moving[2 + i] = start[i]
    rests = np.ones(len(commands), np.bool_)
    deepest = min(gap_at(standing, 0.0, 0.0), 0.0) - _DEEPER_M
    for k in range(1, len(discs)):
        move_bodies(body, moving, flown, period_s)
        speeds = np.sqrt(moving[2] ** 2 + moving[3] ** 2)
        for c in np.flatnonzero(rests & (speeds >= AT_REST_MPS)):
            x, y = moving[0, c], moving[1, c]
            rests[c] = gap_at(standing, x, y) >= deepest
            for ahead in (k, min(k + early, len(discs) - 1)):
                deviation_m = deviation_mps * period_s * ahead
                rests[c] = rests[c] and not _reaches(discs[ahead], deviation_m, x, y)
        if k >= hold:
            flown[:] = -moving[2:4].T
            if not np.any(rests & (speeds >= AT_REST_MPS)):
                break
    return rests


@njit(cache=True, nogil=True)
def _reaches(discs: NDArray[np.float64], deviation: float, x: float, y: float) -> bool:
    """Return whether any of the obstacles, float64[n, 4], gets to a point by a deviation."""
    for n in range(len(discs)):
        if math.hypot(x - discs[n, 0], y - discs[n, 1]) < discs[n, 2] + deviation:
            return True
    return False
