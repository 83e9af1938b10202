"""Costs of velocity commands: the body's response to two of them, then the best motion.

``control/evasion.py`` has the reasoning, ``space_time.py`` the best motion, frames and times.
"""

from __future__ import annotations

import math
from typing import Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.control.body_response import Body, move_bodies, rest_s
from quad_nav.control.space_time import (
    FAR,
    SUBSTEPS,
    SpaceTime,
    filled_cells,
    haste_per_s,
    threat,
)
from quad_nav.control.standing_obstacles import StandingObstacles, overlap_cost
from quad_nav.files.kernel_cache import njit

BOTH_S = 1.0
"""Duration of the first and the second command together."""
_FIRST_S = 0.4


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
    period_s = search.step_s / SUBSTEPS
    one, both = round(_FIRST_S / period_s), SUBSTEPS * round(BOTH_S / search.step_s)
    discs = _near(search, discs, both)
    moving, found = np.zeros((6, len(commands))), np.empty(len(commands))
    for i in range(len(start)):
        moving[2 + i] = start[i]
    ways = _follow(search, body, moving, commands, one)
    later, then = np.empty((6, len(seconds) + 1)), np.empty((len(seconds) + 1, 2))
    then[:-1] = seconds
    for n in range(len(commands)):
        later.T[:], then[-1] = moving[:, n], commands[n]
        later_ways = _follow(search, body, later, then, both - one)
        ends = _end_costs(search, body, costs, later)
        found[n] = _way_cost(search, discs, standing, ways[:, :, n], math.inf)
        found[n] += _least_cost(search, body, discs[one:], standing, later_ways, later, ends)
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
    moving: NDArray[np.float64],
    commands: NDArray[np.float64],
    predictions: int,
) -> NDArray[np.float64]:
    """Move bodies, each under a command, from one prediction to a later one.

    Args:
        search: Resolution.
        body: Response of the bodies.
        moving: float64[6, c], positions, velocities and accelerations.
        commands: float64[c, 2].
        predictions: The number of predictions.

    Returns:
        float64[predictions, 3, c], x, y and speed at the time of each.
    """
    ways = np.empty((predictions, 3, len(commands)))
    dt = search.step_s / SUBSTEPS
    for k in range(predictions):
        move_bodies(body, moving, commands, dt)
        ways[k, :2] = moving[:2]
        ways[k, 2] = np.sqrt(moving[2] ** 2 + moving[3] ** 2)
    return ways


@njit(cache=True, nogil=True)
def _least_cost(
    search: SpaceTime,
    body: Body,
    discs: NDArray[np.float64],
    standing: StandingObstacles,
    ways: NDArray[np.float64],
    moving: NDArray[np.float64],
    ends: NDArray[np.float64],
) -> float:
    """Return the least cost of ways, float64[n, 3, c], with those from their ends on.

    The bodies, float64[6, c], are those at the ends, ``ends`` as from ``_end_costs``. The ends that
    cost least in the open come first, so that most ways are not followed.
    """
    least, in_the_open = math.inf, ends[0] + ends[1] + ends[2]
    for m in np.argsort(in_the_open):
        if in_the_open[m] >= least:
            break
        end = _rest_cost(search, body, standing, moving[:, m], ends[0, m]) + ends[1, m] + ends[2, m]
        if end < least:
            cost = _way_cost(search, discs, standing, ways[:, :, m], least - end)
            least = min(least, cost + end)
    return least


@njit(cache=True, nogil=True)
def _way_cost(
    search: SpaceTime,
    discs: NDArray[np.float64],
    standing: StandingObstacles,
    way: NDArray[np.float64],
    enough: float,
) -> float:
    """Return the cost of a way, float64[n, 3] of x, y and speed; a part of it if that is enough.

    The discs are float64[t, m, 4] from where the way begins on.
    """
    dt = search.step_s / SUBSTEPS
    cost = 0.0
    for k in range(len(way)):
        if cost >= enough:
            break
        x, y, speed = way[k, 0], way[k, 1], way[k, 2]
        rate = search.risk_per_s * threat(discs, k + 1, x, y)
        rate += search.blocked_per_s * overlap_cost(standing, x, y)
        rate += haste_per_s(search, speed)
        cost += rate * dt
    return cost


@njit(cache=True, nogil=True)
def _end_costs(
    search: SpaceTime, body: Body, costs: NDArray[np.float64], moving: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the costs from the end of second commands on, without what stands.

    Args:
        search: Resolution and costs.
        body: Response of the bodies.
        costs: As for ``command_costs``.
        moving: float64[6, c], the bodies at the end of the commands.

    Returns:
        float64[3, c]: haste on the way to rest, and the best motion from there on, in two parts:
        from the step before the body rests, and from the step after.
    """
    found = np.empty((3, moving.shape[1]))
    for n in range(moving.shape[1]):
        speed = math.hypot(moving[2, n], moving[3, n])
        later_s = rest_s(body, speed)
        x, y = moving[0, n] + later_s * moving[2, n], moving[1, n] + later_s * moving[3, n]
        step = round(BOTH_S / search.step_s) + later_s / search.step_s
        before = min(int(step), costs.shape[0] - 2)
        part = min(step - before, 1.0)
        found[0, n] = later_s * haste_per_s(search, speed)
        found[1, n] = (1.0 - part) * _cost_at(search, costs, before, x, y)
        found[2, n] = part * _cost_at(search, costs, before + 1, x, y)
    return found


@njit(cache=True, nogil=True)
def _rest_cost(
    search: SpaceTime,
    body: Body,
    standing: StandingObstacles,
    moving: NDArray[np.float64],
    haste: float,
) -> float:
    """Return haste and the cost of what stands on the way to rest of a body, float64[6]."""
    later_s, cost = rest_s(body, math.hypot(moving[2], moving[3])), haste
    for k in range(1, SUBSTEPS + 1):
        at = later_s * k / SUBSTEPS
        overlap = overlap_cost(standing, moving[0] + at * moving[2], moving[1] + at * moving[3])
        cost += search.blocked_per_s * overlap * search.step_s / SUBSTEPS
    return cost


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
    low = (1.0 - right) * costs[step, i, j] + right * costs[step, i, j + 1]
    high = (1.0 - right) * costs[step, i + 1, j] + right * costs[step, i + 1, j + 1]
    return (1.0 - up) * low + up * high
