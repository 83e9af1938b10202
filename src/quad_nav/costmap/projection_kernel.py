"""Scans to points, and points from frame to frame, in float32.

``costmap/projection.py`` has the reasons.
"""

from __future__ import annotations

from typing import Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.files.kernel_cache import njit

Quaternion = Tuple[float, float, float, float]
Row = Tuple[np.float32, np.float32, np.float32]


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
def transform_between_heights(
    points: NDArray[np.float32],
    quaternion: Quaternion,
    translation: Tuple[float, float, float],
    min_z: float,
    max_z: float,
) -> NDArray[np.float32]:
    """Transform points and keep those with min_z <= z <= max_z, in order.

    Args:
        points: float32[n, 3], metres.
        quaternion: (x, y, z, w) of the rotation to the new frame, rounded to float32 here.
        translation: (x, y, z) to the new frame, metres, rounded to float32 here.
        min_z: float64, height in the new frame.
        max_z: float64, height in the new frame.

    Returns:
        float32[m, 3], metres in the new frame.
    """
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
    """Keep the points, float32[n, 3], that lie in none of the circles, seen from above.

    Args:
        points: float32[n, 3], metres.
        circles: float64[c, 3], rows x, y, radius; a point on a circle lies in it.

    Returns:
        float32[m, 3], in order.
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
def project_scan(
    ranges: NDArray[np.float32],
    directions: NDArray[np.float64],
    limits: Tuple[np.float32, np.float32, np.float32],
    quaternion: Quaternion,
    translation: Tuple[float, float, float],
    heights: Tuple[float, float],
    circles: NDArray[np.float64],
) -> NDArray[np.float32]:
    """Convert ranges to points in another frame, within heights and in no circle.

    Args:
        ranges: float32[n], metres.
        directions: float64[n, 2], cosine and sine of each beam.
        limits: float32, metres: ranges in [limits[0], limits[1]) count, and limits[2] replaces
            +inf.
        quaternion: As for ``transform_between_heights``.
        translation: As for ``transform_between_heights``.
        heights: min_z and max_z of ``transform_between_heights``.
        circles: float64[c, 3], as for ``outside_circles``.

    Returns:
        float32[m, 3], metres in the other frame, in the order of the beams.
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


@njit(cache=True, nogil=True)
def count_returns(
    ranges: NDArray[np.float32], range_min: np.float32, range_max: np.float32, near: np.float32
) -> Tuple[int, int]:
    """Count the ranges, float32[n], in [range_min, range_max) and in [range_min, near)."""
    returns = nearer = 0
    for k in range(ranges.shape[0]):
        if ranges[k] >= range_min:
            returns += ranges[k] < range_max
            nearer += ranges[k] < near
    return returns, nearer
