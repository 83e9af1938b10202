"""Distance of each cell to the nearest obstacle, and how likely a beam ends there.

The distances spread from the obstacles over four neighbours. A cell belongs to the source that
reaches it first, so a distance can be longer than the shortest one by part of a cell, and which
source is first among equals depends on the order of the heap: that of C++ and of Python.

Source: S. Thrun, W. Burgard, D. Fox, "Probabilistic Robotics", 2005, section 6.4.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quad_localization.occupancy_map import OCCUPIED, OccupancyMap
from quad_nav.files.kernel_cache import njit

Floats = NDArray[np.float64]


class LikelihoodField(NamedTuple):
    """Values of the likelihood field models for each cell; the last value is for outside.

    Attributes:
        distances_m: float64[cells + 1], distance to the nearest obstacle; infinite outside.
        hits: float64[cells + 1], ``z_hit`` times the normal density of the distance, not
            normalised; that of the largest distance outside.
    """

    distances_m: Floats
    hits: Floats


def likelihood_field(
    grid: OccupancyMap, max_distance_m: float, z_hit: float, sigma_hit_m: float
) -> LikelihoodField:
    """Compute the field of a map."""
    distances_m = obstacle_distances(grid, max_distance_m).ravel()
    z = np.append(distances_m, max_distance_m)
    with np.errstate(divide="ignore", invalid="ignore"):
        hits = z_hit * np.exp(-(z * z) / (2 * sigma_hit_m * sigma_hit_m))
    return LikelihoodField(np.append(distances_m, math.inf), hits)


def obstacle_distances(grid: OccupancyMap, max_distance_m: float) -> Floats:
    """Return the distances float64[y, x] to the nearest obstacle, in metres.

    All cells that are not reached within ``int(max_distance_m / resolution)`` cells have the
    largest distance.
    """
    resolution_m, size_x = grid.frame.resolution, grid.frame.size_x
    distances_m = np.full(grid.states.shape, max_distance_m)
    distances_m[grid.states == OCCUPIED] = 0.0
    columns, rows = np.nonzero(grid.states.T == OCCUPIED)
    radius = int(max_distance_m / resolution_m)
    _spread(distances_m, rows * size_x + columns, radius, resolution_m)
    return distances_m


@njit(cache=True, nogil=True)
def _spread(distances: Floats, sources: NDArray[np.int64], radius: int, resolution: float) -> None:
    """Spread distances float64[y, x] from source cells within a radius in cells, in place."""
    size_y, size_x = distances.shape
    flat, source = distances.ravel(), np.full(size_x * size_y, -1)
    heap, count = np.empty(size_x * size_y, np.int64), 0
    for cell in sources:
        source[cell] = cell
        _rise(heap, count, flat, cell)
        count += 1
    while count > 0:
        cell = heap[0]
        i, j = cell % size_x, cell // size_x
        from_i, from_j = source[cell] % size_x, source[cell] // size_x
        for at_i, at_j in ((i - 1, j), (i, j - 1), (i + 1, j), (i, j + 1)):
            next_ = at_j * size_x + at_i
            if not (0 <= at_i < size_x and 0 <= at_j < size_y) or source[next_] >= 0:
                continue
            distance = math.sqrt((at_i - from_i) ** 2 + (at_j - from_j) ** 2)
            if distance <= radius:
                flat[next_], source[next_] = distance * resolution, source[cell]
                _rise(heap, count, flat, next_)
                count += 1
        count -= 1  # after its neighbours came: the order of equals depends on it
        _remove_first(heap, count, flat)


@njit(cache=True, nogil=True)
def _rise(heap: NDArray[np.int64], at: int, distances: Floats, cell: int) -> None:
    """Put a cell at a free place of a heap, the nearest first, and let it rise."""
    while at > 0 and distances[cell] < distances[heap[(at - 1) // 2]]:
        heap[at] = heap[(at - 1) // 2]
        at = (at - 1) // 2
    heap[at] = cell


@njit(cache=True, nogil=True)
def _remove_first(heap: NDArray[np.int64], left: int, distances: Floats) -> None:
    """Let the first place sink to the bottom, and the last cell rise from there."""
    at, child = 0, 1
    while child < left:
        if child + 1 < left and not distances[heap[child]] < distances[heap[child + 1]]:
            child += 1
        heap[at] = heap[child]
        at, child = child, 2 * child + 1
    _rise(heap, at, distances, heap[left])
