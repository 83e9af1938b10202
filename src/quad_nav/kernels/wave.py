"""Wavefront that spreads a potential over a grid.

Grids are flat arrays, cell = y * size_x + x. The outermost ring of cells must be obstacles,
which keeps every neighbour inside. ``plan/navfn.py`` has the maths. All sums are float32 in
the order of upstream's, so that potentials are equal to the bit.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.kernels.jit import njit

NOT_REACHED: np.float32 = np.float32(1e10)
BUCKET_SIZE = 10000  # cells that one bucket holds; further ones are dropped

_INVERSE_SQRT2 = 0.707106781


class WaveParams(NamedTuple):
    """Parameters of a wave."""

    obstacle: int  # cells of this cost are never entered
    neutral: int  # cost of a free cell
    planar: bool  # potentials of a planar wave; else of a step from the lowest neighbour
    stop_at_target: bool  # stop when the target has a potential
    heuristic: bool  # take cells in A*'s order


@njit(cache=True, nogil=True)
def arrival(
    cost: np.float32,
    left: np.float32,
    right: np.float32,
    below: np.float32,
    above: np.float32,
    planar: bool,
) -> np.float32:
    """Return the potential, float32, of a cell from those of its neighbours.

    It is that of a planar wave that arrives over the two lower neighbours, or else of a step
    from the lowest one.

    Args:
        cost: float32, cost of the cell.
        left: float32, potential of the left neighbour.
        right: float32, potential of the right neighbour.
        below: float32, potential of the lower neighbour.
        above: float32, potential of the upper neighbour.
        planar: True for a planar wave.
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
    dx: np.float32,
    dy: np.float32,
    neutral: int,
) -> NDArray[np.int64]:
    """Begin at a point between the centres of four cells.

    The four cells share the cost of two free cells by the areas opposite to them.

    Args:
        potential: float32[n], changed in place.
        source: Flat cell left of and below the point.
        size_x: Cells in a row.
        dx: float32, cells by which the point is right of the source's centre.
        dy: float32, cells by which the point is above the source's centre.
        neutral: Cost of a free cell.

    Returns:
        The first front, int64[8] flat cells.
    """
    twice, one = np.float32(2 * neutral), np.float32(1.0)
    _seed(potential, source, twice * dx * dy)
    _seed(potential, source + 1, twice * (one - dx) * dy)
    _seed(potential, source + size_x, twice * dx * (one - dy))
    _seed(potential, source + size_x + 1, twice * (one - dx) * (one - dy))
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
def _seed(potential: NDArray[np.float32], cell: int, value: np.float32) -> None:
    if 0 <= cell < potential.size:
        potential[cell] = value


@njit(cache=True, nogil=True)
def _distance_cost(cell: Any, other: int, size_x: int, neutral: int) -> np.float32:
    return np.float32(
        math.hypot(cell % size_x - other % size_x, cell // size_x - other // size_x) * neutral
    )


@njit(cache=True, nogil=True)
def _enter_front(
    costs: NDArray[Any],
    pending: NDArray[np.bool_],
    front: NDArray[np.uint32],
    cells: NDArray[np.int64],
    obstacle: int,
) -> int:
    """Put the cells, int64[k], that can be entered into a front; return their number."""
    count = 0
    for cell in cells:
        if 0 <= cell < costs.size and costs[cell] < obstacle and not pending[cell]:
            front[count] = cell
            pending[cell] = True
            count += 1
    return count


@njit(cache=True, nogil=True)
def propagate(
    costs: NDArray[Any],
    potential: NDArray[np.float32],
    first_front: NDArray[np.int64],
    params: WaveParams,
    source: int,
    target: int,
    size_x: int,
    max_fronts: int,
) -> bool:
    """Spread a potential that has begun at a source.

    Args:
        costs: uint8[n] or float32[n], at most ``params.obstacle``.
        potential: float32[n], NOT_REACHED but where the wave has begun; lowered in place.
        first_front: int64[k], flat cells, as ``start_at_cell`` returns them.
        params: Parameters of the wave.
        source: Flat cell where the wave has begun.
        target: Flat cell that the wave is to reach.
        size_x: Cells in a row.
        max_fronts: Most fronts to spread; the wave also stops when nothing is left.

    Returns:
        True if the wave stopped at the target.
    """
    obstacle, neutral, planar, stop_at_target, heuristic = params
    pending = np.zeros(costs.size, dtype=np.bool_)  # cell is in a bucket
    front = np.empty(BUCKET_SIZE, dtype=np.uint32)
    ahead = np.empty(BUCKET_SIZE, dtype=np.uint32)  # for the next front
    later = np.empty(BUCKET_SIZE, dtype=np.uint32)  # for when nothing below the threshold is left
    in_front = _enter_front(costs, pending, front, first_front, obstacle)
    in_ahead, in_later = 0, 0
    threshold = np.float32(obstacle)
    if heuristic:
        threshold = np.float32(threshold + _distance_cost(source, target, size_x, neutral))
    stride = np.uint32(size_x)  # unsigned indices save the test for a negative one
    one = np.uint32(1)
    for _ in range(max_fronts):
        if in_front == 0 and in_ahead == 0:
            break
        for k in range(in_front):
            pending[front[k]] = False
        for k in range(in_front):
            cell = front[k]
            neighbours = (cell - one, cell + one, cell - stride, cell + stride)
            around = (
                potential[neighbours[0]],
                potential[neighbours[1]],
                potential[neighbours[2]],
                potential[neighbours[3]],
            )
            # Potentials are made of whole costs, the comparison below is of exact ones.
            here = arrival(
                np.float32(int(costs[cell])), around[0], around[1], around[2], around[3], planar
            )
            if here >= potential[cell]:
                continue
            potential[cell] = here
            priority = here
            if heuristic:
                priority = np.float32(
                    here + _distance_cost(np.int64(cell), target, size_x, neutral)
                )
            for j in range(4):
                cost = costs[neighbours[j]]
                crossing = np.float32(_INVERSE_SQRT2 * np.float64(cost))
                if (
                    around[j] <= np.float32(priority + crossing)
                    or cost >= obstacle
                    or pending[neighbours[j]]
                ):
                    continue
                if priority < threshold and in_ahead < BUCKET_SIZE:
                    ahead[in_ahead] = neighbours[j]
                    in_ahead += 1
                elif priority >= threshold and in_later < BUCKET_SIZE:
                    later[in_later] = neighbours[j]
                    in_later += 1
                else:
                    continue
                pending[neighbours[j]] = True
        front, ahead, in_front, in_ahead = ahead, front, in_ahead, 0
        if in_front == 0:
            threshold = np.float32(threshold + np.float32(2 * neutral))
            front, later, in_front, in_later = later, front, in_later, 0
        if stop_at_target and potential[target] < NOT_REACHED:
            return True
    return False
