"""Search in space and time for the motion that moving obstacles threaten least.

``control/evasion.py`` has the reasoning. Cells are those of a square window of M by M cells around
the robot, at [row, column] = [y, x]; the robot is in the middle of cell [M // 2, M // 2]. Times
count from now. Coordinates are metres relative to the robot, along the axes of the costmap's frame.
"""

from __future__ import annotations

import math
from typing import List, NamedTuple, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.files.kernel_cache import njit

SUBSTEPS = 5
"""Predictions in each step."""
FAR = 3.0
"""Standard deviations from a disc at which its threat ends."""
_DEEP_M = 0.1  # depth inside a disc at which the threat is 2
_DURING = 0, 2  # predictions of a step that count: fast obstacles are gone at the next step


class SpaceTime(NamedTuple):
    """Resolution and costs of the search."""

    cell_m: float
    step_s: float
    max_speed_mps: float
    usual_speed_mps: float
    haste: float  # cost of a second, for each max_speed_mps above the usual speed
    risk_per_s: float  # cost of a second at the rim of an obstacle
    fade_per_s: float  # rate at which predictions lose their weight
    blocked_per_s: float  # cost of a second at the rim of what stands
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
        total += _threat_of(discs[k, n, 2], discs[k, n, 3], dx * dx + dy * dy)
    return total


@njit(cache=True, nogil=True)
def _threat_of(radius: float, sigma: float, squared: float) -> float:
    """Return the threat of a disc at a squared distance from its middle."""
    if squared >= (radius + FAR * sigma) ** 2:
        return 0.0
    beyond = math.sqrt(squared) - radius
    if beyond <= 0.0:
        return 1.0 - beyond / _DEEP_M
    return math.exp(-0.5 * (beyond / sigma) ** 2)


@njit(cache=True, nogil=True)
def haste_per_s(search: SpaceTime, speed_mps: float) -> float:
    """Return the cost of a second at a speed: that of flying faster than usual."""
    return search.haste * max(speed_mps - search.usual_speed_mps, 0.0) / search.max_speed_mps


@njit(cache=True, nogil=True)
def fill_costs(
    search: SpaceTime,
    discs: NDArray[np.float64],
    overlaps: NDArray[np.float64],
    to_go: NDArray[np.float64],
    costs: NDArray[np.float64],
) -> None:
    """Fill the least cost from each cell and step to the end of the horizon.

    Args:
        search: Resolution and costs.
        discs: float64[steps * 5 + 1, n, 4], as for ``threat``, five for each step.
        overlaps: float64[M, M], ``overlap_cost`` with what stands.
        to_go: float64[M, M], cost of the way that is left after the horizon.
        costs: float64[steps + 1, M, M], filled from step 1 on, as far as the robot may be.
    """
    steps, middle = costs.shape[0] - 1, costs.shape[1] // 2
    costs[steps], moves = to_go, _moves(search)
    threats = np.zeros(to_go.shape)
    for k in range(steps - 1, 0, -1):
        risk = search.risk_per_s * math.exp(-search.fade_per_s * k * search.step_s)
        near = filled_cells(search, k, middle)
        threats[:] = 0.0
        for later in _DURING:
            _add_threats(discs[k * SUBSTEPS + later], search.cell_m, near, threats)
        for row in range(middle - near, middle + near + 1):
            _fill_least(costs[k + 1], row, middle - near, moves, costs[k, row])
            for column in range(middle - near, middle + near + 1):
                cost = risk * threats[row, column] / len(_DURING)
                cost += search.away_per_s * to_go[row, column]
                cost += search.blocked_per_s * overlaps[row, column]
                costs[k, row, column] += cost * search.step_s


@njit(cache=True, nogil=True)
def filled_cells(search: SpaceTime, k: int, middle: int) -> int:
    """Return how many cells from the middle a step before the last one has costs."""
    return min(k * _reach(search) + 2, middle - _reach(search))


@njit(cache=True, nogil=True)
def _reach(search: SpaceTime) -> int:
    """Return how many cells the robot flies in a step."""
    return int(search.max_speed_mps * search.step_s / search.cell_m + 1e-6)


@njit(cache=True, nogil=True)
def _add_threats(
    discs: NDArray[np.float64], cell: float, near: int, threats: NDArray[np.float64]
) -> None:
    """Add the threat of discs, float64[n, 4], at the cells up to ``near`` cells from the middle."""
    middle = threats.shape[0] // 2
    for n in range(discs.shape[0]):
        far = discs[n, 2] + FAR * discs[n, 3]
        left, right = _cells(discs[n, 0], far, cell, near)
        low, high = _cells(discs[n, 1], far, cell, near)
        radius, sigma = discs[n, 2], discs[n, 3]
        for row in range(low, high + 1):
            dy = row * cell - discs[n, 1]
            for column in range(left, right + 1):
                dx = column * cell - discs[n, 0]
                threat_here = _threat_of(radius, sigma, dx * dx + dy * dy)
                threats[middle + row, middle + column] += threat_here


@njit(cache=True, nogil=True)
def _cells(place: float, far: float, cell: float, near: int) -> Tuple[int, int]:
    """Return the first and the last cell from the middle that are less than ``far`` away."""
    first, last = math.ceil((place - far) / cell), math.floor((place + far) / cell)
    return max(int(first), -near), min(int(last), near)


@njit(cache=True, nogil=True)
def _moves(search: SpaceTime) -> List[Tuple[int, int, float]]:
    """Return the moves of a step: rows, columns and cost."""
    reach = _reach(search)
    moves = []
    for i in range(-reach, reach + 1):
        for j in range(-reach, reach + 1):
            if i * i + j * j <= reach * reach:
                speed = math.hypot(i, j) * search.cell_m / search.step_s
                moves.append((i, j, haste_per_s(search, speed) * search.step_s))
    return moves


@njit(cache=True, nogil=True)
def _fill_least(
    costs: NDArray[np.float64],
    row: int,
    first: int,
    moves: List[Tuple[int, int, float]],
    least: NDArray[np.float64],
) -> None:
    """Fill the least cost of a move from each cell of a row and of the cell where it leads.

    Args:
        costs: float64[M, M] of the next step.
        row: The row.
        first: Its first cell; as many at its end are left out.
        moves: As from ``_moves``.
        least: float64[M].
    """
    end = len(least) - first
    filled = least[first:end]
    filled[:] = math.inf
    for i, j, cost in moves:
        reached = costs[row + i, first + j : end + j]
        for n in range(len(filled)):
            filled[n] = min(filled[n], cost + reached[n])
