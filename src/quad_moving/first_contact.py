"""The first contact of a robot that flies a velocity, for each of many velocities.

``evasion`` has the reasoning. Velocities are float64[2] along the axes of the local costmap's frame
in m/s, places are relative to the robot in metres, times are multiples of a step.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.files.kernel_cache import njit


class Body(NamedTuple):
    """Response of the robot's body to a command."""

    gain_per_s: float  # acceleration for each m/s by which the velocity is off the command
    acceleration_mps2: float  # the greatest one
    still_mps: float  # a slower robot is at rest, where it may be touched; 0: it may not


class Standing(NamedTuple):
    """The local costmap."""

    costs: NDArray[np.uint8]  # [H, W]
    left_m: float  # of its origin, relative to the robot
    low_m: float
    resolution_m: float
    limit: int  # cells of this cost or a higher one are in the way


@njit(cache=True, nogil=True)
def first_contacts(
    body: Body,
    standing: Standing,
    discs: NDArray[np.float64],
    walks: NDArray[np.float64],
    velocity: NDArray[np.float64],
    commands: NDArray[np.float64],
    hold: int,
    step_s: float,
    contacts: NDArray[np.float64],
) -> None:
    """Find when each command leads into an obstacle.

    The robot follows the command for some steps and brakes then. It may not come into what stands,
    whatever moves.

    Args:
        body: Response of the body.
        standing: The local costmap.
        discs: float64[t, n, 3], places of the obstacles at each step and the distance of centres at
            which they touch the robot.
        walks: float64[t, n], distances from the first place of each obstacle within which it is, at
            each step, plus the distance of centres.
        velocity: The robot's velocity.
        commands: float64[c, 2].
        hold: Number of steps until the robot brakes.
        step_s: Length of a step.
        contacts: float64[c], written: times of the first contacts, +inf for none, -1 for a command
            that leads into what stands.
    """
    steps = discs.shape[0]
    for c in range(commands.shape[0]):
        x = y = 0.0
        vx, vy = velocity[0], velocity[1]
        contacts[c] = np.inf
        for k in range(1, steps):
            if k <= hold:
                ax = body.gain_per_s * (commands[c, 0] - vx)
                ay = body.gain_per_s * (commands[c, 1] - vy)
                factor = body.acceleration_mps2 / max(math.hypot(ax, ay), body.acceleration_mps2)
            else:
                ax, ay = -vx / step_s, -vy / step_s
                factor = body.acceleration_mps2 / max(math.hypot(ax, ay), body.acceleration_mps2)
            x += step_s * (vx + 0.5 * step_s * factor * ax)
            y += step_s * (vy + 0.5 * step_s * factor * ay)
            vx += step_s * factor * ax
            vy += step_s * factor * ay
            if _is_blocked(standing, x, y):
                contacts[c] = -1.0
                break
            if math.hypot(vx, vy) < body.still_mps:
                if k > hold:
                    break
                continue
            if contacts[c] == np.inf and _touches(discs, walks, k, x, y):
                contacts[c] = k * step_s


@njit(cache=True, nogil=True)
def _is_blocked(standing: Standing, x: float, y: float) -> bool:
    """Return whether something stands at a place; outside of the costmap nothing does."""
    column = int(math.floor((x - standing.left_m) / standing.resolution_m))
    row = int(math.floor((y - standing.low_m) / standing.resolution_m))
    if row < 0 or column < 0 or row >= standing.costs.shape[0] or column >= standing.costs.shape[1]:
        return False
    return bool(standing.costs[row, column] >= standing.limit)


@njit(cache=True, nogil=True)
def _touches(
    discs: NDArray[np.float64], walks: NDArray[np.float64], k: int, x: float, y: float
) -> bool:
    """Return whether an obstacle may be at a place at step k.

    It is both near its predicted place and no farther from its first one than it can walk. A robot
    that touches an obstacle already may fly away from it.
    """
    for n in range(discs.shape[1]):
        inside = max(discs[0, n, 2] - math.hypot(discs[0, n, 0], discs[0, n, 1]), 0.0)
        away = math.hypot(x - discs[k, n, 0], y - discs[k, n, 1])
        walked = math.hypot(x - discs[0, n, 0], y - discs[0, n, 1])
        if away < discs[k, n, 2] - inside and walked < walks[k, n] - inside:
            return True
    return False
