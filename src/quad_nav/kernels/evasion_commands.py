"""Costs of velocity commands: the body's response to two of them, then the best motion.

``control/evasion.py`` has the reasoning, ``space_time.py`` the best motion, frames and times.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.kernels.jit import njit
from quad_nav.kernels.space_time import (
    FAR,
    SUBSTEPS,
    SpaceTime,
    filled_cells,
    haste_per_s,
    threat,
)
from quad_nav.kernels.standing_obstacles import StandingObstacles, overlap_cost

BOTH_S = 1.0
"""Duration of the first and the second command together."""
_FIRST_S = 0.4
_PARTS = 2  # steps of the body's motion between two predictions


class Body(NamedTuple):
    """Response of the body to a velocity command, see ``control/evasion.py``."""

    gain_per_s: float  # of the velocity loop
    lag_s: float  # of the acceleration
    acceleration_mps2: float  # greatest


@njit(cache=True, nogil=True)
def command_costs(
    search: SpaceTime,
    body: Body,
    discs: NDArray[np.float64],
    standing: StandingObstacles,
    costs: NDArray[np.float64],
    start: Tuple[float, float, float, float],
    commands: NDArray[np.float64],
    seconds: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return the cost of each command, of the best second one, and of the best motion afterwards.

    A second command after which the body cannot stop before a standing obstacle costs extra,
    because the best motion afterwards ignores inertia.

    Args:
        search: Resolution and costs.
        body: Response of the body.
        discs: As for ``fill_costs``.
        standing: Obstacles that do not move.
        costs: float64[steps + 1, M, M], of ``fill_costs``.
        start: Present velocity of the robot, m/s, and acceleration, m/s^2, along x and y.
        commands: float64[c, 2], vx and vy in m/s.
        seconds: float64[d, 2], commands that may follow each of them, besides itself.

    Returns:
        float64[c].
    """
    found = np.empty(commands.shape[0])
    first, moving = np.empty(6), np.empty(6)
    period_s = search.step_s / SUBSTEPS
    one, both = round(_FIRST_S / period_s), SUBSTEPS * round(BOTH_S / search.step_s)
    discs = _near(search, discs, both)
    for n in range(commands.shape[0]):
        first[:2], first[2:] = 0.0, start
        cost = _follow(search, body, discs, standing, first, commands[n], 0, one)
        least = math.inf
        for m in range(seconds.shape[0] + 1):
            moving[:] = first
            second = commands[n] if m == seconds.shape[0] else seconds[m]
            after = _follow(search, body, discs, standing, moving, second, one, both)
            if after < least:
                least = min(least, after + _end_cost(search, body, standing, costs, moving))
        found[n] = cost + least
    return found


@njit(cache=True, nogil=True)
def _near(search: SpaceTime, discs: NDArray[np.float64], last: int) -> NDArray[np.float64]:
    """Return the discs that the robot may come near up to a prediction, float64[t, m, 4]."""
    chosen = np.zeros(discs.shape[1], np.bool_)
    for n in range(discs.shape[1]):
        for k in range(last + 1):
            reach = search.max_speed_mps * k * search.step_s / SUBSTEPS
            far = discs[k, n, 2] + FAR * discs[k, n, 3] + reach
            if math.hypot(discs[k, n, 0], discs[k, n, 1]) < far:
                chosen[n] = True
    return discs[: last + 1, chosen]


@njit(cache=True, nogil=True)
def _follow(
    search: SpaceTime,
    body: Body,
    discs: NDArray[np.float64],
    standing: StandingObstacles,
    moving: NDArray[np.float64],
    command: NDArray[np.float64],
    begin: int,
    end: int,
) -> float:
    """Move the body, float64[6], under a command from one prediction to another.

    Returns:
        The cost on the way.
    """
    dt = search.step_s / SUBSTEPS
    rest = math.exp(-dt / _PARTS / body.lag_s)
    cost = 0.0
    for k in range(begin + 1, end + 1):
        for _ in range(_PARTS):
            _move(body, moving, command, dt / _PARTS, rest)
        rate = search.risk_per_s * threat(discs, k, moving[0], moving[1])
        rate += search.blocked_per_s * overlap_cost(standing, moving[0], moving[1])
        rate += haste_per_s(search, math.hypot(moving[2], moving[3]))
        cost += rate * dt
    return cost


@njit(cache=True, nogil=True)
def _move(
    body: Body, moving: NDArray[np.float64], command: NDArray[np.float64], dt: float, rest: float
) -> None:
    """Move the body by a step: position, velocity and acceleration, float64[6]."""
    ax = body.gain_per_s * (command[0] - moving[2])
    ay = body.gain_per_s * (command[1] - moving[3])
    shorten = body.acceleration_mps2 / max(math.hypot(ax, ay), body.acceleration_mps2)
    for i, wanted in ((0, ax * shorten), (1, ay * shorten)):
        moving[4 + i] = wanted + (moving[4 + i] - wanted) * rest
        moving[i] += dt * (moving[2 + i] + 0.5 * dt * moving[4 + i])
        moving[2 + i] += dt * moving[4 + i]


@njit(cache=True, nogil=True)
def rest_s(body: Body, speed_mps: float) -> float:
    """Return for how long a body would fly on at its speed to get as far as it does until it rests.

    Below the speed from which its velocity loop brakes with less than its greatest acceleration,
    the way to rest is that of an exponential decay.
    """
    over = max(speed_mps - body.acceleration_mps2 / body.gain_per_s, 0.0)
    braking_s = 0.5 * over * over / body.acceleration_mps2 / max(speed_mps, 1e-9)
    return 1.0 / body.gain_per_s + braking_s


@njit(cache=True, nogil=True)
def _end_cost(
    search: SpaceTime,
    body: Body,
    standing: StandingObstacles,
    costs: NDArray[np.float64],
    moving: NDArray[np.float64],
) -> float:
    """Return the cost from the end of the second command on: the way to rest, the best motion."""
    speed = math.hypot(moving[2], moving[3])
    later_s = rest_s(body, speed)
    cost = later_s * haste_per_s(search, speed)
    for k in range(1, SUBSTEPS + 1):
        at = later_s * k / SUBSTEPS
        overlap = overlap_cost(standing, moving[0] + at * moving[2], moving[1] + at * moving[3])
        cost += search.blocked_per_s * overlap * search.step_s / SUBSTEPS
    x, y = moving[0] + later_s * moving[2], moving[1] + later_s * moving[3]
    step = round(BOTH_S / search.step_s) + later_s / search.step_s
    before = min(int(step), costs.shape[0] - 2)
    part = min(step - before, 1.0)
    cost += (1.0 - part) * _cost_at(search, costs, before, x, y)
    return cost + part * _cost_at(search, costs, before + 1, x, y)


@njit(cache=True, nogil=True)
def _cost_at(search: SpaceTime, costs: NDArray[np.float64], step: int, x: float, y: float) -> float:
    """Interpolate the costs of a step, float64[steps + 1, M, M], where it has some."""
    middle = costs.shape[1] // 2
    last = filled_cells(search, step, middle) - 1e-6
    across = min(max(x / search.cell_m, -last), last)
    along = min(max(y / search.cell_m, -last), last)
    column, row = math.floor(across), math.floor(along)
    right, up = across - column, along - row
    i, j = int(row) + middle, int(column) + middle
    at = costs[step, i : i + 2, j : j + 2]
    return (1.0 - up) * ((1.0 - right) * at[0, 0] + right * at[0, 1]) + up * (
        (1.0 - right) * at[1, 0] + right * at[1, 1]
    )
