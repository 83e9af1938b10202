"""Scans to points, and points from frame to frame, in float32.

``costmap/projection.py`` has the reasons.
"""

from __future__ import annotations

from typing import Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.kernels.jit import njit


@njit(cache=True, nogil=True)
def project_ranges(
    ranges: NDArray[np.float32],
    directions: NDArray[np.float64],
    range_min: np.float32,
    range_max: np.float32,
    inf_range: np.float32,
) -> NDArray[np.float32]:
    """Convert ranges in [range_min, range_max) to points, in order.

    Args:
        ranges: float32[n], metres.
        directions: float64[n, 2], cosine and sine of each beam.
        range_min: float32, metres.
        range_max: float32, metres.
        inf_range: float32, replaces +inf.

    Returns:
        float32[m, 3], metres in the sensor's frame.
    """
    points = np.zeros((len(ranges), 3), np.float32)
    m = 0
    for k in range(len(ranges)):
        beam = inf_range if ranges[k] == np.inf else ranges[k]
        if range_min <= beam < range_max:
            points[m, 0] = np.float64(beam) * directions[k, 0]
            points[m, 1] = np.float64(beam) * directions[k, 1]
            m += 1
    return points[:m]


@njit(cache=True, nogil=True)
def _rotation(x: np.float32, y: np.float32, z: np.float32, w: np.float32) -> NDArray[np.float32]:
    """Return the rotation matrix, float32[3, 3], every step rounded to float32."""
    one, two = np.float32(1.0), np.float32(2.0)
    tx, ty, tz = two * x, two * y, two * z
    rotation = np.empty((3, 3), np.float32)
    rotation[0, 0] = one - (ty * y + tz * z)
    rotation[0, 1] = ty * x - tz * w
    rotation[0, 2] = tz * x + ty * w
    rotation[1, 0] = ty * x + tz * w
    rotation[1, 1] = one - (tx * x + tz * z)
    rotation[1, 2] = tz * y - tx * w
    rotation[2, 0] = tz * x - ty * w
    rotation[2, 1] = tz * y + tx * w
    rotation[2, 2] = one - (tx * x + ty * y)
    return rotation


@njit(cache=True, nogil=True)
def transform_between_heights(
    points: NDArray[np.float32],
    quaternion: Tuple[float, float, float, float],
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
    rotation = _rotation(
        np.float32(quaternion[0]),
        np.float32(quaternion[1]),
        np.float32(quaternion[2]),
        np.float32(quaternion[3]),
    )
    tx, ty, tz = translation
    shift = (np.float32(tx), np.float32(ty), np.float32(tz))
    moved = np.empty_like(points)
    m = 0
    for k in range(len(points)):
        x, y, z = points[k, 0], points[k, 1], points[k, 2]
        for row in range(3):
            moved[m, row] = (
                rotation[row, 0] * x + rotation[row, 1] * y + rotation[row, 2] * z + shift[row]
            )
        if min_z <= np.float64(moved[m, 2]) <= max_z:
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
        x, y = np.float64(points[k, 0]), np.float64(points[k, 1])
        outside = True
        for c in range(len(circles)):
            dx, dy, radius = x - circles[c, 0], y - circles[c, 1], circles[c, 2]
            if dx * dx + dy * dy <= radius * radius:
                outside = False
                break
        if outside:
            kept[m] = points[k]
            m += 1
    return kept[:m].copy()


@njit(cache=True, nogil=True)
def project_scan(
    ranges: NDArray[np.float32],
    directions: NDArray[np.float64],
    limits: Tuple[np.float32, np.float32, np.float32],
    quaternion: Tuple[float, float, float, float],
    translation: Tuple[float, float, float],
    heights: Tuple[float, float],
    circles: NDArray[np.float64],
) -> NDArray[np.float32]:
    """Convert ranges to points in another frame, within heights and in no circle.

    Args:
        ranges: float32[n], as for ``project_ranges``.
        directions: float64[n, 2], as for ``project_ranges``.
        limits: float32, range_min, range_max and inf_range of ``project_ranges``.
        quaternion: As for ``transform_between_heights``.
        translation: As for ``transform_between_heights``.
        heights: min_z and max_z of ``transform_between_heights``.
        circles: float64[c, 3], as for ``outside_circles``.

    Returns:
        float32[m, 3], metres in the other frame, in the order of the beams.
    """
    points = project_ranges(ranges, directions, limits[0], limits[1], limits[2])
    points = transform_between_heights(points, quaternion, translation, heights[0], heights[1])
    return outside_circles(points, circles) if circles.shape[0] > 0 else points


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
