"""Projection of scans into the global frame, in float32 as laser_geometry and tf2 do.

Costs depend on the cell that a point falls into, so the arithmetic is the same to the last bit:
beam angles and products in float64, points rounded to float32, and the transform
((r0 x + r1 y) + r2 z) + t in float32 with the rotation matrix made in float32.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.costmap.projection_kernel import project_scan, transform_between_heights
from quad_nav.geometry import Pose3D, Scan

_IDENTITY, _NO_CIRCLES = Pose3D(0.0, 0.0, 0.0), np.empty((0, 3))


def scan_points(
    scan: Scan,
    inf_is_valid: bool,
    a_from_sensor: Pose3D = _IDENTITY,
    heights_m: Tuple[float, float] = (-math.inf, math.inf),
    excluded_circles: NDArray[np.float64] = _NO_CIRCLES,
) -> NDArray[np.float32]:
    """Convert a scan to points in frame a.

    Args:
        scan: The scan. A beam counts when ``range_min_m <= range < range_max_m``.
        inf_is_valid: Beams without a return count as ending 0.1 mm before ``range_max_m``.
        a_from_sensor: Pose of the sensor in frame a.
        heights_m: Lowest and greatest height in frame a of points that are kept.
        excluded_circles: float64[n, 3], rows x, y, radius in frame a; points within them are
            left out.

    Returns:
        float32[m, 3], metres in frame a, in the order of the beams.
    """
    ranges = np.ascontiguousarray(scan.ranges_m, dtype=np.float32)
    beams = scan.angle_min_rad, scan.angle_increment_rad, len(ranges)
    return project_scan(
        ranges,
        _directions(*beams),
        _limits(scan.range_min_m, scan.range_max_m, inf_is_valid),
        a_from_sensor.quaternion,
        (a_from_sensor.x_m, a_from_sensor.y_m, a_from_sensor.z_m),
        heights_m,
        excluded_circles,
    )


def transform_points(
    points: NDArray[np.float32],
    a_from_b: Pose3D,
    min_z_m: float = -math.inf,
    max_z_m: float = math.inf,
) -> NDArray[np.float32]:
    """Transform points and keep those within heights.

    Args:
        points: float32[n, 3], metres in frame b.
        a_from_b: Pose of frame b in frame a.
        min_z_m: Lowest height in frame a.
        max_z_m: Greatest height in frame a.

    Returns:
        float32[m, 3], metres in frame a.
    """
    return transform_between_heights(
        np.ascontiguousarray(points, dtype=np.float32),
        a_from_b.quaternion,
        (a_from_b.x_m, a_from_b.y_m, a_from_b.z_m),
        min_z_m,
        max_z_m,
    )


@lru_cache(maxsize=64)
def _directions(angle_min_rad: float, angle_increment_rad: float, n: int) -> NDArray[np.float64]:
    """Return cosine and sine of each beam, float64[n, 2]; Python's are the C library's.

    The angles are those of a message, in float32.
    """
    first_rad = float(np.float32(angle_min_rad))
    increment_rad = float(np.float32(angle_increment_rad))
    angles = [first_rad + k * increment_rad for k in range(n)]
    return np.array([(math.cos(a), math.sin(a)) for a in angles]).reshape(n, 2)


@lru_cache(maxsize=64)
def _limits(
    range_min_m: float, range_max_m: float, inf_is_valid: bool
) -> Tuple[np.float32, np.float32, np.float32]:
    """Return the limits of ranges, and what replaces +inf."""
    range_max = np.float32(range_max_m)
    inf_range = range_max - np.float32(0.0001) if inf_is_valid else np.float32(np.inf)
    return np.float32(range_min_m), range_max, inf_range
