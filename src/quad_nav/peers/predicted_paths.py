"""Kernels for the paths that peers are expected to follow: positions and distances in time."""

from __future__ import annotations

import math
from typing import Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.files.kernel_cache import njit


@njit(cache=True, nogil=True)
def sample_path(
    start: NDArray[np.float64], path: NDArray[np.float64], travelled: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the points of a path after distances travelled from a start.

    The path joins at the point after the nearest one. Beyond its end every point is the end.

    Args:
        start: float64[2], metres in the frame of the path.
        path: float64[n, 2], n >= 1, metres.
        travelled: float64[k], metres.

    Returns:
        float64[k, 2], metres.
    """
    nearest, nearest2 = 0, np.inf
    for k in range(path.shape[0]):
        distance2 = (path[k, 0] - start[0]) ** 2 + (path[k, 1] - start[1]) ** 2
        if distance2 < nearest2:
            nearest, nearest2 = k, distance2
    first = min(nearest + 1, path.shape[0] - 1)
    lengths = np.empty(path.shape[0])  # of the stretch to each point
    x, y = start[0], start[1]
    for k in range(first, path.shape[0]):
        dx, dy = path[k, 0] - x, path[k, 1] - y
        lengths[k] = math.sqrt(dx * dx + dy * dy)
        x, y = path[k, 0], path[k, 1]
    points = np.empty((travelled.shape[0], 2))
    for i in range(travelled.shape[0]):
        left = travelled[i]
        x, y = start[0], start[1]
        for k in range(first, path.shape[0]):
            if left < lengths[k]:
                x += (path[k, 0] - x) * (left / lengths[k])
                y += (path[k, 1] - y) * (left / lengths[k])
                break
            left -= lengths[k]
            x, y = path[k, 0], path[k, 1]
        points[i, 0], points[i, 1] = x, y
    return points


@njit(cache=True, nogil=True)
def nearest_in_time(
    one: NDArray[np.float64], other: NDArray[np.float64], steps_apart: int
) -> float:
    """Return the least distance of two tracks at about the same time.

    Args:
        one: float64[k, 2], metres, positions at equal steps of time.
        other: float64[k, 2], positions at the same times.
        steps_apart: Most steps between two positions that count.
    """
    nearest_m = np.inf
    for i in range(one.shape[0]):
        for j in range(max(0, i - steps_apart), min(other.shape[0], i + steps_apart + 1)):
            distance_m = math.hypot(one[i, 0] - other[j, 0], one[i, 1] - other[j, 1])
            nearest_m = min(nearest_m, distance_m)
    return nearest_m


@njit(cache=True, nogil=True)
def reached_in_time(
    path: NDArray[np.float64],
    times: NDArray[np.float64],
    robot: Tuple[float, float],
    radius: float,
    speed: float,
    tolerance: float,
) -> NDArray[np.float64]:
    """Return the positions of a peer that a robot can reach until the peer has passed them.

    Args:
        path: float64[k, 2], metres.
        times: float64[k], seconds from now at which the peer is there.
        robot: Position of the robot.
        radius: Distance within which the robot is at a position.
        speed: Speed of the robot.
        tolerance: Seconds after which the peer has passed.

    Returns:
        float64[m, 2], in the order of the path.
    """
    reached, m = np.empty_like(path), 0
    for k in range(path.shape[0]):
        away = math.hypot(path[k, 0] - robot[0], path[k, 1] - robot[1]) - radius
        if away <= speed * (times[k] + tolerance):
            reached[m, 0], reached[m, 1] = path[k, 0], path[k, 1]
            m += 1
    return reached[:m]
