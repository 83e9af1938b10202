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

from quad_nav.files.kernel_cache import njit
from quad_nav.geometry import Pose3D, Scan

Quaternion = Tuple[float, float, float, float]
Row = Tuple[np.float32, np.float32, np.float32]

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
    return _project_scan(
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
    """Transform points, float32[n, 3], to frame a, and keep those within heights in frame a."""
    return _transform_between_heights(
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


@njit(cache=True, nogil=True)
def _rotation(quaternion: Quaternion) -> Tuple[Row, Row, Row]:
    """Return the rows of the rotation matrix, every step rounded to float32."""
    x, y = np.float32(quaternion[0]), np.float32(quaternion[1])
    z, w = np.float32(quaternion[2]), np.float32(quaternion[3])
    one, two = np.float32(1.0), np.float32(2.0)
    tx, ty, tz = two * x, two * y, two * z
    return (
        (one - (ty * y + tz * z), ty * x - tz * w, tz * x + ty * w),
        (ty * x + tz * w, one - (tx * x + tz * z), tz * y - tx * w),
        (tz * x - ty * w, tz * y + tx * w, one - (tx * x + ty * y)),
    )


@njit(cache=True, nogil=True)
def _shift(translation: Tuple[float, float, float]) -> Row:
    """Return a translation in float32."""
    return np.float32(translation[0]), np.float32(translation[1]), np.float32(translation[2])


@njit(cache=True, nogil=True)
def _moved(
    rotation: Tuple[Row, Row, Row], shift: Row, x: np.float32, y: np.float32, z: np.float32
) -> Row:
    """Return a point in the other frame."""
    to_x, to_y, to_z = rotation
    return (
        to_x[0] * x + to_x[1] * y + to_x[2] * z + shift[0],
        to_y[0] * x + to_y[1] * y + to_y[2] * z + shift[1],
        to_z[0] * x + to_z[1] * y + to_z[2] * z + shift[2],
    )


@njit(cache=True, nogil=True)
def _transform_between_heights(
    points: NDArray[np.float32],
    quaternion: Quaternion,
    translation: Tuple[float, float, float],
    min_z: float,
    max_z: float,
) -> NDArray[np.float32]:
    """Transform points, float32[n, 3], and keep those with min_z <= z <= max_z, in order."""
    rotation, shift = _rotation(quaternion), _shift(translation)
    moved = np.empty_like(points)
    m = 0
    for k in range(len(points)):
        x, y, z = _moved(rotation, shift, points[k, 0], points[k, 1], points[k, 2])
        if min_z <= np.float64(z) <= max_z:
            moved[m, 0], moved[m, 1], moved[m, 2] = x, y, z
            m += 1
    return moved[:m].copy()


@njit(cache=True, nogil=True)
def outside_circles(
    points: NDArray[np.float32], circles: NDArray[np.float64]
) -> NDArray[np.float32]:
    """Keep the points, float32[n, 3], that lie in no circle, float64[c, 3], seen from above.

    Rows of the circles are x, y and radius; a point on a circle lies in it.
    """
    kept = np.empty_like(points)
    m = 0
    for k in range(len(points)):
        if _is_outside(np.float64(points[k, 0]), np.float64(points[k, 1]), circles):
            kept[m] = points[k]
            m += 1
    return kept[:m].copy()


@njit(cache=True, nogil=True)
def _is_outside(x: float, y: float, circles: NDArray[np.float64]) -> bool:
    for c in range(circles.shape[0]):
        dx, dy, radius = x - circles[c, 0], y - circles[c, 1], circles[c, 2]
        if dx * dx + dy * dy <= radius * radius:
            return False
    return True


@njit(cache=True, nogil=True)
def _project_scan(
    ranges: NDArray[np.float32],
    directions: NDArray[np.float64],
    limits: Tuple[np.float32, np.float32, np.float32],
    quaternion: Quaternion,
    translation: Tuple[float, float, float],
    heights: Tuple[float, float],
    circles: NDArray[np.float64],
) -> NDArray[np.float32]:
    """Convert ranges, float32[n], to points in another frame, within heights and in no circle.

    Ranges in [limits[0], limits[1]) count, and limits[2] replaces +inf; directions are cosine and
    sine of each beam, float64[n, 2].
    """
    range_min, range_max, inf_range = limits
    rotation, shift = _rotation(quaternion), _shift(translation)
    points = np.empty((ranges.shape[0], 3), np.float32)
    zero, m = np.float32(0.0), 0
    for k in range(ranges.shape[0]):
        beam = inf_range if ranges[k] == np.inf else ranges[k]
        if not range_min <= beam < range_max:
            continue
        ahead = np.float32(np.float64(beam) * directions[k, 0])
        left = np.float32(np.float64(beam) * directions[k, 1])
        x, y, z = _moved(rotation, shift, ahead, left, zero)
        if heights[0] <= np.float64(z) <= heights[1] and _is_outside(
            np.float64(x), np.float64(y), circles
        ):
            points[m, 0], points[m, 1], points[m, 2] = x, y, z
            m += 1
    return points[:m]
