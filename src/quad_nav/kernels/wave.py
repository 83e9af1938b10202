"""Loops of a wavefront that spreads a potential over a grid.

Grids are flat arrays, cell = y * size_x + x; the outermost ring of cells must
be obstacles, which keeps every neighbour inside. The maths is in
``plan/navfn.py``. All sums are float32 in the order that the recorded
potentials demand.
"""
from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

NOT_REACHED = np.float32(1e10)
BUCKET_SIZE = 10000       # cells that one bucket holds; further ones are dropped
CURRENT, AHEAD, LATER = 0, 1, 2

_INVERSE_SQRT2 = 0.707106781


class Wave(NamedTuple):
    """The state of a wavefront, changed in place."""

    costs: np.ndarray      # uint8[n] or float32[n], at most ``obstacle``
    potential: np.ndarray  # float32[n]
    pending: np.ndarray    # bool[n], cell is in a bucket
    buckets: np.ndarray    # int64[3, BUCKET_SIZE], cells to be visited
    counts: np.ndarray     # int64[3]
    size_x: int
    obstacle: int          # cells of this cost are never entered
    neutral: int           # cost of a free cell
    planar: bool           # potentials of a planar wave; else of the lowest neighbour


@njit(cache=True, nogil=True)
def _push(wave, bucket, cell):
    if (0 <= cell < wave.costs.size and not wave.pending[cell]
            and wave.costs[cell] < wave.obstacle and wave.counts[bucket] < BUCKET_SIZE):
        wave.buckets[bucket, wave.counts[bucket]] = cell
        wave.counts[bucket] += 1
        wave.pending[cell] = True


@njit(cache=True, nogil=True)
def planar_arrival(potential, size_x, cell, cost):
    """Potential of a planar wave that arrives over the two lower neighbours.

    ``cost`` is a float32.
    """
    horizontal = min(potential[cell - 1], potential[cell + 1])
    vertical = min(potential[cell - size_x], potential[cell + size_x])
    lower = min(horizontal, vertical)
    gap = np.float32(abs(horizontal - vertical))
    if gap >= cost:
        return np.float32(lower + cost)
    ratio = np.float64(np.float32(gap / cost))
    factor = np.float32(-0.2301 * ratio * ratio + 0.5307 * ratio + 0.7040)
    return np.float32(lower + np.float32(cost * factor))


@njit(cache=True, nogil=True)
def lowest_arrival(potential, size_x, cell, cost):
    """Potential of a step from the lowest of the four neighbours."""
    lowest = min(min(potential[cell - 1], potential[cell + 1]),
                 min(potential[cell - size_x], potential[cell + size_x]))
    return np.float32(lowest + cost)


@njit(cache=True, nogil=True)
def arrival(potential, size_x, cell, cost, planar):
    """Potential of a wave at a cell; ``cost`` is a float32."""
    if planar:
        return planar_arrival(potential, size_x, cell, cost)
    return lowest_arrival(potential, size_x, cell, cost)


@njit(cache=True, nogil=True)
def _visit(wave, cell, target, heuristic, threshold):
    """Lower one cell's potential; hand on the neighbours that may profit."""
    if wave.costs[cell] >= wave.obstacle:
        return
    # Potentials are made of whole costs, while the comparison below is of exact ones.
    here = arrival(wave.potential, wave.size_x, cell, np.float32(int(wave.costs[cell])),
                   wave.planar)
    if here >= wave.potential[cell]:
        return
    wave.potential[cell] = here
    priority = here
    if heuristic:
        priority = np.float32(here + _distance_cost(wave, cell, target))
    bucket = AHEAD if priority < threshold else LATER
    for offset in (-1, 1, -wave.size_x, wave.size_x):
        neighbour = cell + offset
        crossing = np.float32(_INVERSE_SQRT2 * np.float64(wave.costs[neighbour]))
        if wave.potential[neighbour] > np.float32(priority + crossing):
            _push(wave, bucket, neighbour)


@njit(cache=True, nogil=True)
def _distance_cost(wave, cell, other):
    return np.float32(math.hypot(cell % wave.size_x - other % wave.size_x,
                                 cell // wave.size_x - other // wave.size_x) * wave.neutral)


@njit(cache=True, nogil=True)
def _refill(wave, bucket):
    """Empty a bucket into the current one."""
    count = wave.counts[bucket]
    wave.buckets[CURRENT, :count] = wave.buckets[bucket, :count]
    wave.counts[CURRENT], wave.counts[bucket] = count, 0


@njit(cache=True, nogil=True)
def start_at_cell(wave, source):
    """The wave begins with 0 in one cell."""
    wave.potential[source] = 0.0
    for offset in (1, -1, -wave.size_x, wave.size_x):
        _push(wave, CURRENT, source + offset)


@njit(cache=True, nogil=True)
def start_between_cells(wave, source, dx, dy):
    """The wave begins at a point ``dx``, ``dy`` cells right of and above a cell's centre.

    Both are float32. The four cells around the point share the cost of two free
    cells by the areas opposite to them.
    """
    size_x, twice, one = wave.size_x, np.float32(2 * wave.neutral), np.float32(1.0)
    _seed(wave, source, twice * dx * dy)
    _seed(wave, source + 1, twice * (one - dx) * dy)
    _seed(wave, source + size_x, twice * dx * (one - dy))
    _seed(wave, source + size_x + 1, twice * (one - dx) * (one - dy))
    for offset in (2, -1, size_x - 1, size_x + 2, -size_x, 1 - size_x, 2 * size_x, 2 * size_x + 1):
        _push(wave, CURRENT, source + offset)


@njit(cache=True, nogil=True)
def _seed(wave, cell, potential):
    if 0 <= cell < wave.potential.size:
        wave.potential[cell] = potential


@njit(cache=True, nogil=True)
def propagate(wave, source, target, max_fronts, stop_at_target, heuristic):
    """Spread a potential that has begun at ``source``, at most ``max_fronts`` fronts.

    Stops early when nothing is left, or, with ``stop_at_target``, when the
    target cell has a potential; returns whether it stopped for that.
    ``heuristic`` makes it A*.
    """
    threshold = np.float32(wave.obstacle)
    if heuristic:
        threshold = np.float32(threshold + _distance_cost(wave, source, target))
    for _ in range(max_fronts):
        if wave.counts[CURRENT] == 0 and wave.counts[AHEAD] == 0:
            break
        for k in range(wave.counts[CURRENT]):
            wave.pending[wave.buckets[CURRENT, k]] = False
        for k in range(wave.counts[CURRENT]):
            _visit(wave, wave.buckets[CURRENT, k], target, heuristic, threshold)
        _refill(wave, AHEAD)
        if wave.counts[CURRENT] == 0:
            threshold = np.float32(threshold + np.float32(2 * wave.neutral))
            _refill(wave, LATER)
        if stop_at_target and wave.potential[target] < NOT_REACHED:
            return True
    return False
