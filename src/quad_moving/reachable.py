"""How deep a robot is in what obstacles can reach, for each of many commands.

``evasion`` has the reasoning. Velocities are float64[2] along the axes of the local costmap's frame
in m/s, places are relative to the robot in metres, times are multiples of a step.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.files.kernel_cache import njit

BLOCKED = np.inf
"""Result for a command after which the robot cannot stop before what stands."""


class Body(NamedTuple):
    """Response of the robot's body to a command."""

    gain_per_s: float  # acceleration for each m/s by which the velocity is off the command
    acceleration_mps2: float  # the greatest one
    still_mps: float  # a slower robot is at rest


class Standing(NamedTuple):
    """The local costmap."""

    costs: NDArray[np.uint8]  # [H, W]
    left_m: float  # of its origin, relative to the robot
    low_m: float
    resolution_m: float
    limit: float  # cells of this cost or a higher one are in the way of a centre that rests
    decay_s_per_m: float = 0.0  # the limit of one that flies is lower: it falls with the speed


class Obstacles(NamedTuple):
    """Moving obstacles that keep their velocities unless they accelerate."""

    states: NDArray[np.float64]  # [n, 4], x, y, vx and vy
    radii_m: NDArray[np.float64]  # [n], distances of centres at which they touch the robot
    speeds_mps: NDArray[np.float64]  # [n], the greatest ones
    acceleration_mps2: float  # the greatest one


class Flight(NamedTuple):
    """How each command is flown in thought."""

    step_s: float
    steps: int  # for which the robot keeps clear
    hold: int  # steps until the robot would stop for what stands
    rests: bool  # it stops for what moves as well, and keeps clear until it is at rest


@njit(cache=True, nogil=True)
def overlaps(
    body: Body,
    standing: Standing,
    obstacles: Obstacles,
    flight: Flight,
    velocity: NDArray[np.float64],
    commands: NDArray[np.float64],
    found: NDArray[np.float64],
) -> None:
    """Add up how deep the robot is in what obstacles can reach, for each command.

    After a time t an obstacle is within a t^2 / 2 of where its velocity leads it, with the greatest
    acceleration a, and within the way of its greatest speed. The greatest depth until then is added
    up over the time, so that late is better and nothing is gained by flying through an obstacle. It
    is 0 if no obstacle can touch the robot.

    Args:
        body: Response of the body.
        standing: The local costmap.
        obstacles: The moving obstacles.
        flight: How the commands are flown.
        velocity: The robot's velocity.
        commands: float64[c, 2].
        found: float64[c], written: m s, or ``BLOCKED`` if the robot cannot stop before what stands.
    """
    inside = _is_blocked(standing, 0.0, 0.0, 0.0, 0.0)
    for c in range(commands.shape[0]):
        found[c] = 0.0
        if not _stops_in_time(body, standing, flight, velocity, commands[c]):
            found[c] = BLOCKED
            continue
        deepest = 0.0
        state = (0.0, 0.0, velocity[0], velocity[1])
        k = 0
        while k < flight.steps or flight.rests:
            k += 1
            stops = flight.rests and k > flight.hold
            x, y = state[0], state[1]
            state = _moved(body, flight.step_s, state, commands[c], stops)
            if not inside and _is_blocked(standing, state[0], state[1], 0.0, 0.0):  # stops before
                state = (x, y, 0.0, 0.0)
            if flight.rests and math.hypot(state[2], state[3]) < body.still_mps:
                if stops:
                    break
                continue
            deepest = max(deepest, _depth(obstacles, k * flight.step_s, state[0], state[1]))
            found[c] += flight.step_s * deepest


@njit(cache=True, nogil=True)
def _moved(
    body: Body,
    step_s: float,
    state: Tuple[float, float, float, float],
    command: NDArray[np.float64],
    stops: bool,
) -> Tuple[float, float, float, float]:
    """Return place and velocity of the robot a step later; to stop, its command is to hover."""
    x, y, vx, vy = state
    to_vx, to_vy = (0.0, 0.0) if stops else (command[0], command[1])
    ax, ay = body.gain_per_s * (to_vx - vx), body.gain_per_s * (to_vy - vy)
    factor = body.acceleration_mps2 / max(math.hypot(ax, ay), body.acceleration_mps2)
    dvx, dvy = step_s * factor * ax, step_s * factor * ay
    return x + step_s * (vx + 0.5 * dvx), y + step_s * (vy + 0.5 * dvy), vx + dvx, vy + dvy


@njit(cache=True, nogil=True)
def _stops_in_time(
    body: Body,
    standing: Standing,
    flight: Flight,
    velocity: NDArray[np.float64],
    command: NDArray[np.float64],
) -> bool:
    """Return whether a robot that follows a command and then stops comes into nothing.

    One that is too near to something already has to leave it while it follows the command.
    """
    inside = _is_blocked(standing, 0.0, 0.0, velocity[0], velocity[1])
    state = (0.0, 0.0, velocity[0], velocity[1])
    k = 0
    while k < flight.hold or math.hypot(state[2], state[3]) >= body.still_mps:
        k += 1
        state = _moved(body, flight.step_s, state, command, k > flight.hold)
        is_leaving = inside and k <= flight.hold
        if not is_leaving and _is_blocked(standing, state[0], state[1], state[2], state[3]):
            return False
    return not _is_blocked(standing, state[0], state[1], 0.0, 0.0)


@njit(cache=True, nogil=True)
def _is_blocked(standing: Standing, x: float, y: float, vx: float, vy: float) -> bool:
    """Return whether something stands in the way; outside of the costmap nothing does."""
    column = int(math.floor((x - standing.left_m) / standing.resolution_m))
    row = int(math.floor((y - standing.low_m) / standing.resolution_m))
    if row < 0 or column < 0 or row >= standing.costs.shape[0] or column >= standing.costs.shape[1]:
        return False
    limit = standing.limit * math.exp(-standing.decay_s_per_m * math.hypot(vx, vy))
    return bool(standing.costs[row, column] >= limit)


@njit(cache=True, nogil=True)
def _depth(obstacles: Obstacles, after_s: float, x: float, y: float) -> float:
    """Return how deep a robot at a place is in what obstacles can reach in a time, or 0.

    An obstacle that touches the robot already counts as smaller: the robot may fly away from it.
    """
    deepest = 0.0
    reach = 0.5 * obstacles.acceleration_mps2 * after_s * after_s
    for n in range(obstacles.states.shape[0]):
        ox, oy, vx, vy = obstacles.states[n]
        radius = min(obstacles.radii_m[n], math.hypot(ox, oy))
        if math.hypot(x - ox, y - oy) >= radius + obstacles.speeds_mps[n] * after_s:
            continue
        off = math.hypot(x - ox - after_s * vx, y - oy - after_s * vy) - radius
        deepest = max(deepest, reach - off)
    return deepest
