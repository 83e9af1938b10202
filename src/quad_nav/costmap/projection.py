"""From a scan to points in the global frame, in float32 as laser_geometry and tf2 do.

Costs depend on the cell a point falls into, so the arithmetic is the same to the last bit:
beam angles and products in float64, points rounded to float32, and the transform
((r0 x + r1 y) + r2 z) + t in float32 with the rotation matrix made in float32.
"""
from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from quad_nav.geometry import Pose3D, Quaternion, Scan


def scan_points(scan: Scan, inf_is_valid: bool) -> np.ndarray:
    """float32[m, 3] in the sensor's frame, in the order of the beams.

    A beam counts when ``range_min_m <= range < range_max_m``. With ``inf_is_valid`` a beam
    without return counts as ending 0.1 mm before ``range_max_m``.
    """
    range_max = np.float32(scan.range_max_m)
    ranges = np.asarray(scan.ranges_m, dtype=np.float32)
    if inf_is_valid:
        ranges = np.where(np.isposinf(ranges), range_max - np.float32(0.0001), ranges)
    directions = _directions(float(np.float32(scan.angle_min_rad)),
                             float(np.float32(scan.angle_increment_rad)), len(ranges))
    valid = (ranges >= np.float32(scan.range_min_m)) & (ranges < range_max)
    points = np.zeros((int(valid.sum()), 3), dtype=np.float32)
    points[:, :2] = ranges[valid, None].astype(np.float64) * directions[valid]
    return points


def transform_points(points: np.ndarray, a_from_b: Pose3D) -> np.ndarray:
    """float32[n, 3] of frame b in frame a."""
    rotation = _rotation_float32(a_from_b.quaternion)
    translation = np.array([a_from_b.x_m, a_from_b.y_m, a_from_b.z_m], dtype=np.float32)
    x, y, z = np.asarray(points, dtype=np.float32).T
    return np.column_stack([((row[0] * x + row[1] * y) + row[2] * z) + t
                            for row, t in zip(rotation, translation)])


@lru_cache(maxsize=64)
def _directions(angle_min_rad: float, angle_increment_rad: float, n: int) -> np.ndarray:
    """float64[n, 2]: cosine and sine of each beam; Python's are the C library's."""
    angles = [angle_min_rad + k * angle_increment_rad for k in range(n)]
    return np.array([(math.cos(a), math.sin(a)) for a in angles]).reshape(n, 2)


def _rotation_float32(quaternion: Quaternion) -> np.ndarray:
    """float32[3, 3], every step rounded to float32."""
    x, y, z, w = np.array(quaternion, dtype=np.float32)
    two, one = np.float32(2.0), np.float32(1.0)
    tx, ty, tz = two * x, two * y, two * z
    return np.array([
        [one - (ty * y + tz * z), ty * x - tz * w, tz * x + ty * w],
        [ty * x + tz * w, one - (tx * x + tz * z), tz * y - tx * w],
        [tz * x - ty * w, tz * y + tx * w, one - (tx * x + ty * y)]], dtype=np.float32)
