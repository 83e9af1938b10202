"""Wavefront of the inflation layer.

Mirrors ``costmap/inflation.py``.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from quad_nav.grid import FREE, INSCRIBED, LETHAL, UNKNOWN
from quad_nav.kernels.jit import njit

_VISITED = -1
_NEIGHBOURS = ((-1, 0), (0, -1), (1, 0), (0, 1))  # left, lower, right, upper


@njit(cache=True, nogil=True)
def inflate(
    costs: NDArray[np.uint8],
    x0: int,
    xn: int,
    y0: int,
    yn: int,
    cost_table: NDArray[np.uint8],
    rank_table: NDArray[np.int32],
    inflate_unknown: bool,
) -> None:
    """Spread costs from the lethal cells of a window.

    Cells are visited by rank, first in first out within one, and pass their seed on to
    their left, lower, right and upper neighbour. A cell keeps the first seed that reaches
    it, so this is close to the exact Euclidean transform and not equal to it.

    A neighbour that already waits at the same or a lower rank is not queued again: it
    would find itself visited. This keeps queues short and changes nothing.

    Args:
        costs: uint8[H, W], changed in place.
        x0: First column of the window, inside the grid. Its lethal cells are seeds, in row
            order.
        xn: Column after the last one.
        y0: First row of the window.
        yn: Row after the last one.
        cost_table: uint8[radius + 2, radius + 2], cost at (abs(dx), abs(dy)) cells from a seed.
        rank_table: int32[radius + 2, radius + 2], rank of that distance among all distances.
            Distances beyond the radius have the highest rank.
        inflate_unknown: Overwrite unknown cells with costs below INSCRIBED, too.
    """
    radius = rank_table.shape[0] - 2
    reach = radius + 1  # of the seeds in the window; costs beyond it stay as they are
    low_x, low_y = max(0, x0 - reach), max(0, y0 - reach)
    high_x, high_y = min(costs.shape[1], xn + reach), min(costs.shape[0], yn + reach)
    costs = costs[low_y:high_y, low_x:high_x]
    x0, xn, y0, yn = x0 - low_x, xn - low_x, y0 - low_y, yn - low_y
    size_y, size_x = costs.shape
    beyond = rank_table.max()
    waiting = np.full((size_y, size_x), beyond, np.int32)
    # next, x, y, dx, dy; memory is taken from the system as far as it is written to.
    queue = np.empty((_most_entries(costs, x0, xn, y0, yn, radius), 5), np.int32)
    first = np.full(beyond, -1, np.int64)
    last = np.full(beyond, -1, np.int64)
    queued = 0
    for y in range(y0, yn):
        for x in range(x0, xn):
            if costs[y, x] == LETHAL:
                _append(queue, first, last, queued, 0, x, y, 0, 0)
                queued += 1
    for rank in range(beyond):
        entry = first[rank]
        while entry >= 0:
            x, y, dx, dy = queue[entry, 1], queue[entry, 2], queue[entry, 3], queue[entry, 4]
            if waiting[y, x] != _VISITED:
                waiting[y, x] = _VISITED
                _raise_cost(costs, x, y, cost_table[abs(dx), abs(dy)], inflate_unknown)
                for step_x, step_y in _NEIGHBOURS:
                    nx, ny = x + step_x, y + step_y
                    if not (0 <= nx < size_x and 0 <= ny < size_y):
                        continue
                    n_rank = rank_table[abs(dx + step_x), abs(dy + step_y)]
                    if rank <= n_rank < waiting[ny, nx]:
                        waiting[ny, nx] = n_rank
                        _append(
                            queue, first, last, queued, n_rank, nx, ny, dx + step_x, dy + step_y
                        )
                        queued += 1
            entry = queue[entry, 0]


@njit(cache=True, nogil=True)
def _most_entries(costs: NDArray[np.uint8], x0: int, xn: int, y0: int, yn: int, radius: int) -> int:
    """Return the most entries of the queue: the seeds and the neighbours of visited cells."""
    seeds = 0
    for y in range(y0, yn):
        for x in range(x0, xn):
            seeds += costs[y, x] == LETHAL
    return seeds + len(_NEIGHBOURS) * min(costs.size, seeds * (2 * radius + 1) ** 2)


@njit(cache=True, nogil=True, inline="always")
def _append(
    queue: NDArray[np.int32],
    first: NDArray[np.int64],
    last: NDArray[np.int64],
    entry: int,
    rank: int,
    x: int,
    y: int,
    dx: int,
    dy: int,
) -> None:
    queue[entry, 0] = -1
    queue[entry, 1] = x
    queue[entry, 2] = y
    queue[entry, 3] = dx
    queue[entry, 4] = dy
    if first[rank] < 0:
        first[rank] = entry
    else:
        queue[last[rank], 0] = entry
    last[rank] = entry


@njit(cache=True, nogil=True, inline="always")
def _raise_cost(costs: NDArray[np.uint8], x: int, y: int, cost: int, inflate_unknown: bool) -> None:
    old = costs[y, x]
    if old == UNKNOWN:
        if cost >= INSCRIBED or (inflate_unknown and cost > FREE):
            costs[y, x] = cost
    elif cost > old:
        costs[y, x] = cost
