"""Map of amcl: free, unknown and occupied cells, rays through them, and distances to obstacles.

In upstream, cell (i, j) is centred on ``origin + (i, j) * resolution``, so that every pose is half
a cell beside the costmaps, where that point is the cell's lower left corner. Here it is that
corner.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.files.kernel_cache import njit

Floats = NDArray[np.float64]
Cells = NDArray[np.int8]

FREE, UNKNOWN, OCCUPIED = -1, 0, 1
_LONGEST_RAY_CELLS = 1e7  # farther than any map reaches; keeps an infinite range in whole numbers


class MapFrame(NamedTuple):
    """Columns, rows, size of a cell and centre of cell ``(size_x // 2, size_y // 2)``, metres."""

    size_x: int
    size_y: int
    resolution: float
    centre_x: float
    centre_y: float


@dataclass(frozen=True)
class OccupancyMap:
    """An occupancy grid as amcl sees it.

    Attributes:
        states: int8[y, x], ``FREE``, ``UNKNOWN`` or ``OCCUPIED``.
        frame: Its place.
        free_places: float64[n, 2], centres of the free cells, column by column.
    """

    states: Cells
    frame: MapFrame
    free_places: Floats

    @classmethod
    def from_occupancy(
        cls,
        occupancy: Cells,
        resolution_m: float,
        origin_x_m: float,
        origin_y_m: float,
        upstream: bool = False,
    ) -> OccupancyMap:
        """Read the data of a ``nav_msgs/OccupancyGrid``: 0 is free, 100 occupied, all else unknown.

        The orientation of the origin is not supported, as in upstream.
        """
        size_y, size_x = occupancy.shape
        half_x, half_y = size_x // 2, size_y // 2
        first_m = 0.0 if upstream else 0.5 * resolution_m  # the centre of cell (0, 0)
        centre_x = origin_x_m + first_m + half_x * resolution_m
        centre_y = origin_y_m + first_m + half_y * resolution_m
        states = np.full(occupancy.shape, UNKNOWN, np.int8)
        states[occupancy == 0], states[occupancy == 100] = FREE, OCCUPIED
        columns, rows = np.nonzero(states.T == FREE)
        cells = np.column_stack((columns - half_x, rows - half_y))
        frame = MapFrame(size_x, size_y, float(resolution_m), float(centre_x), float(centre_y))
        return cls(states, frame, np.array((centre_x, centre_y)) + cells * resolution_m)


@njit(cache=True, nogil=True)
def cell_of(frame: MapFrame, x: float, y: float) -> Tuple[float, float]:
    """Return column and row of a point, whole numbers that may lie outside the map, or NaN."""
    column = np.floor((x - frame.centre_x) / frame.resolution + 0.5) + frame.size_x // 2
    return column, np.floor((y - frame.centre_y) / frame.resolution + 0.5) + frame.size_y // 2


@njit(cache=True, nogil=True)
def is_inside(frame: MapFrame, column: float, row: float) -> bool:
    """Tell whether a cell is in the map."""
    return 0 <= column < frame.size_x and 0 <= row < frame.size_y


@njit(cache=True, nogil=True)
def ray_range(
    states: Cells, frame: MapFrame, x: float, y: float, angle: float, longest: float
) -> float:
    """Return the distance to the first cell on a ray that is not free; ``longest`` without one.

    What is outside the map is not free. The ray goes from cell to cell (Bresenham) and one cell
    beyond its end; the distance is that of the two cells.
    """
    reach = min(longest, _LONGEST_RAY_CELLS * frame.resolution)
    column, row = cell_of(frame, x, y)
    if not is_inside(frame, column, row):
        return 0.0
    x0, y0 = int(column), int(row)
    column, row = cell_of(frame, x + reach * math.cos(angle), y + reach * math.sin(angle))
    x1, y1 = int(column), int(row)
    is_steep = abs(y1 - y0) > abs(x1 - x0)
    if is_steep:
        x0, y0, x1, y1 = y0, x0, y1, x1
    step_x, step_y = 1 if x0 < x1 else -1, 1 if y0 < y1 else -1
    delta_x, delta_y = abs(x1 - x0), abs(y1 - y0)
    at_x, at_y, error = x0, y0, 0
    while True:
        i, j = (at_y, at_x) if is_steep else (at_x, at_y)
        if not is_inside(frame, i, j) or states[j, i] != FREE:
            away_x, away_y = at_x - x0, at_y - y0
            return math.sqrt(away_x * away_x + away_y * away_y) * frame.resolution
        if at_x == x1 + step_x:
            return longest
        at_x += step_x
        error += delta_y
        if 2 * error >= delta_x:
            at_y += step_y
            error -= delta_x


def obstacle_distances(grid: OccupancyMap, max_distance_m: float) -> Floats:
    """Return the distances float64[y, x] to the nearest obstacle, in metres.

    They spread from the obstacles over four neighbours. A cell belongs to the source that reaches
    it first, so a distance can be longer than the shortest one by part of a cell, and which source
    is first among equals depends on the order of the heap: that of C++ and of Python. All cells
    that are not reached within ``int(max_distance_m / resolution)`` cells have the largest
    distance.
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
