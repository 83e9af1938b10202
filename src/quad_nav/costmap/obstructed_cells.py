"""Cells that rays have yet to clear, and the directions of the lines that may pass them.

A line through nothing but free cells changes nothing. ``raytrace`` skips lines by the sector
that they point into.
"""

from __future__ import annotations

import math
from typing import Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.files.kernel_cache import njit
from quad_nav.grid import FREE

SECTORS = 1024
MAX_OBSTRUCTED = 512  # cells that are worth looking for lines towards them
_PART = 64  # cells of a row that are searched at once


@njit(cache=True, nogil=True)
def sector_of(dx: float, dy: float) -> int:
    """Return the number of the sector, counterclockwise from +x, that a direction points into.

    Sectors are equal steps along the sides of a square that stands on its corner, which
    needs no arc tangent.
    """
    around = abs(dx) + abs(dy)
    if not 0.0 < around < np.inf:
        return 0
    along = dy / around if dx >= 0.0 else 2.0 - dy / around
    if along < 0.0:
        along += 4.0
    return min(int(along * (SECTORS / 4)), SECTORS - 1)


@njit(cache=True, nogil=True)
def find_obstructed(
    costs: NDArray[np.uint8], window: Tuple[int, int, int, int], obstructed: NDArray[np.int64]
) -> int:
    """Find the cells of a window (x0, xn, y0, yn) of costs, uint8[H, W], that are not free.

    Their flat indices fill int64[m].

    Returns:
        The number of such cells; m + 1 if there are more than m.
    """
    x0, xn, y0, yn = window
    size_x = costs.shape[1]
    count = 0
    for y in range(y0, yn):
        for begin in range(x0, xn, _PART):
            part = costs[y, begin : min(begin + _PART, xn)]
            any_cost = np.uint8(0)
            for x in range(part.size):  # a loop that the compiler makes vectors of
                any_cost |= part[x]
            if any_cost == FREE:
                continue
            for x in range(part.size):
                if part[x] != FREE:
                    if count == obstructed.size:
                        return count + 1
                    obstructed[count] = y * size_x + begin + x
                    count += 1
    return count


@njit(cache=True, nogil=True)
def find_sectors(
    obstructed: NDArray[np.int64],
    size_x: int,
    sensor_x: float,
    sensor_y: float,
    sectors: NDArray[np.bool_],
) -> None:
    """Make True, in bool[SECTORS], the sectors of lines from a sensor that may pass a cell.

    The cells are flat indices, int64[m]; the sensor is in cells, from the grid's corner. A
    line's cells are within sqrt(1/2) + 1/2 of the ray: half a cell for each rounding of its
    ends and of the line.
    """
    sectors[:] = False
    for k in range(obstructed.size):
        dx = obstructed[k] % size_x + 0.5 - sensor_x
        dy = obstructed[k] // size_x + 0.5 - sensor_y
        distance = math.sqrt(dx * dx + dy * dy)
        if distance < 2.5:
            sectors[:] = True
            return
        aside_x, aside_y = 1.5 * dy / distance, -1.5 * dx / distance
        sector = sector_of(dx + aside_x, dy + aside_y)
        last = sector_of(dx - aside_x, dy - aside_y)
        sectors[sector] = True
        while sector != last:
            sector = (sector + 1) % SECTORS
            sectors[sector] = True


@njit(cache=True, nogil=True)
def keep_obstructed(
    flat_costs: NDArray[np.uint8], obstructed: NDArray[np.int64], count: int
) -> int:
    """Move the cells that are still not free to the front; return their number."""
    kept = 0
    for k in range(count):
        if flat_costs[obstructed[k]] != FREE:
            obstructed[kept] = obstructed[k]
            kept += 1
    return kept
