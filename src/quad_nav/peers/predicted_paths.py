"""Peers: points along paths, discs on a grid, and the nearest cell outside of them.

Mirrors ``peers/`` and ``costmap/peer_layer.py``.
"""

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


@njit(cache=True, nogil=True)
def raise_discs(
    cells: NDArray[np.uint8],
    origin_x_m: float,
    origin_y_m: float,
    resolution_m: float,
    centres: NDArray[np.float64],
    radius_m: float,
    value: int,
) -> None:
    """Raise the cells whose centres lie in discs; cells that are higher stay.

    Args:
        cells: uint8[H, W], changed in place.
        origin_x_m: Corner of cell (0, 0) in the grid's frame.
        origin_y_m: Corner of cell (0, 0) in the grid's frame.
        resolution_m: Size of a cell.
        centres: float64[n, 2], metres in the grid's frame.
        radius_m: Radius of the discs.
        value: What the cells are raised to.
    """
    size_y, size_x = cells.shape
    firsts, ends = np.zeros(size_y, np.int64), np.zeros(size_y, np.int64)  # raised in each row
    for k in range(centres.shape[0]):
        x = (centres[k, 0] - origin_x_m) / resolution_m - 0.5
        y = (centres[k, 1] - origin_y_m) / resolution_m - 0.5
        reach = radius_m / resolution_m
        for row in range(max(0, math.ceil(y - reach)), min(size_y - 1, math.floor(y + reach)) + 1):
            half = math.sqrt(max(reach * reach - (row - y) * (row - y), 0.0))
            begin = max(0, math.ceil(x - half))
            end = min(size_x - 1, math.floor(x + half)) + 1
            for column in range(begin, min(end, firsts[row])):
                cells[row, column] = max(cells[row, column], np.uint8(value))
            for column in range(max(begin, ends[row]), end):
                cells[row, column] = max(cells[row, column], np.uint8(value))
            if begin <= ends[row] and firsts[row] <= end:  # the discs of a path overlap
                begin, end = min(begin, firsts[row]), max(end, ends[row])
            firsts[row], ends[row] = begin, end


@njit(cache=True, nogil=True)
def nearest_cell(
    blocked: NDArray[np.uint8], unwanted: NDArray[np.uint8], start_x: int, start_y: int
) -> Tuple[int, int]:
    """Find the nearest cell, in steps to four neighbours, that is neither blocked nor unwanted.

    Args:
        blocked: uint8[H, W], not 0 for cells that cannot be entered; the start may be one.
        unwanted: uint8[H, W], not 0 for cells that can be crossed and are no result.
        start_x: Column of the start.
        start_y: Row of the start.

    Returns:
        The cell (x, y), or (-1, -1) if there is none.
    """
    size_y, size_x = blocked.shape
    seen = np.zeros((size_y, size_x), np.bool_)
    queue = np.empty((blocked.size, 2), np.int32)
    queue[0, 0], queue[0, 1] = start_x, start_y
    seen[start_y, start_x] = True
    head, tail = 0, 1
    while head < tail:
        x, y = queue[head]
        head += 1
        if not unwanted[y, x] and not blocked[y, x]:
            return x, y
        for dx, dy in ((1, 0), (0, 1), (-1, 0), (0, -1)):
            to_x, to_y = x + dx, y + dy
            if (
                0 <= to_x < size_x
                and 0 <= to_y < size_y
                and not seen[to_y, to_x]
                and not blocked[to_y, to_x]
            ):
                seen[to_y, to_x] = True
                queue[tail, 0], queue[tail, 1] = to_x, to_y
                tail += 1
    return -1, -1
