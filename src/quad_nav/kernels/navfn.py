"""Loops of NavFn: the wavefront, and the descent of its potential.

Grids are flat arrays, cell = y * size_x + x. The maths is in ``plan/navfn.py``.
All sums are float32 in the order that the recorded potentials demand.
"""
from __future__ import annotations

import math
from typing import Tuple

import numpy as np
from numba import njit

OBSTACLE = 254            # cells of this cost are never entered
NOT_REACHED = np.float32(1e10)
NEUTRAL = 50              # cost of a free cell
BUCKET_SIZE = 10000       # cells that one bucket holds; further ones are dropped

_INVERSE_SQRT2 = 0.707106781
_THRESHOLD_STEP = np.float32(2 * NEUTRAL)
_STEP_CELLS = 0.5


@njit(cache=True, nogil=True)
def _arrival(cost, left, right, below, above):
    """Potential of a planar wave that arrives over the two lower neighbours."""
    horizontal, vertical = min(left, right), min(below, above)
    lower = min(horizontal, vertical)
    gap = np.float32(abs(horizontal - vertical))
    cost = np.float32(cost)
    if gap >= cost:
        return np.float32(lower + cost)
    ratio = np.float64(np.float32(gap / cost))
    factor = np.float32(-0.2301 * ratio * ratio + 0.5307 * ratio + 0.7040)
    return np.float32(lower + np.float32(cost * factor))


@njit(cache=True, nogil=True)
def _distance_cost(cell, other, size_x):
    return np.float32(math.hypot(cell % size_x - other % size_x,
                                 cell // size_x - other // size_x) * NEUTRAL)


@njit(cache=True, nogil=True)
def _first_front(costs, pending, front, source, size_x):
    """The neighbours of the source; returns how many there are."""
    count = 0
    for offset in (1, -1, -size_x, size_x):
        cell = source + offset
        if 0 <= cell < costs.size and costs[cell] < OBSTACLE:
            front[count] = cell
            pending[cell] = True
            count += 1
    return count


@njit(cache=True, nogil=True)
def propagate(costs, potential, source, start, size_x, max_cycles, stop_at_start, heuristic):
    """Spread the potential from ``source``, at most ``max_cycles`` fronts.

    ``costs`` uint8[n] (50..254, the outermost ring of cells 254), ``potential``
    float32[n], filled with NOT_REACHED and lowered in place. Stops early when
    nothing is left, or, with ``stop_at_start``, when the start cell has a
    potential. ``heuristic`` makes it A*.
    """
    pending = np.zeros(costs.size, dtype=np.bool_)  # cell is in a bucket
    front = np.empty(BUCKET_SIZE, dtype=np.uint32)
    ahead = np.empty(BUCKET_SIZE, dtype=np.uint32)  # for the next front
    later = np.empty(BUCKET_SIZE, dtype=np.uint32)  # for when nothing below the threshold is left
    in_front, in_ahead, in_later = _first_front(costs, pending, front, source, size_x), 0, 0
    potential[source] = 0.0
    threshold = np.float32(OBSTACLE)
    if heuristic:
        threshold = np.float32(threshold + _distance_cost(source, start, size_x))
    stride = np.uint32(size_x)  # unsigned indices save the test for a negative one
    one = np.uint32(1)
    for _ in range(max_cycles):
        if in_front == 0 and in_ahead == 0:
            break
        for k in range(in_front):
            pending[front[k]] = False
        for k in range(in_front):
            cell = front[k]
            neighbours = (cell - one, cell + one, cell - stride, cell + stride)
            around = (potential[neighbours[0]], potential[neighbours[1]],
                      potential[neighbours[2]], potential[neighbours[3]])
            arrival = _arrival(costs[cell], around[0], around[1], around[2], around[3])
            if arrival >= potential[cell]:
                continue
            potential[cell] = arrival
            priority = arrival
            if heuristic:
                priority = np.float32(
                    arrival + _distance_cost(np.int64(cell), start, size_x))
            for j in range(4):
                cost = costs[neighbours[j]]
                crossing = np.float32(_INVERSE_SQRT2 * np.float64(cost))
                if (around[j] <= np.float32(priority + crossing) or cost >= OBSTACLE
                        or pending[neighbours[j]]):
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
            threshold = np.float32(threshold + _THRESHOLD_STEP)
            front, later, in_front, in_later = later, front, in_later, 0
        if stop_at_start and potential[start] < NOT_REACHED:
            break


@njit(cache=True, nogil=True)
def _gradient(potential, size_x, cell) -> Tuple[float, float]:
    """Unit vector down the potential at a cell, (0, 0) where there is none."""
    if cell < size_x or cell > potential.size - size_x - 1:
        return 0.0, 0.0
    return _slope(potential, cell, 1), _slope(potential, cell, size_x)


@njit(cache=True, nogil=True)
def _slope(potential, cell, stride):
    before, here, after = potential[cell - stride], potential[cell], potential[cell + stride]
    slope = np.float32(0.0)
    if here >= NOT_REACHED:  # inside an obstacle: towards the reached side
        if before < NOT_REACHED:
            return np.float32(-OBSTACLE)
        if after < NOT_REACHED:
            return np.float32(OBSTACLE)
        return slope
    if before < NOT_REACHED:
        slope += before - here
    if after < NOT_REACHED:
        slope += here - after
    return np.float32(slope)


@njit(cache=True, nogil=True)
def _unit_gradient(potential, size_x, cell):
    gx, gy = _gradient(potential, size_x, cell)
    norm = math.hypot(gx, gy)
    if norm > 0.0:
        return np.float32(gx / norm), np.float32(gy / norm)
    return np.float32(0.0), np.float32(0.0)


@njit(cache=True, nogil=True)
def _interpolated_gradient(potential, size_x, cell, dx, dy):
    x00, y00 = _unit_gradient(potential, size_x, cell)
    x10, y10 = _unit_gradient(potential, size_x, cell + 1)
    x01, y01 = _unit_gradient(potential, size_x, cell + size_x)
    x11, y11 = _unit_gradient(potential, size_x, cell + size_x + 1)
    gx = (1.0 - dy) * ((1.0 - dx) * x00 + dx * x10) + dy * ((1.0 - dx) * x01 + dx * x11)
    gy = (1.0 - dy) * ((1.0 - dx) * y00 + dx * y10) + dy * ((1.0 - dx) * y01 + dx * y11)
    return np.float32(gx), np.float32(gy)


@njit(cache=True, nogil=True)
def _lowest_around(potential, size_x, cell):
    """The lowest of a cell and its eight neighbours, and whether all nine are reached."""
    lowest, all_reached = cell, True
    for offset_y in (-size_x, 0, size_x):
        for offset_x in (-1, 0, 1):
            neighbour = cell + offset_y + offset_x
            if not 0 <= neighbour < potential.size or potential[neighbour] >= NOT_REACHED:
                all_reached = False
            elif potential[neighbour] < potential[lowest]:
                lowest = neighbour
    return lowest, all_reached


@njit(cache=True, nogil=True)
def _nearest(cell, dx, dy, size_x, size):
    """The cell nearest to the point, halves rounded away from zero."""
    step_x = int(math.copysign(math.floor(abs(dx) + 0.5), dx))
    step_y = int(math.copysign(math.floor(abs(dy) + 0.5), dy))
    return max(0, min(size - 1, cell + step_x + size_x * step_y))


@njit(cache=True, nogil=True)
def _carry(cell, offset, stride):
    """Move whole cells of an offset into the cell index."""
    if offset > 1.0:
        cell, offset = cell + stride, np.float32(offset - 1.0)
    if offset < -1.0:
        cell, offset = cell - stride, np.float32(offset + 1.0)
    return cell, offset


@njit(cache=True, nogil=True)
def descend(potential, size_x, start, source, path):
    """Follow the potential down from ``start`` in half-cell steps into ``path``.

    ``path`` is float32[n, 2], cells (x, y). Returns the number of points
    written and whether the source was reached.
    """
    cell, dx, dy = start, np.float32(0.0), np.float32(0.0)
    for k in range(path.shape[0]):
        if potential[_nearest(cell, dx, dy, size_x, potential.size)] < NEUTRAL:
            path[k, 0], path[k, 1] = source % size_x, source // size_x
            return k + 1, True
        if cell < size_x or cell > potential.size - size_x:
            return k, False
        path[k, 0], path[k, 1] = cell % size_x + dx, cell // size_x + dy
        oscillates = k > 1 and path[k, 0] == path[k - 2, 0] and path[k, 1] == path[k - 2, 1]
        lowest, all_reached = _lowest_around(potential, size_x, cell)
        if oscillates or not all_reached:
            cell, dx, dy = lowest, np.float32(0.0), np.float32(0.0)
            if potential[cell] >= NOT_REACHED:
                return k + 1, False
            continue
        gx, gy = _interpolated_gradient(potential, size_x, cell, dx, dy)
        if gx == 0.0 and gy == 0.0:
            return k + 1, False
        scale = np.float32(_STEP_CELLS / math.hypot(gx, gy))
        cell, dx = _carry(cell, np.float32(dx + gx * scale), 1)
        cell, dy = _carry(cell, np.float32(dy + gy * scale), size_x)
    return path.shape[0], False
