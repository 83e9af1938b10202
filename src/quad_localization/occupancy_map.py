"""Map of amcl: free, unknown and occupied cells, and rays through them.

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

    states: NDArray[np.int8]
    frame: MapFrame
    free_places: NDArray[np.float64]

    @classmethod
    def from_occupancy(
        cls,
        occupancy: NDArray[np.int8],
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
    states: NDArray[np.int8], frame: MapFrame, x: float, y: float, angle: float, longest: float
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
