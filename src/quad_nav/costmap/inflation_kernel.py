"""Wavefront of the inflation layer.

Mirrors ``costmap/inflation.py``.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.files.kernel_cache import njit
from quad_nav.grid import FREE, INSCRIBED, LETHAL, UNKNOWN

_VISITED = -1  # a state below all others
_LEFT, _LOWER, _RIGHT, _UPPER = 1, 2, 4, 8  # steps that lead away from the seed
STEP_BITS = 4
_PART = 64  # cells of a row that are searched for seeds at once


class Ranks(NamedTuple):
    """Distances from a seed, ranked, of those that have a cost.

    A cell's state is one number: the rank of its distance above ``shift`` bits, then its place
    in the table, then the steps that lead away from its seed. States compare as ranks do.
    """

    costs: NDArray[np.uint8]
    """uint8[ranks], cost at each rank"""
    states: NDArray[np.signedinteger[Any]]
    """int32 or int64[radius + 2, radius + 2], the highest state of the rank at (abs(dx), abs(dy))
    cells; of rank ``ranks`` where there is no cost"""
    shift: int


@njit(cache=True, nogil=True)
def inflate(
    costs: NDArray[np.uint8],
    x0: int,
    xn: int,
    y0: int,
    yn: int,
    ranks: Ranks,
    inflate_unknown: bool,
) -> None:
    """Spread costs from the lethal cells of a window.

    Cells are visited by rank, first in first out within one, and pass their seed on to
    their left, lower, right and upper neighbour. A cell keeps the first seed that reaches
    it, so this is close to the exact Euclidean transform and not equal to it.

    Four short cuts change nothing. Only the rectangle within reach of the seeds is looked at. A
    neighbour that already waits at the same or a lower rank is not queued again: it would find
    itself visited. A step back towards the seed is not tried: its rank is lower, so that the
    neighbour has been visited. Ranks without a cost are not visited.

    Args:
        costs: uint8[H, W], changed in place.
        x0: First column of the window, inside the grid. Its lethal cells are seeds, in row
            order.
        xn: Column after the last one.
        y0: First row of the window.
        yn: Row after the last one.
        ranks: Distances and their costs.
        inflate_unknown: Overwrite unknown cells with costs below INSCRIBED, too.
    """
    shift, beyond, side = ranks.shift, ranks.costs.shape[0], ranks.states.shape[0]
    reach = side - 2
    seeds = _seeds(costs, x0, xn, y0, yn)
    if len(seeds) == 0:
        return
    rows, columns = seeds[:, 0], seeds[:, 1]
    low_x, low_y = max(0, columns.min() - reach), max(0, rows[0] - reach)
    high_x = min(costs.shape[1], columns.max() + 1 + reach)
    high_y = min(costs.shape[0], rows[-1] + 1 + reach)
    # Copies with a border of visited cells save the test for the grid's end.
    height, pitch = high_y - low_y + 2, high_x - low_x + 2
    near_2d = np.zeros((height, pitch), np.uint8)
    states_2d = np.full((height, pitch), _VISITED, ranks.states.dtype)
    unreached = ranks.states[side - 1, side - 1]
    for y in range(1, height - 1):
        _copy(costs[low_y + y - 1, low_x:high_x], near_2d[y, 1 : pitch - 1])
        states_2d[y, 1 : pitch - 1] = unreached
    near, states, table = near_2d.reshape(-1), states_2d.reshape(-1), ranks.states.reshape(-1)
    # Next and cell; the first entries are heads of the ranks' lists. Memory is taken from the
    # system as far as it is written to.
    most = len(seeds) + 4 * min(near.size, len(seeds) * (2 * reach + 1) ** 2)
    queue = np.empty((beyond + most, 2), np.int32)
    last = np.empty(beyond, np.int32)
    for rank in range(beyond):
        queue[rank, 0], last[rank] = -1, rank
    end = beyond
    for k in range(len(seeds)):
        cell = (rows[k] - low_y + 1) * pitch + columns[k] - low_x + 1
        states[cell] = _LEFT | _LOWER | _RIGHT | _UPPER
        end = _append(queue, last, end, 0, cell)
    payload = (1 << shift) - 1
    # Unsigned indices save the test for a negative one.
    one, row, column = np.uint64(1), np.uint64(pitch), np.uint64(side)
    for rank in range(beyond):
        cost = ranks.costs[rank]
        into_unknown = cost >= INSCRIBED or (inflate_unknown and cost > FREE)
        entry = queue[rank, 0]
        while entry >= 0:
            cell = np.uint64(queue[np.uint64(entry), 1])
            entry = queue[np.uint64(entry), 0]
            state = states[cell]
            if state >> shift == rank:
                states[cell] = _VISITED
                if near[cell] == UNKNOWN:
                    if into_unknown:
                        near[cell] = cost
                elif cost > near[cell]:
                    near[cell] = cost
                place = np.uint64((state & payload) >> STEP_BITS)
                limit_x, limit_y = table[place + column], table[place + one]
                state_x = limit_x - payload + (np.int64(place + column) << STEP_BITS)
                state_y = limit_y - payload + (np.int64(place + one) << STEP_BITS)
                if state & _LEFT and limit_x < states[cell - one]:
                    states[cell - one] = state_x | (state & (_LEFT | _LOWER | _UPPER))
                    end = _append(queue, last, end, limit_x >> shift, cell - one)
                if state & _LOWER and limit_y < states[cell - row]:
                    states[cell - row] = state_y | (state & (_LEFT | _LOWER | _RIGHT))
                    end = _append(queue, last, end, limit_y >> shift, cell - row)
                if state & _RIGHT and limit_x < states[cell + one]:
                    states[cell + one] = state_x | (state & (_LOWER | _RIGHT | _UPPER))
                    end = _append(queue, last, end, limit_x >> shift, cell + one)
                if state & _UPPER and limit_y < states[cell + row]:
                    states[cell + row] = state_y | (state & (_LEFT | _RIGHT | _UPPER))
                    end = _append(queue, last, end, limit_y >> shift, cell + row)
    for y in range(1, height - 1):
        _copy(near_2d[y, 1 : pitch - 1], costs[low_y + y - 1, low_x:high_x])


@njit(cache=True, nogil=True)
def _copy(source: NDArray[np.uint8], target: NDArray[np.uint8]) -> None:
    for k in range(source.size):  # faster than an assignment of slices
        target[k] = source[k]


@njit(cache=True, nogil=True)
def _seeds(costs: NDArray[np.uint8], x0: int, xn: int, y0: int, yn: int) -> NDArray[np.int64]:
    """Return row and column, int64[s, 2], of a window's lethal cells, in row order."""
    in_row = np.zeros(yn - y0, np.int64)
    for y in range(y0, yn):
        in_row[y - y0] = _count_lethal(costs[y, x0:xn])
    seeds = np.empty((in_row.sum(), 2), np.int64)
    count = 0
    for y in range(y0, yn):
        if in_row[y - y0] == 0:
            continue
        for begin in range(x0, xn, _PART):
            part = costs[y, begin : min(begin + _PART, xn)]
            if _count_lethal(part) == 0:
                continue
            for x in range(part.size):
                if part[x] == LETHAL:
                    seeds[count, 0], seeds[count, 1] = y, begin + x
                    count += 1
    return seeds


@njit(cache=True, nogil=True)
def _count_lethal(costs: NDArray[np.uint8]) -> int:
    count = 0
    for x in range(costs.size):  # a loop that the compiler makes vectors of
        count += costs[x] == LETHAL
    return count


@njit(cache=True, nogil=True, inline="always")
def _append(
    queue: NDArray[np.int32], last: NDArray[np.int32], end: int, rank: int, cell: int
) -> int:
    """Append a cell to a rank's list; return the end of the entries."""
    entry, index = np.uint64(end), np.uint64(rank)
    queue[entry, 0] = -1
    queue[entry, 1] = cell
    queue[np.uint64(last[index]), 0] = end
    last[index] = end
    return end + 1
