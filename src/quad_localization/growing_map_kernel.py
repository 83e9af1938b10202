"""Occupancy of a growing map: scans are inserted, and poses fitted to what is there.

The map holds log-odds, float32[H, W]; 0 is unknown. All points are float64[n, 2] in metres.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.files.kernel_cache import njit

HIT, MISS = np.float32(math.log(0.9 / 0.1)), np.float32(math.log(0.4 / 0.6))
"""Log-odds of a beam's end and of a cell that it passes: the values of Hector SLAM."""
MAX_LOG_ODDS = np.float32(5.0)
"""Limit, so that a cell that was seen many times still changes within some scans, as when a person
walks on."""


class MapView(NamedTuple):
    """A map as kernels take it."""

    log_odds: NDArray[np.float32]  # [H, W], row 0 at the lower border
    origin_x_m: float  # corner of cell (0, 0) in `map`
    origin_y_m: float
    resolution_m: float


@njit(cache=True, nogil=True)
def insert(
    view: MapView, sensor: NDArray[np.float64], points: NDArray[np.float64], seen: Any
) -> None:
    """Insert the ends of beams, and the free cells between them and the sensor; all in `map`.

    A scan changes each cell once, and its hits come before its misses.

    Args:
        view: The map, changed in place; it holds the sensor and the points.
        sensor: float64[2], where the beams start.
        points: The ends.
        seen: bool[H, W], False, and False again at the end.
    """
    log_odds = view.log_odds
    x0, y0 = _cell(view, sensor[0], sensor[1])
    for k in range(points.shape[0]):
        x, y = _cell(view, points[k, 0], points[k, 1])
        if not seen[y, x]:
            seen[y, x] = True
            log_odds[y, x] = min(log_odds[y, x] + HIT, MAX_LOG_ODDS)
    for k in range(points.shape[0]):
        x, y = _cell(view, points[k, 0], points[k, 1])
        _visit(log_odds, seen, x0, y0, x, y, True)
    for k in range(points.shape[0]):
        x, y = _cell(view, points[k, 0], points[k, 1])
        seen[y, x] = False
        _visit(log_odds, seen, x0, y0, x, y, False)


@njit(cache=True, nogil=True)
def _cell(view: MapView, x: float, y: float) -> Tuple[int, int]:
    return (
        int(math.floor((x - view.origin_x_m) / view.resolution_m)),
        int(math.floor((y - view.origin_y_m) / view.resolution_m)),
    )


@njit(cache=True, nogil=True)
def _visit(
    log_odds: NDArray[np.float32], seen: Any, x0: int, y0: int, x1: int, y1: int, marks: bool
) -> None:
    """Mark the cells of a line as seen and free, or forget that they are seen; without its end."""
    dx, dy = abs(x1 - x0), abs(y1 - y0)
    step_x, step_y = 1 if x1 > x0 else -1, 1 if y1 > y0 else -1
    error, x, y = dx - dy, x0, y0
    while x != x1 or y != y1:
        if not marks:
            seen[y, x] = False
        elif not seen[y, x]:
            seen[y, x] = True
            log_odds[y, x] = max(log_odds[y, x] + MISS, -MAX_LOG_ODDS)
        twice = 2 * error
        if twice > -dy:
            error -= dy
            x += step_x
        if twice < dx:
            error += dx
            y += step_y


@njit(cache=True, nogil=True)
def _occupancy_at(view: MapView, x: float, y: float) -> Tuple[float, float, float, bool]:
    """Return the occupancy, its gradient per metre, and whether it is known.

    Bilinear between the centres of cells: Kohlbrecher 2011, equations 4 to 6.
    """
    log_odds = view.log_odds
    height, width = log_odds.shape
    column = (x - view.origin_x_m) / view.resolution_m - 0.5
    row = (y - view.origin_y_m) / view.resolution_m - 0.5
    x0, y0 = int(math.floor(column)), int(math.floor(row))
    if not (0 <= x0 < width - 1 and 0 <= y0 < height - 1):
        return 0.5, 0.0, 0.0, False
    known = False
    corners = np.empty(4)
    for k in range(4):
        value = log_odds[y0 + k // 2, x0 + k % 2]
        known = known or value != 0.0
        corners[k] = 1.0 / (1.0 + math.exp(-value))
    u, v = column - x0, row - y0
    low = (1.0 - u) * corners[0] + u * corners[1]
    high = (1.0 - u) * corners[2] + u * corners[3]
    slope_x = (1.0 - v) * (corners[1] - corners[0]) + v * (corners[3] - corners[2])
    value = (1.0 - v) * low + v * high
    return value, slope_x / view.resolution_m, (high - low) / view.resolution_m, known


@njit(cache=True, nogil=True)
def normal_equations(
    view: MapView, pose: NDArray[np.float64], points: NDArray[np.float64]
) -> Tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return H float64[3, 3] and b float64[3] of a Gauss-Newton step towards full occupancy.

    Kohlbrecher 2011, equations 10 to 14.

    Args:
        view: The map.
        pose: float64[3], (x_m, y_m, yaw_rad) of the sensor's frame in `map`.
        points: Ends of beams in that frame.
    """
    hessian, gradient, jacobian = np.zeros((3, 3)), np.zeros(3), np.empty(3)
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    for k in range(points.shape[0]):
        turned_x = cos * points[k, 0] - sin * points[k, 1]
        turned_y = sin * points[k, 0] + cos * points[k, 1]
        value, slope_x, slope_y, known = _occupancy_at(view, pose[0] + turned_x, pose[1] + turned_y)
        if not known:
            continue
        jacobian[0], jacobian[1] = slope_x, slope_y
        jacobian[2] = slope_y * turned_x - slope_x * turned_y
        for i in range(3):
            gradient[i] += jacobian[i] * (1.0 - value)
            for j in range(3):
                hessian[i, j] += jacobian[i] * jacobian[j]
    return hessian, gradient


@njit(cache=True, nogil=True)
def fit(
    view: MapView, pose: NDArray[np.float64], points: NDArray[np.float64]
) -> Tuple[float, float]:
    """Return the mean occupancy at the ends of beams where it is known, and the known share."""
    total, known_ends = 0.0, 0
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    for k in range(points.shape[0]):
        x = pose[0] + cos * points[k, 0] - sin * points[k, 1]
        y = pose[1] + sin * points[k, 0] + cos * points[k, 1]
        value, _, _, known = _occupancy_at(view, x, y)
        if known:
            total += value
            known_ends += 1
    return (total / known_ends if known_ends else 0.0), known_ends / max(points.shape[0], 1)


@njit(cache=True, nogil=True)
def search(view: MapView, poses: NDArray[np.float64], points: NDArray[np.float64]) -> int:
    """Return the number of the pose, of float64[m, 3], with the greatest sum of occupancies."""
    best, best_sum = 0, -1.0
    for number in range(poses.shape[0]):
        mean, share = fit(view, poses[number], points)
        if mean * share > best_sum:
            best, best_sum = number, mean * share
    return best
