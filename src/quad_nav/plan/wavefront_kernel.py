"""Wavefront that spreads a potential over a grid.

Grids are flat arrays, cell = y * size_x + x. The wave never enters the outermost ring of cells,
which keeps every neighbour inside. ``plan/navfn.py`` has the maths. All sums are float32 in
the order of upstream's, so that potentials are equal to the bit.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.files.kernel_cache import njit
from quad_nav.grid import LETHAL

NOT_REACHED: np.float32 = np.float32(1e10)
BUCKET_SIZE = 10000  # cells that one bucket holds; further ones are dropped

_CLOSED = np.uint8(LETHAL)  # state of a cell in a bucket, which no wave enters
_ROWS = 32  # rows of the map that are copied at once, on either side of the wave
_INVERSE_SQRT2 = 0.707106781


class WaveParams(NamedTuple):
    """Parameters of a wave, and what cells cost it by their cost in the costmap."""

    price: NDArray[np.float32]  # [256], cost of a cell in whole numbers
    crossing: NDArray[np.float32]  # [256], see ``crossings``; +inf for LETHAL
    obstacle: int  # cost of cells that are never entered
    neutral: int  # cost of a free cell
    planar: bool  # potentials of a planar wave; else of a step from the lowest neighbour
    stop_at_target: bool  # stop when the target has a potential
    heuristic: bool  # take cells in A*'s order


def crossings(costs: NDArray[Any], obstacle: int) -> NDArray[np.float32]:
    """Return what the shortest way over cells of these costs is worth, float32, +inf for obstacles.

    A wave comes to a neighbour whose potential is higher than its own by more than that.
    """
    exact = np.asarray(costs, dtype=np.float32).astype(np.float64)
    crossing: NDArray[np.float32] = (_INVERSE_SQRT2 * exact).astype(np.float32)
    crossing[exact >= obstacle] = np.inf
    return crossing


@njit(cache=True, nogil=True, error_model="numpy")  # a gap is never divided by 0
def arrival(
    cost: np.float32,
    left: np.float32,
    right: np.float32,
    below: np.float32,
    above: np.float32,
    planar: bool,
) -> np.float32:
    """Return the potential, float32, of a cell with a cost from those of its four neighbours.

    It is that of a planar wave that arrives over the two lower neighbours, or else of a step from
    the lowest one.
    """
    horizontal, vertical = min(left, right), min(below, above)
    lower = min(horizontal, vertical)
    gap = np.float32(abs(horizontal - vertical))
    if not planar or gap >= cost:
        return np.float32(lower + cost)
    ratio = np.float64(np.float32(gap / cost))
    factor = np.float32(-0.2301 * ratio * ratio + 0.5307 * ratio + 0.7040)
    return np.float32(lower + np.float32(cost * factor))


@njit(cache=True, nogil=True)
def arrival_at(
    potential: NDArray[np.float32], size_x: int, cell: int, cost: float, planar: bool
) -> np.float32:
    """Return the ``arrival`` at a flat cell of float32[n], not of the outermost ring."""
    return arrival(
        np.float32(cost),
        potential[cell - 1],
        potential[cell + 1],
        potential[cell - size_x],
        potential[cell + size_x],
        planar,
    )


@njit(cache=True, nogil=True)
def start_at_cell(potential: NDArray[np.float32], source: int, size_x: int) -> NDArray[np.int64]:
    """Begin with 0 in one flat cell of float32[n]; return the first front, int64[4]."""
    potential[source] = 0.0
    return np.array([source + 1, source - 1, source - size_x, source + size_x])


@njit(cache=True, nogil=True)
def start_between_cells(
    potential: NDArray[np.float32],
    source: int,
    size_x: int,
    dx: float,
    dy: float,
    neutral: int,
) -> NDArray[np.int64]:
    """Begin at a point between the centres of four cells of float32[n].

    The point is (dx, dy) cells right of and above the source's centre. The four cells share the
    cost of two free cells by the areas opposite to them.

    Returns:
        The first front, int64[8] flat cells.
    """
    twice = 2 * neutral
    _seed(potential, source, twice * dx * dy)
    _seed(potential, source + 1, twice * (1.0 - dx) * dy)
    _seed(potential, source + size_x, twice * dx * (1.0 - dy))
    _seed(potential, source + size_x + 1, twice * (1.0 - dx) * (1.0 - dy))
    return np.array(
        [
            source + 2,
            source - 1,
            source + size_x - 1,
            source + size_x + 2,
            source - size_x,
            source - size_x + 1,
            source + 2 * size_x,
            source + 2 * size_x + 1,
        ]
    )


@njit(cache=True, nogil=True)
def _seed(potential: NDArray[np.float32], cell: int, value: float) -> None:
    if 0 <= cell < potential.size:
        potential[cell] = value


@njit(cache=True, nogil=True)
def _distance_costs(size: int, target: int, size_x: int, neutral: int) -> NDArray[np.float32]:
    """Return what the straight line from each flat cell to the target costs, float32[size]."""
    costs = np.empty(size, dtype=np.float32)
    for cell in range(size):
        costs[cell] = neutral * math.hypot(
            cell % size_x - target % size_x, cell // size_x - target // size_x
        )
    return costs


@njit(cache=True, nogil=True, forceinline=True)
def push(
    buckets: NDArray[np.uint32],
    end: np.uint64,
    last_roomy: np.uint64,
    states: NDArray[np.uint8],
    cells: Tuple[np.uint64, np.uint64, np.uint64, np.uint64],
    before: Tuple[np.uint8, np.uint8, np.uint8, np.uint8],
    wanted: Tuple[Any, Any, Any, Any],
    may_fill: bool,
) -> np.uint64:
    """Append to a bucket those of four cells that are wanted, and close them.

    Cells for which the bucket has no place are dropped.

    Args:
        buckets: uint32[k], changed in place; the place behind a full bucket is overwritten, too.
        end: Index after the bucket's last cell; the result is that index now.
        last_roomy: Last index from which on the bucket has places for four cells.
        states: uint8[n], LETHAL for cells that are in a bucket; changed in place.
        cells: Flat cells, all different.
        before: The states of the four cells.
        wanted: Four bools, True for the cells that the wave comes to.
        may_fill: False if the bucket is known to have places for all.
    """
    # Not one branch for each cell: a processor cannot foresee which cells a wave comes to.
    new_0, new_1, new_2, new_3 = wanted
    if may_fill and end > last_roomy:
        places = last_roomy + np.uint64(4) - end
        new_0 &= places > np.uint64(0)
        places -= np.uint64(new_0)
        new_1 &= places > np.uint64(0)
        places -= np.uint64(new_1)
        new_2 &= places > np.uint64(0)
        places -= np.uint64(new_2)
        new_3 &= places > np.uint64(0)
    buckets[end] = cells[0]
    end += np.uint64(new_0)
    buckets[end] = cells[1]
    end += np.uint64(new_1)
    buckets[end] = cells[2]
    end += np.uint64(new_2)
    buckets[end] = cells[3]
    end += np.uint64(new_3)
    states[cells[0]] = _CLOSED if new_0 else before[0]
    states[cells[1]] = _CLOSED if new_1 else before[1]
    states[cells[2]] = _CLOSED if new_2 else before[2]
    states[cells[3]] = _CLOSED if new_3 else before[3]
    return end


class _Buckets(NamedTuple):
    """Where the buckets begin and end: indices, unsigned, which saves the test for negative ones.

    They are this front, the cells for the next one, and the cells for when nothing below the
    threshold is left.
    """

    front: np.uint64
    front_end: np.uint64
    ahead: np.uint64
    ahead_end: np.uint64
    later: np.uint64
    later_end: np.uint64


@njit(cache=True, nogil=True, forceinline=True, error_model="numpy")
def _spread_front(
    costs: NDArray[np.uint8],
    potential: NDArray[np.float32],
    states: NDArray[np.uint8],
    distances: NDArray[np.float32],
    tables: Tuple[NDArray[np.float32], NDArray[np.float32]],
    buckets: NDArray[np.uint32],
    places: _Buckets,
    threshold: np.float32,
    size_x: int,
    planar: bool,
    heuristic: bool,
    may_fill: bool,
) -> Tuple[np.uint64, np.uint64]:
    """Visit the cells of a front in turn; return the ends of the next front and of the later one.

    Args:
        costs: uint8[n], costs of cells.
        potential: float32[n], lowered in place.
        states: uint8[n], the costs, but LETHAL for cells in a bucket; changed in place.
        distances: float32[n] for A*'s order, see ``_distance_costs``.
        tables: ``WaveParams.price`` and ``.crossing``.
        buckets: uint32[k], changed in place.
        places: Places of the three buckets.
        threshold: Priority from which on cells wait in the later bucket.
        size_x: Cells in a row.
        planar: As in ``WaveParams``. A constant here makes the loop shorter.
        heuristic: As in ``WaveParams``, likewise.
        may_fill: False if the front is known not to fill a bucket, likewise.
    """
    price, crossing = tables
    front, front_end, ahead, ahead_end, later, later_end = places
    last_roomy = np.uint64(BUCKET_SIZE - 4)
    ahead_roomy, later_roomy = ahead + last_roomy, later + last_roomy
    one, stride = np.uint64(1), np.uint64(size_x)
    for k in range(front, front_end):
        cell = np.uint64(buckets[k])
        left, right, below, above = cell - one, cell + one, cell - stride, cell + stride
        from_left, from_right = potential[left], potential[right]
        from_below, from_above = potential[below], potential[above]
        cost = price[costs[cell]]  # not its state: it may be in the next front already
        here = arrival(cost, from_left, from_right, from_below, from_above, planar)
        # Most cells that have a potential keep it, and all others get one. A processor that
        # finds these two tests foresees both.
        before = potential[cell]
        if before < NOT_REACHED:
            if here >= before:
                continue
        elif here >= NOT_REACHED:
            continue
        potential[cell] = here
        priority = np.float32(here + distances[cell]) if heuristic else here
        cells = (left, right, below, above)
        around = (states[left], states[right], states[below], states[above])
        wanted = (
            from_left > np.float32(priority + crossing[around[0]]),
            from_right > np.float32(priority + crossing[around[1]]),
            from_below > np.float32(priority + crossing[around[2]]),
            from_above > np.float32(priority + crossing[around[3]]),
        )
        if priority < threshold:
            ahead_end = push(
                buckets, ahead_end, ahead_roomy, states, cells, around, wanted, may_fill
            )
        else:
            later_end = push(
                buckets, later_end, later_roomy, states, cells, around, wanted, may_fill
            )
    return ahead_end, later_end


@njit(cache=True, nogil=True)
def _copy_rows(
    costs: NDArray[np.uint8], states: NDArray[np.uint8], size_x: int, first: int, end: int
) -> None:
    """Copy the rows of a map from a first to an end but for its outermost ring of cells."""
    first, end = max(1, first), min(costs.size // size_x - 1, end)
    for cell in range(np.uint64(first * size_x), np.uint64(max(first, end) * size_x)):
        states[cell] = costs[cell]
    for y in range(first, end):
        states[y * size_x] = states[(y + 1) * size_x - 1] = _CLOSED


@njit(cache=True, nogil=True)
def propagate(
    costs: NDArray[np.uint8],
    potential: NDArray[np.float32],
    states: NDArray[np.uint8],
    first_front: NDArray[np.int64],
    params: WaveParams,
    source: int,
    target: int,
    size_x: int,
    max_fronts: int,
) -> Tuple[bool, int]:
    """Spread a potential that has begun at a source.

    Args:
        costs: uint8[n], costs of the costmap.
        potential: float32[n], NOT_REACHED but where the wave has begun; lowered in place.
        states: uint8[n], working memory. LETHAL in the outermost ring of cells, which stays; the
            rest is overwritten as far as the wave comes.
        first_front: int64[k], flat cells, as ``start_at_cell`` returns them.
        params: Parameters of the wave.
        source: Flat cell where the wave has begun.
        target: Flat cell that the wave is to reach.
        size_x: Cells in a row.
        max_fronts: Most fronts to spread; the wave also stops when nothing is left.

    Returns:
        True if the wave stopped at the target, and the number of fronts: the potential has
        changed at most so many cells from the first front.
    """
    price, crossing, obstacle, neutral, planar, stop_at_target, heuristic = params
    tables, source_y = (price, crossing), source // size_x
    # A cell in a bucket has the state of an obstacle: one look-up says that it is not to be
    # appended, for either reason. Only as many rows are copied as the wave can come to.
    reach = 3 + _ROWS
    _copy_rows(costs, states, size_x, source_y - reach, source_y + reach + 1)
    last_roomy, room = np.uint64(BUCKET_SIZE - 4), np.uint64(BUCKET_SIZE + 1)
    buckets = np.empty(3 * (BUCKET_SIZE + 1), dtype=np.uint32)
    front, ahead, later = np.uint64(0), room, room + room
    front_end, ahead_end, later_end = front, ahead, later
    for cell in first_front:
        if 0 <= cell < costs.size and crossing[states[cell]] < np.inf:
            buckets[front_end] = cell
            states[cell] = _CLOSED
            front_end += np.uint64(1)
    threshold = np.float32(obstacle)
    distances = _distance_costs(costs.size if heuristic else 0, target, size_x, neutral)
    if heuristic:
        threshold = np.float32(threshold + distances[source])
    has_arrived, fronts = False, 0
    while fronts < max_fronts and front_end > front and not has_arrived:
        fronts += 1
        if fronts + 3 > reach:
            _copy_rows(costs, states, size_x, source_y - reach - _ROWS, source_y - reach)
            _copy_rows(costs, states, size_x, source_y + reach + 1, source_y + reach + _ROWS + 1)
            reach += _ROWS
        for k in range(front, front_end):
            states[buckets[k]] = costs[buckets[k]]
        places = _Buckets(front, front_end, ahead, ahead_end, later, later_end)
        most = np.uint64(4) * (front_end - front)
        may_fill = most > last_roomy or later_end + most > later + last_roomy
        if planar and not heuristic and not may_fill:
            ahead_end, later_end = _spread_front(
                *(costs, potential, states, distances, tables, buckets, places, threshold),
                *(size_x, True, False, False),
            )
        else:
            ahead_end, later_end = _spread_front(
                *(costs, potential, states, distances, tables, buckets, places, threshold),
                *(size_x, planar, heuristic, True),
            )
        front, front_end, ahead, ahead_end = ahead, ahead_end, front, front
        if front_end == front:
            threshold = np.float32(threshold + np.float32(2 * neutral))
            front, front_end, later, later_end = later, later_end, front, front
        has_arrived = stop_at_target and potential[target] < NOT_REACHED
    return has_arrived, fronts
