"""Laser models: how well each particle explains a scan.

Each returns a factor for each weight. ``beam`` and ``likelihood_field`` do not multiply the
likelihoods p of beams: their factor is 1 + sum(p^3). ``likelihood_field_prob`` multiplies them.

Source: S. Thrun, W. Burgard, D. Fox, "Probabilistic Robotics", 2005, sections 6.3 and 6.4; the
models as in ros-planning/navigation, amcl 1.17.3.
"""

from __future__ import annotations

import math
from typing import Tuple

import numpy as np
from numpy.typing import NDArray

from quad_localization.occupancy_map import MapFrame, cell_of, is_inside, ray_range
from quad_nav.files.kernel_cache import njit

Floats = NDArray[np.float64]
Whole = NDArray[np.int64]
Mixture = Tuple[float, float, float, float, float, float]


@njit(cache=True, nogil=True)
def end_cells(lasers: Floats, ranges: Floats, bearings: Floats, frame: MapFrame) -> Whole:
    """Return the cells int64[m, n] in which beams end: ``row * size_x + column``, -1 outside.

    Args:
        lasers: float64[m, 3], poses of the laser in the map, one for each particle.
        ranges: float64[n], metres.
        bearings: float64[n], radians in the base frame.
        frame: Place of the map.
    """
    cells = np.full((len(lasers), len(ranges)), -1)
    for m in range(len(lasers)):
        for k in range(len(ranges)):
            angle = lasers[m, 2] + bearings[k]
            x = lasers[m, 0] + ranges[k] * math.cos(angle)
            y = lasers[m, 1] + ranges[k] * math.sin(angle)
            column, row = cell_of(frame, x, y)
            if is_inside(frame, column, row):
                cells[m, k] = int(row) * frame.size_x + int(column)
    return cells


@njit(cache=True, nogil=True, error_model="numpy")
def ray_factors(
    lasers: Floats,
    ranges: Floats,
    bearings: Floats,
    range_max: float,
    states: NDArray[np.int8],
    frame: MapFrame,
    mixture: Mixture,
) -> Floats:
    """Return the factors float64[m] of ``beam``, which compares ranges with those of the map.

    Arguments are those of ``end_cells``, the largest range, int8[y, x] of the map, and the
    parameters ``laser_`` z_hit, z_short, z_max, z_rand, sigma_hit and lambda_short.
    """
    z_hit, z_short, z_max, z_rand, sigma_hit, lambda_short = mixture
    factors = np.ones(len(lasers))
    for m in range(len(lasers)):
        for k in range(len(ranges)):
            seen, angle = ranges[k], lasers[m, 2] + bearings[k]
            z = seen - ray_range(states, frame, lasers[m, 0], lasers[m, 1], angle, range_max)
            p = z_hit * math.exp(-(z * z) / (2 * sigma_hit * sigma_hit))
            if z < 0:
                p += z_short * lambda_short * math.exp(-lambda_short * seen)
            if seen == range_max:
                p += z_max
            if seen < range_max:
                p += z_rand / range_max
            factors[m] += p * p * p
    return factors
