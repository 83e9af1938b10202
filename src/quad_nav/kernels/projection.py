"""Scan to points, and points from frame to frame, in float32 (see costmap/projection.py)."""

from __future__ import annotations

from typing import Tuple

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True)
def project_ranges(
    ranges: NDArray[np.float32],
    directions: NDArray[np.float64],
    range_min: np.float32,
    range_max: np.float32,
    inf_range: np.float32,
) -> NDArray[np.float32]:
    """Points float32[m, 3] of the ranges in [range_min, range_max), in order.

    ranges: float32[n]; directions: float64[n, 2], cosine and sine of each beam.
    ``inf_range`` takes the place of +inf. All numbers are float32.
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
def transform_between_heights(
    points: NDArray[np.float32],
    rotation: NDArray[np.float32],
    translation: NDArray[np.float32],
    min_z: float,
    max_z: float,
) -> NDArray[np.float32]:
    """Points float32[m, 3] in the new frame, those with min_z <= z <= max_z, in order.

    points: float32[n, 3]; rotation: float32[3, 3]; translation: float32[3]. The heights
    are float64.
    """
    moved = np.empty_like(points)
    m = 0
    for k in range(len(points)):
        x, y, z = points[k, 0], points[k, 1], points[k, 2]
        for row in range(3):
            moved[m, row] = (
                rotation[row, 0] * x
                + rotation[row, 1] * y
                + rotation[row, 2] * z
                + translation[row]
            )
        if min_z <= np.float64(moved[m, 2]) <= max_z:
            m += 1
    return moved[:m].copy()


@njit(cache=True, nogil=True)
def outside_circles(
    points: NDArray[np.float32], circles: NDArray[np.float64]
) -> NDArray[np.float32]:
    """Points float32[m, 3] that lie in none of the circles, seen from above, in order.

    circles: float64[c, 3], rows x, y, radius; what is on a circle lies in it.
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
def count_returns(
    ranges: NDArray[np.float32], range_min: np.float32, range_max: np.float32, near: np.float32
) -> Tuple[int, int]:
    """How many of float32[n] are in [range_min, range_max), and in [range_min, near)."""
    returns = nearer = 0
    for k in range(ranges.shape[0]):
        if ranges[k] >= range_min:
            returns += ranges[k] < range_max
            nearer += ranges[k] < near
    return returns, nearer
