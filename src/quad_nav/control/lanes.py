"""Velocity samples simulated side by side, for their ends alone.

The ends bound what a sample costs; nearly all samples need no more. Headings are turned by series
instead of cosines, in other order than in a simulation pose by pose. So the ends are not those to
the last bit, but the cells are, wherever ``index_of`` finds no doubt.

The state of some samples is one array, float64[ROWS * LANES], row by row, of which the compiler
makes vectors.
"""

from __future__ import annotations

import math
from typing import Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.costmap.collision import Triple
from quad_nav.files.kernel_cache import njit

LANES = 16
ROWS = 13
# Way in metres and turn in radians so far; heading; velocity; step; number of steps; sample.
(X, Y, TURN, _COS, _SIN, _VX, _VY, _VTHETA, _DT, LAST, _TO_X, _TO_Y, _TO_THETA) = range(
    0, ROWS * LANES, LANES
)
OFF_MAP = -1
UNCERTAIN = -2

_MOST_TURN_RAD = 0.5  # in one step, up to which the series of ``_cos_sin`` are exact


@njit(cache=True, nogil=True)
def fill_lane(
    state: NDArray[np.float64],
    lane: int,
    theta: float,
    velocity: Triple,
    sample: Triple,
    dt: float,
    last: int,
) -> bool:
    """Fill a lane with a sample that has not moved.

    The robot's heading is theta and its velocity approaches the sample in ``last`` steps of ``dt``
    seconds before the last pose.

    Returns:
        False if it turns too far in a step for its end to be certain.
    """
    state[X + lane], state[Y + lane], state[TURN + lane] = 0.0, 0.0, 0.0
    state[_COS + lane], state[_SIN + lane] = math.cos(theta), math.sin(theta)
    state[_VX + lane], state[_VY + lane], state[_VTHETA + lane] = velocity
    state[_TO_X + lane], state[_TO_Y + lane], state[_TO_THETA + lane] = sample
    state[_DT + lane], state[LAST + lane] = dt, last
    return max(abs(sample[2]), abs(velocity[2])) * dt <= _MOST_TURN_RAD


@njit(cache=True, nogil=True)
def travel_lanes(state: NDArray[np.float64], limits: Triple) -> None:
    """Move every lane to its last pose, within acceleration limits of 0 or more.

    A limit of inf is for a lane that has its sample's velocity at once.
    """
    steps, changing = _steps(state, limits)
    for k in range(changing):
        for i in range(LANES):
            dt = state[_DT + i]
            vx = _nearer(state[_TO_X + i], state[_VX + i], limits[0] * dt)
            vy = _nearer(state[_TO_Y + i], state[_VY + i], limits[1] * dt)
            vtheta = _nearer(state[_TO_THETA + i], state[_VTHETA + i], limits[2] * dt)
            state[_VX + i], state[_VY + i], state[_VTHETA + i] = vx, vy, vtheta
            cos, sin = state[_COS + i], state[_SIN + i]
            moving_s = dt if k < state[LAST + i] else 0.0
            state[X + i] += (vx * cos - vy * sin) * moving_s
            state[Y + i] += (vx * sin + vy * cos) * moving_s
            state[TURN + i] += vtheta * moving_s
            turned_cos, turned_sin = _cos_sin(vtheta * dt)
            state[_COS + i] = cos * turned_cos - sin * turned_sin
            state[_SIN + i] = sin * turned_cos + cos * turned_sin
    for i in range(LANES):
        # From here on each step is the one before, turned by the same angle.
        dt, cos, sin = state[_DT + i], state[_COS + i], state[_SIN + i]
        turn = state[_TO_THETA + i] * dt
        state[TURN + i] += turn * max(state[LAST + i] - changing, 0.0)
        state[_VX + i] = (state[_TO_X + i] * cos - state[_TO_Y + i] * sin) * dt
        state[_VY + i] = (state[_TO_X + i] * sin + state[_TO_Y + i] * cos) * dt
        state[_COS + i], state[_SIN + i] = _cos_sin(turn)
    for k in range(changing, steps):
        for i in range(LANES):
            dx, dy = state[_VX + i], state[_VY + i]
            share = 1.0 if k < state[LAST + i] else 0.0
            state[X + i] += dx * share
            state[Y + i] += dy * share
            state[_VX + i] = dx * state[_COS + i] - dy * state[_SIN + i]
            state[_VY + i] = dy * state[_COS + i] + dx * state[_SIN + i]


@njit(cache=True, nogil=True)
def _steps(state: NDArray[np.float64], limits: Triple) -> Tuple[int, int]:
    """Return the most steps of a lane, and in how many of them speeds change."""
    most, changing = 0.0, 0.0
    for i in range(LANES):
        most, dt = max(most, state[LAST + i]), state[_DT + i]
        for k in range(3):
            change = abs(state[_TO_X + k * LANES + i] - state[_VX + k * LANES + i])
            max_change = limits[k] * dt
            if change > max(changing - 1.0, 0.0) * max_change:
                changing = math.ceil(change / max_change) + 1.0 if max_change > 0.0 else np.inf
    return int(most), int(min(changing, most))


@njit(cache=True, nogil=True)
def _nearer(wanted: float, current: float, max_change: float) -> float:
    """Return the speed after a step, without a branch."""
    return current + min(max(wanted - current, -max_change), max_change)


@njit(cache=True, nogil=True)
def _cos_sin(angle: float) -> Tuple[float, float]:
    """Return cosine and sine of an angle up to _MOST_TURN_RAD, by their series."""
    q = angle * angle
    cos = 1.0 - q * (1.0 / 132.0) * (1.0 - q * (1.0 / 182.0))
    cos = 1.0 - q * (1.0 / 30.0) * (1.0 - q * (1.0 / 56.0) * (1.0 - q * (1.0 / 90.0) * cos))
    cos = 1.0 - q * 0.5 * (1.0 - q * (1.0 / 12.0) * cos)
    sin = 1.0 - q * (1.0 / 110.0) * (1.0 - q * (1.0 / 156.0))
    sin = 1.0 - q * (1.0 / 20.0) * (1.0 - q * (1.0 / 42.0) * (1.0 - q * (1.0 / 72.0) * sin))
    sin = angle * (1.0 - q * (1.0 / 6.0) * sin)
    return cos, sin


@njit(cache=True, nogil=True)
def doubt_of(rounding: float, last: float, coordinate: float, reach: float, turn: float) -> float:
    """Return how far an end is off at most, in cells, from that of a simulation pose by pose.

    The largest coordinate on the way, of either sign, and the length of the way are in cells, the
    largest heading in radians; ``rounding`` is the relative error of a number of the simulation.
    """
    return 1e-6 + rounding * (last + 2.0) * (abs(coordinate) + reach * (2.0 + abs(turn)))


@njit(cache=True, nogil=True)
def index_of(cell: float, size: int, doubt: float) -> int:
    """Return the index of a coordinate, in cells from the grid's border, along an axis.

    Returns:
        The index, OFF_MAP, or UNCERTAIN if it may be that of the next cell, by a doubt in cells.
    """
    if cell < -0.5 or cell > size + 0.5:
        return OFF_MAP if doubt < 0.5 else UNCERTAIN
    part = cell - math.floor(cell)
    if not doubt < part < 1.0 - doubt:
        return UNCERTAIN
    return int(cell) if 0.0 <= cell < size else OFF_MAP


@njit(cache=True, nogil=True)
def cell_of_end(x: float, y: float, shape: Tuple[int, int], doubt: float) -> Tuple[int, int]:
    """Return column and row of an end, in cells from the corner of a grid of rows and columns.

    Both are OFF_MAP or UNCERTAIN where one is.
    """
    column, row = index_of(x, shape[1], doubt), index_of(y, shape[0], doubt)
    if column == OFF_MAP or row == OFF_MAP:
        return OFF_MAP, OFF_MAP
    if column == UNCERTAIN or row == UNCERTAIN:
        return UNCERTAIN, UNCERTAIN
    return column, row
