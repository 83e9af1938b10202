"""Laser models: how well each particle explains a scan.

Each returns a factor for each weight. ``beam`` and ``likelihood_field`` do not multiply the
likelihoods p of beams: their factor is 1 + sum(p^3). ``likelihood_field_prob`` multiplies them.

Source: S. Thrun, W. Burgard, D. Fox, "Probabilistic Robotics", 2005, sections 6.3 and 6.4; the
models as in ros-planning/navigation, amcl 1.17.3.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_localization.occupancy_map import MapFrame, column_of, is_inside, ray_range, row_of
from quad_nav.files.kernel_cache import njit

Floats = NDArray[np.float64]


class Sight(NamedTuple):
    """Beams in use.

    Attributes:
        mount_x: Place of the laser in the base, metres; its heading is in the bearings.
        mount_y: The same in y.
        ranges: float64[n], metres.
        bearings: float64[n], radians in the base.
        range_max: Largest range, metres.
    """

    mount_x: float
    mount_y: float
    ranges: Floats
    bearings: Floats
    range_max: float


class BeamMixture(NamedTuple):
    """Parts of the model ``beam``, the parameters ``laser_...``."""

    z_hit: float
    z_short: float
    z_max: float
    z_rand: float
    sigma_hit: float
    lambda_short: float


@njit(cache=True, nogil=True)
def _laser_pose(pose: Floats, sight: Sight) -> Tuple[float, float, float]:
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    x = pose[0] + sight.mount_x * cos - sight.mount_y * sin
    y = pose[1] + sight.mount_x * sin + sight.mount_y * cos
    return x, y, math.atan2(sin, cos)


@njit(cache=True, nogil=True)
def end_cells(poses: Floats, sight: Sight, frame: MapFrame) -> NDArray[np.int64]:
    """Return the cells int64[m, n] in which the beams end, seen from poses float64[m, 3].

    A cell is ``row * size_x + column``; -1 is outside the map.
    """
    cells = np.full((len(poses), len(sight.ranges)), -1)
    for m in range(len(poses)):
        x, y, yaw = _laser_pose(poses[m], sight)
        for k in range(len(sight.ranges)):
            angle = yaw + sight.bearings[k]
            column = column_of(frame, x + sight.ranges[k] * math.cos(angle))
            row = row_of(frame, y + sight.ranges[k] * math.sin(angle))
            if is_inside(frame, column, row):
                cells[m, k] = int(row) * frame.size_x + int(column)
    return cells


@njit(cache=True, nogil=True, error_model="numpy")
def ray_factors(
    poses: Floats, sight: Sight, states: NDArray[np.int8], frame: MapFrame, mixture: BeamMixture
) -> Floats:
    """Return the factors float64[m] of ``beam``, which compares ranges with those of the map.

    Args:
        poses: float64[m, 3], metres and radians in the map.
        sight: The beams.
        states: int8[y, x] of the map.
        frame: Place of the map.
        mixture: Parts of the model.
    """
    factors = np.ones(len(poses))
    for m in range(len(poses)):
        x, y, yaw = _laser_pose(poses[m], sight)
        for k in range(len(sight.ranges)):
            seen, angle = sight.ranges[k], yaw + sight.bearings[k]
            z = seen - ray_range(states, frame, x, y, angle, sight.range_max)
            p = mixture.z_hit * math.exp(-(z * z) / (2 * mixture.sigma_hit * mixture.sigma_hit))
            if z < 0:
                short = mixture.z_short * mixture.lambda_short
                p += short * math.exp(-mixture.lambda_short * seen)
            if seen == sight.range_max:
                p += mixture.z_max
            if seen < sight.range_max:
                p += mixture.z_rand / sight.range_max
            factors[m] += p * p * p
    return factors
