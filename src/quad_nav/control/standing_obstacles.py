"""Distances from obstacles that stand, and what it costs to be too near to one.

``control/evasion.py`` has the reasoning. Positions are metres relative to the robot.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.files.kernel_cache import njit
from quad_nav.grid import INSCRIBED, LETHAL

MARGIN_M = 0.05
"""Gap within which standing obstacles cost."""
_DEEP_M = 0.05  # overlap at which they cost twice as much as at the rim


class StandingObstacles(NamedTuple):
    """Obstacles that do not move, on the cells of the local costmap.

    Attributes:
        gaps: float64[H, W], distance from the robot's circle to the nearest obstacle when the
            robot is in the middle of a cell, metres: negative where they overlap, at most
            ``MARGIN_M``.
        x_m: x of the corner of cell (0, 0).
        y_m: y of the corner of cell (0, 0).
        resolution_m: Size of a cell.
    """

    gaps: NDArray[np.float64]
    x_m: float
    y_m: float
    resolution_m: float


@njit(cache=True, nogil=True)
def fill_gaps(
    costs: NDArray[np.uint8], cell: float, radius: float, gaps: NDArray[np.float64]
) -> None:
    """Fill the gaps of ``StandingObstacles``: from lethal cells, and no more than 0 if inscribed.

    Args:
        costs: uint8[H, W] of the local costmap.
        cell: Size of a cell.
        radius: Radius of the robot.
        gaps: float64[H, W].
    """
    size_y, size_x = costs.shape
    far = radius + MARGIN_M
    reach = int(far / cell)
    gaps[:] = far * far
    for row in range(size_y):
        for column in range(size_x):
            if costs[row, column] == LETHAL:
                _shorten(gaps, row, column, reach, cell)
    for row in range(size_y):
        for column in range(size_x):
            gaps[row, column] = math.sqrt(gaps[row, column]) - radius
            if costs[row, column] == INSCRIBED:
                gaps[row, column] = min(gaps[row, column], 0.0)


@njit(cache=True, nogil=True)
def _shorten(squares: NDArray[np.float64], row: int, column: int, reach: int, cell: float) -> None:
    """Let squared distances, float64[H, W], be no longer than to a cell, as far as its reach."""
    size_y, size_x = squares.shape
    for i in range(max(row - reach, 0), min(row + reach, size_y - 1) + 1):
        for j in range(max(column - reach, 0), min(column + reach, size_x - 1) + 1):
            squared = ((i - row) ** 2 + (j - column) ** 2) * cell * cell
            squares[i, j] = min(squares[i, j], squared)


@njit(cache=True, nogil=True)
def overlap_cost(standing: StandingObstacles, x: float, y: float) -> float:
    """Return what it costs to be at a point: 0 in the open, 1 at the rim of an obstacle.

    It grows with the overlap, so that a robot that is too near leaves by the nearest way.
    """
    gap = gap_at(standing, x, y)
    if gap >= MARGIN_M:
        return 0.0
    if gap > 0.0:
        return (1.0 - gap / MARGIN_M) ** 2
    return 1.0 - gap / _DEEP_M


@njit(cache=True, nogil=True)
def gap_at(standing: StandingObstacles, x: float, y: float) -> float:
    """Interpolate the gaps at a point; nothing is known outside of the grid."""
    gaps = standing.gaps
    across = (x - standing.x_m) / standing.resolution_m
    along = (y - standing.y_m) / standing.resolution_m
    size_y, size_x = gaps.shape
    if not (0.0 <= across < size_x and 0.0 <= along < size_y):
        return MARGIN_M
    across = min(max(across - 0.5, 0.0), size_x - 1.0)
    along = min(max(along - 0.5, 0.0), size_y - 1.0)
    column, row = int(across), int(along)
    right, up = across - column, along - row
    next_column, next_row = min(column + 1, size_x - 1), min(row + 1, size_y - 1)
    low = (1.0 - right) * gaps[row, column] + right * gaps[row, next_column]
    high = (1.0 - right) * gaps[next_row, column] + right * gaps[next_row, next_column]
    return (1.0 - up) * low + up * high


@njit(cache=True, nogil=True)
def overlap_costs(standing: StandingObstacles, offsets: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return ``overlap_cost`` at [y, x] of a grid with the same offsets in both, float64[M, M]."""
    found = np.empty((len(offsets), len(offsets)))
    for row in range(len(offsets)):
        for column in range(len(offsets)):
            found[row, column] = overlap_cost(standing, offsets[column], offsets[row])
    return found
