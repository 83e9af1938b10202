"""Observations of a sensor, and what follows from each of them alone.

Mirrors ``costmap/observation.py``.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.costmap.cost_grid_kernel import CostmapView, cell_index, include
from quad_nav.costmap.obstructed_cells import sector_of
from quad_nav.files.kernel_cache import njit

_STRIDE = 16  # beams


class ObservationStack(NamedTuple):
    """Observations of one source in a ring of slots, metres in the frame of the costmap.

    The newest is in slot ``newest``, the one before it in the slot before. What follows from an
    observation alone is worked out once, by ``store_observation``, for all updates that use it.
    """

    sensors: NDArray[np.float64]  # [slots, 3], where the rays start
    ends: NDArray[np.float32]  # [slots, n, 2], points that rays lead to
    sectors: NDArray[np.int16]  # [slots, n], sectors that these rays point into
    marks: NDArray[np.float32]  # [slots, n, 2], points that mark
    counts: NDArray[np.int64]  # [slots, 2], numbers of rays and of marks
    reaches: NDArray[np.float64]  # [slots, 4], bounds of the rays without a grid; NaN if unknown
    drawn: NDArray[np.float64]  # [slots, 9], bounds of the rays in a grid, and that grid


class Ranges(NamedTuple):
    """Limits of what an observation clears and marks."""

    clear_m: float  # length to which rays are cleared
    mark_m: float  # points at this distance from the sensor, or farther, do not mark
    max_height_m: float  # points with a higher z do not mark


@njit(cache=True, nogil=True)
def store_observation(
    seen: ObservationStack,
    slot: int,
    sensor: NDArray[np.float64],
    points: NDArray[np.float32],
    ranges: Ranges,
) -> None:
    """Put points, float32[n, 3], into a slot of the ring, as rays and as marks.

    The rays start at the sensor, float64[3].
    """
    ends, sectors = seen.ends[slot], seen.sectors[slot]
    seen.sensors[slot] = sensor
    for k in range(points.shape[0]):
        ends[k, 0], ends[k, 1] = points[k, 0], points[k, 1]
        sectors[k] = sector_of(float(points[k, 0]) - sensor[0], float(points[k, 1]) - sensor[1])
    seen.counts[slot, 0] = points.shape[0]
    seen.reaches[slot], seen.drawn[slot] = np.nan, np.nan
    store_marks(seen, slot, sensor, points, ranges)


@njit(cache=True, nogil=True)
def store_marks(
    seen: ObservationStack,
    slot: int,
    sensor: NDArray[np.float64],
    points: NDArray[np.float32],
    ranges: Ranges,
) -> None:
    """Set the points of a slot that mark; the arguments are those of ``store_observation``."""
    marks, count = seen.marks[slot], 0
    for k in range(points.shape[0]):
        x, y, z = float(points[k, 0]), float(points[k, 1]), float(points[k, 2])
        dx, dy, dz = x - sensor[0], y - sensor[1], z - sensor[2]
        if z > ranges.max_height_m:
            continue
        if dx * dx + dy * dy + dz * dz < ranges.mark_m * ranges.mark_m:
            marks[count, 0], marks[count, 1] = points[k, 0], points[k, 1]
            count += 1
    seen.counts[slot, 1] = count


@njit(cache=True, nogil=True)
def clip_to_grid(
    sensor_x: float,
    sensor_y: float,
    x: float,
    y: float,
    low_x: float,
    low_y: float,
    high_x: float,
    high_y: float,
) -> Tuple[float, float]:
    """Pull the end (x, y) of a ray back along the ray to the grid's border.

    Ends beyond the high borders land 1 mm inside, so that they fall into a cell. All
    numbers are metres in the frame of the grid.
    """
    dx, dy = x - sensor_x, y - sensor_y
    if x < low_x:
        t = (low_x - sensor_x) / dx
        x, y = low_x, sensor_y + dy * t
    if y < low_y:
        t = (low_y - sensor_y) / dy
        x, y = sensor_x + dx * t, low_y
    if x > high_x:
        t = (high_x - sensor_x) / dx
        x, y = high_x - 0.001, sensor_y + dy * t
    if y > high_y:
        t = (high_y - sensor_y) / dy
        x, y = sensor_x + dx * t, high_y - 0.001
    return x, y


@njit(cache=True, nogil=True)
def include_rays(
    costmap: CostmapView,
    seen: ObservationStack,
    slot: int,
    range_m: float,
    bounds: NDArray[np.float64],
) -> None:
    """Grow bounds, float64[4], by the sensor, and by what each of its rays reaches within the grid.

    Rays are cleared to ``range_m``. Bounds of the rays in the grid are kept for later updates with
    the same grid. They are not worked out if ``bounds`` hold the whole grid already, nor, in
    another grid, if the rays lie within ``bounds``: a ray in the grid is a part of the ray without
    one, and ends in the grid. The last millimetre of a grid makes no other cell.
    """
    costs, origin_x, origin_y, resolution = costmap
    size_y, size_x = costs.shape
    high_x, high_y = origin_x + size_x * resolution, origin_y + size_y * resolution
    sensor_x, sensor_y = seen.sensors[slot, 0], seen.sensors[slot, 1]
    drawn = seen.drawn
    include(bounds, sensor_x, sensor_y)
    if (
        bounds[0] <= origin_x
        and bounds[1] <= origin_y
        and bounds[2] >= high_x - 0.001
        and bounds[3] >= high_y - 0.001
    ):
        return
    known = (
        drawn[slot, 4] == origin_x
        and drawn[slot, 5] == origin_y
        and drawn[slot, 6] == high_x
        and drawn[slot, 7] == high_y
        and drawn[slot, 8] == resolution
    )
    if not known:
        reach, again = seen.reaches[slot], not math.isnan(drawn[slot, 8])
        if again and math.isnan(reach[0]):
            _bounds_of_rays(costmap, seen, slot, range_m, False, reach)
        if (
            again
            and bounds[0] <= max(reach[0], origin_x)
            and bounds[1] <= max(reach[1], origin_y)
            and bounds[2] >= min(reach[2], high_x - 0.001)
            and bounds[3] >= min(reach[3], high_y - 0.001)
        ):
            return
        _bounds_of_rays(costmap, seen, slot, range_m, True, drawn[slot, :4])
        drawn[slot, 4], drawn[slot, 5] = origin_x, origin_y
        drawn[slot, 6], drawn[slot, 7] = high_x, high_y
        drawn[slot, 8] = resolution
    include(bounds, drawn[slot, 0], drawn[slot, 1])
    include(bounds, drawn[slot, 2], drawn[slot, 3])


@njit(cache=True, nogil=True)
def _bounds_of_rays(
    costmap: CostmapView,
    seen: ObservationStack,
    slot: int,
    range_m: float,
    in_grid: bool,
    bounds: NDArray[np.float64],
) -> None:
    """Set bounds, float64[4], to those of rays in the grid, or of rays without one."""
    costs, low_x, low_y, resolution = costmap
    size_y, size_x = costs.shape
    high_x, high_y = low_x + size_x * resolution, low_y + size_y * resolution
    x0, y0 = seen.sensors[slot, 0], seen.sensors[slot, 1]
    min_x, min_y, max_x, max_y = x0, y0, x0, y0
    square_range, near = range_m * range_m, 1.0 - 1e-9
    count = seen.counts[slot, 0]
    for first in range(_STRIDE):  # beams all around first: few later ones reach farther
        for k in range(first, count, _STRIDE):
            x, y = float(seen.ends[slot, k, 0]), float(seen.ends[slot, k, 1])
            if in_grid and not (
                low_x + resolution < x < high_x - resolution
                and low_y + resolution < y < high_y - resolution
            ):
                x, y = clip_to_grid(x0, y0, x, y, low_x, low_y, high_x, high_y)
                if (
                    cell_index(x, low_x, resolution, size_x) < 0
                    or cell_index(y, low_y, resolution, size_y) < 0
                ):
                    continue
            dx, dy = x - x0, y - y0
            square, scale = dx * dx + dy * dy, 1.0
            if square > near * square_range:
                # hypot is slow: it is left out for ends that are surely within the bounds.
                reach_x = x0 - min_x if dx < 0.0 else max_x - x0
                reach_y = y0 - min_y if dy < 0.0 else max_y - y0
                if dx * dx * square_range <= near * (
                    reach_x * reach_x * square
                ) and dy * dy * square_range <= near * (reach_y * reach_y * square):
                    continue
                length = math.hypot(dx, dy)
                scale = range_m / length if length > range_m else 1.0
            x, y = x0 + dx * scale, y0 + dy * scale
            min_x, min_y, max_x, max_y = min(min_x, x), min(min_y, y), max(max_x, x), max(max_y, y)
    bounds[0], bounds[1], bounds[2], bounds[3] = min_x, min_y, max_x, max_y
