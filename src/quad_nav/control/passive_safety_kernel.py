"""Passive safety: whether the robot rests before an obstacle can reach it.

``control/passive_safety.py`` has the reasoning. Positions are metres relative to the robot.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.control.body_response import Body, move_bodies
from quad_nav.control.standing_obstacles import StandingObstacles, gap_at
from quad_nav.files.kernel_cache import njit

AT_REST_MPS = 0.03
"""Speed below which a robot rests."""
_DEEPER_M = 0.01  # by which standing obstacles may be overlapped more than now


class Reachable(NamedTuple):
    """Where n obstacles can be at t times; radii include that of the robot.

    An obstacle can be where both of its discs are: it accelerates no more, and is no faster.

    Attributes:
        predicted: float64[t, n, 3], x, y and radius around where each is predicted.
        places: float64[n, 2], where each is now.
        walked: float64[t, n], radius around where each is now.
    """

    predicted: NDArray[np.float64]
    places: NDArray[np.float64]
    walked: NDArray[np.float64]


@njit(cache=True, nogil=True)
def rest_in_time(
    body: Body,
    reachable: Reachable,
    period_s: float,
    standing: StandingObstacles,
    start: Tuple[float, float, float, float],
    commands: NDArray[np.float64],
    hold: int,
) -> NDArray[np.bool_]:
    """Return after which commands the robot can brake and rest before any obstacle can reach it.

    A robot that does not rest by the last time is not safe. It comes into no standing obstacle
    either, or no deeper than it is.

    Args:
        body: Response of the body.
        reachable: Where obstacles can be, a period apart, the first time is now.
        period_s: The period.
        standing: Obstacles that do not move.
        start: Velocity of the robot, m/s, and its acceleration, m/s^2, along x and y.
        commands: float64[c, 2], vx and vy in m/s.
        hold: The number of periods until the robot brakes. It rests in these only if the command
            is to rest.

    Returns:
        bool[c].
    """
    moving, flown = np.zeros((6, len(commands))), commands.copy()
    for i in range(len(start)):
        moving[2 + i] = start[i]
    wanted = np.sqrt(commands[:, 0] ** 2 + commands[:, 1] ** 2)
    safe = np.ones(len(commands), np.bool_)
    deepest = min(gap_at(standing, 0.0, 0.0), 0.0) - _DEEPER_M
    for k in range(1, len(reachable.predicted)):
        move_bodies(body, moving, flown, period_s)
        speeds = np.sqrt(moving[2] ** 2 + moving[3] ** 2)
        if k <= hold:
            speeds = np.maximum(speeds, wanted)
        moves = safe & (speeds >= AT_REST_MPS)
        for c in np.flatnonzero(moves):
            x, y = moving[0, c], moving[1, c]
            safe[c] = gap_at(standing, x, y) >= deepest and not _is_reached(reachable, k, x, y)
        if k >= hold:
            flown[:] = -moving[2:4].T
            if not np.any(moves):
                return safe
    return safe & ~moves


@njit(cache=True, nogil=True)
def _is_reached(reachable: Reachable, k: int, x: float, y: float) -> bool:
    """Return whether any of the obstacles can be at a point at a time."""
    for n in range(len(reachable.places)):
        from_x, from_y = x - reachable.places[n, 0], y - reachable.places[n, 1]
        off_x, off_y = x - reachable.predicted[k, n, 0], y - reachable.predicted[k, n, 1]
        if (
            math.hypot(off_x, off_y) < reachable.predicted[k, n, 2]
            and math.hypot(from_x, from_y) < reachable.walked[k, n]
        ):
            return True
    return False
