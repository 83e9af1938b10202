"""Search in space and time for the motion that moving obstacles threaten least.

``control/evasion.py`` has the reasoning. Cells are those of a square window of M by M cells around
the robot, at [row, column] = [y, x]; the robot is in the middle of cell [M // 2, M // 2]. Times
count from now. Coordinates are metres relative to the robot, along the axes of the costmap's frame.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.kernels.jit import njit

_SUBSTEPS = 5
_DEEP_M = 0.1  # depth inside a disc at which the threat is 2
_FAR = 3.0  # standard deviations at which the threat ends


class StandingObstacles(NamedTuple):
    """Obstacles that do not move, as cells of the local costmap.

    Positions are relative to the robot, as everywhere in this module.

    Attributes:
        blocked: bool[H, W], cells where the robot's circle hits something.
        x_m: x of the corner of cell (0, 0).
        y_m: y of the corner of cell (0, 0).
        resolution_m: Size of a cell.
    """

    blocked: NDArray[np.bool_]
    x_m: float
    y_m: float
    resolution_m: float


class SpaceTime(NamedTuple):
    """Resolution and costs of the search."""

    cell_m: float
    step_s: float
    max_speed_mps: float
    gain_per_s: float  # of the body's velocity loop
    risk_per_s: float  # cost of a second at the rim of an obstacle
    fade_per_s: float  # rate at which predictions lose their weight
    blocked_per_s: float  # cost of a second on a blocked cell
    away_per_s: float  # part of the cost to go that a second costs


@njit(cache=True, nogil=True)
def threat(discs: NDArray[np.float64], k: int, x: float, y: float) -> float:
    """Return the threat at a point at time k: a Gaussian's flank outside of a disc, 1 at its rim.

    It grows linearly inside: the clearance is there, and a graze is better than a hit.

    Args:
        discs: float64[t, n, 4], rows x, y, radius and standard deviation of the position.
        k: Index of the time.
        x: Position.
        y: Position.
    """
    total = 0.0
    for n in range(discs.shape[1]):
        dx, dy = x - discs[k, n, 0], y - discs[k, n, 1]
        radius, sigma = discs[k, n, 2], discs[k, n, 3]
        squared = dx * dx + dy * dy
        if squared >= (radius + _FAR * sigma) ** 2:
            continue
        beyond = math.sqrt(squared) - radius
        if beyond <= 0.0:
            total += 1.0 - beyond / _DEEP_M
        else:
            total += math.exp(-0.5 * (beyond / sigma) ** 2)
    return total


@njit(cache=True, nogil=True)
def fill_costs(
    search: SpaceTime,
    discs: NDArray[np.float64],
    blocked: NDArray[np.bool_],
    to_go: NDArray[np.float64],
    costs: NDArray[np.float64],
) -> None:
    """Fill the least cost from each cell and step to the end of the horizon.

    Args:
        search: Resolution and costs.
        discs: float64[steps * 5 + 1, n, 4], as for ``threat``, five for each step.
        blocked: bool[M, M], cells where the robot hits what stands.
        to_go: float64[M, M], cost of the way that is left after the horizon.
        costs: float64[steps + 1, M, M], filled from step 1 on, as far as the robot may be.
    """
    steps, middle = costs.shape[0] - 1, costs.shape[1] // 2
    reach = int(search.max_speed_mps * search.step_s / search.cell_m + 1e-6)
    costs[steps] = to_go
    for k in range(steps - 1, 0, -1):
        risk = search.risk_per_s * math.exp(-search.fade_per_s * k * search.step_s)
        near = min(k * reach + 2, middle - reach)
        for row in range(middle - near, middle + near + 1):
            for column in range(middle - near, middle + near + 1):
                x, y = (column - middle) * search.cell_m, (row - middle) * search.cell_m
                cost = risk * threat(discs, k * _SUBSTEPS, x, y)
                cost += search.away_per_s * to_go[row, column]
                if blocked[row, column]:
                    cost += search.blocked_per_s
                costs[k, row, column] = cost * search.step_s + _least(
                    costs[k + 1], row, column, reach
                )


@njit(cache=True, nogil=True)
def _least(costs: NDArray[np.float64], row: int, column: int, reach: int) -> float:
    """Return the least cost within ``reach`` cells, float64[M, M]."""
    least = math.inf
    for i in range(-reach, reach + 1):
        for j in range(-reach, reach + 1):
            if i * i + j * j <= reach * reach:
                least = min(least, costs[row + i, column + j])
    return least


@njit(cache=True, nogil=True)
def command_costs(
    search: SpaceTime,
    discs: NDArray[np.float64],
    standing: StandingObstacles,
    costs: NDArray[np.float64],
    velocity: Tuple[float, float],
    commands: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return the cost of each command, held for a step, and of the best motion afterwards.

    The robot approaches the command as a first-order lag. A command after which it cannot stop
    before a standing obstacle costs extra, because the best motion afterwards ignores inertia.

    Args:
        search: Resolution and costs.
        discs: As for ``fill_costs``.
        standing: Obstacles that do not move.
        costs: float64[steps + 1, M, M], of ``fill_costs``.
        velocity: Present velocity of the robot, vx and vy in m/s.
        commands: float64[c, 2], vx and vy in m/s.

    Returns:
        float64[c].
    """
    found = np.empty(commands.shape[0])
    for n in range(commands.shape[0]):
        vx, vy = commands[n, 0], commands[n, 1]
        cost, x, y, lag = 0.0, 0.0, 0.0, 0.0
        for k in range(1, _SUBSTEPS + 1):
            time = k * search.step_s / _SUBSTEPS
            lag = _lag(search, time)
            x = velocity[0] * lag + vx * (time - lag)
            y = velocity[1] * lag + vy * (time - lag)
            rate = search.risk_per_s * threat(discs, k, x, y)
            if _is_blocked(standing, x, y):
                rate += search.blocked_per_s
            cost += rate * search.step_s / _SUBSTEPS
        left = 1.0 - search.gain_per_s * lag  # part of the old velocity after the step
        stopping = vx + (velocity[0] - vx) * left, vy + (velocity[1] - vy) * left
        cost += _stopping_cost(search, standing, (x, y), stopping)
        found[n] = cost + _between(costs[1], x / search.cell_m, y / search.cell_m)
    return found


@njit(cache=True, nogil=True)
def _lag(search: SpaceTime, time: float) -> float:
    """Return the time for which a velocity goes on that decays for a time."""
    return (1.0 - math.exp(-search.gain_per_s * time)) / search.gain_per_s


@njit(cache=True, nogil=True)
def _stopping_cost(
    search: SpaceTime,
    standing: StandingObstacles,
    start: Tuple[float, float],
    velocity: Tuple[float, float],
) -> float:
    """Return the cost of what stands on the way to a stop."""
    cost = 0.0
    for k in range(1, 2 * _SUBSTEPS + 1):
        lag = _lag(search, k * search.step_s / _SUBSTEPS)
        if _is_blocked(standing, start[0] + velocity[0] * lag, start[1] + velocity[1] * lag):
            cost += search.blocked_per_s * search.step_s / _SUBSTEPS
    return cost


@njit(cache=True, nogil=True)
def _is_blocked(standing: StandingObstacles, x: float, y: float) -> bool:
    """Return whether something stands at a point; nothing is known outside of the grid."""
    column = math.floor((x - standing.x_m) / standing.resolution_m)
    row = math.floor((y - standing.y_m) / standing.resolution_m)
    size_y, size_x = standing.blocked.shape
    return 0 <= row < size_y and 0 <= column < size_x and standing.blocked[row, column]


@njit(cache=True, nogil=True)
def _inside(index: int, middle: int) -> int:
    return min(max(index, 0), 2 * middle)


@njit(cache=True, nogil=True)
def _between(costs: NDArray[np.float64], x: float, y: float) -> float:
    """Interpolate float64[M, M] at (x, y) cells from the middle."""
    middle = costs.shape[0] // 2
    column, row = math.floor(x), math.floor(y)
    right, up = x - column, y - row
    i, j = _inside(int(row) + middle, middle), _inside(int(column) + middle, middle)
    k, m = _inside(i + 1, middle), _inside(j + 1, middle)
    return (1.0 - up) * ((1.0 - right) * costs[i, j] + right * costs[i, m]) + up * (
        (1.0 - right) * costs[k, j] + right * costs[k, m]
    )
