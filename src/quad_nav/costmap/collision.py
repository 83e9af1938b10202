"""Cells and costs under a footprint."""

from __future__ import annotations

import math
from typing import Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.costmap.cost_grid_kernel import CostmapView, cell_of, draw_line, fill_convex_polygon
from quad_nav.files.kernel_cache import njit
from quad_nav.grid import INSCRIBED, LETHAL, UNKNOWN

Triple = Tuple[float, float, float]

COLLIDES = -1.0
IN_UNKNOWN = -2.0
OFF_THE_MAP = -3.0


@njit(cache=True, nogil=True)
def line_cost(
    costs: NDArray[np.uint8], x0: int, y0: int, x1: int, y1: int, forbidden_from: int
) -> float:
    """Return the highest cost on a line of cells, both ends on the grid and included.

    Returns:
        The cost, or COLLIDES or IN_UNKNOWN at the first cell of at least ``forbidden_from``, or
        unknown.
    """
    length, side = abs(x1 - x0), abs(y1 - y0)
    step_x, step_y = 1 if x1 >= x0 else -1, 0
    side_x, side_y = 0, 1 if y1 >= y0 else -1
    if side > length:
        length, side = side, length
        step_x, step_y, side_x, side_y = side_x, side_y, step_x, step_y
    x, y, error = x0, y0, length // 2
    highest = 0
    for _ in range(length + 1):
        cost = int(costs[y, x])
        if cost > highest:
            if cost == UNKNOWN:
                return IN_UNKNOWN
            if cost >= forbidden_from:
                return COLLIDES
            highest = cost
        x += step_x
        y += step_y
        error += side
        if error >= length:
            error -= length
            x += side_x
            y += side_y
    return float(highest)


@njit(cache=True, nogil=True)
def footprint_cost(costmap: CostmapView, footprint: NDArray[np.float64], pose: Triple) -> float:
    """Return the highest cost under a footprint's outline at a pose.

    Args:
        costmap: The costmap.
        footprint: float64[n, 2], metres in the robot's frame. Fewer than three points stand
            for a circle: only the centre's cell counts, and inscribed cost collides.
        pose: x and y of the robot, metres, and its heading, radians, in the costmap's frame.

    Returns:
        The cost, COLLIDES or IN_UNKNOWN at the first such cell, or OFF_THE_MAP.
    """
    cell_x, cell_y = cell_of(costmap, pose[0], pose[1])
    if cell_x < 0 or cell_y < 0:
        return OFF_THE_MAP
    if footprint.shape[0] < 3:
        return line_cost(costmap.costs, cell_x, cell_y, cell_x, cell_y, INSCRIBED)
    rotation = math.cos(pose[2]), math.sin(pose[2])
    first_x, first_y = _vertex_cell(costmap, footprint, 0, pose, rotation)
    if first_x < 0 or first_y < 0:
        return OFF_THE_MAP
    from_x, from_y = first_x, first_y
    highest = 0.0
    for k in range(1, footprint.shape[0] + 1):
        to_x, to_y = first_x, first_y
        if k < footprint.shape[0]:
            to_x, to_y = _vertex_cell(costmap, footprint, k, pose, rotation)
            if to_x < 0 or to_y < 0:
                return OFF_THE_MAP
        cost = line_cost(costmap.costs, from_x, from_y, to_x, to_y, LETHAL)
        if cost < 0.0:
            return cost
        highest = max(highest, cost)
        from_x, from_y = to_x, to_y
    return highest


@njit(cache=True, nogil=True)
def _vertex_cell(
    costmap: CostmapView,
    footprint: NDArray[np.float64],
    k: int,
    pose: Triple,
    rotation: Tuple[float, float],
) -> Tuple[int, int]:
    x, y, (cos, sin) = footprint[k, 0], footprint[k, 1], rotation
    return cell_of(costmap, pose[0] + (x * cos - y * sin), pose[1] + (x * sin + y * cos))


@njit(cache=True, nogil=True)
def highest_near(
    costmap: CostmapView,
    footprint: NDArray[np.float64],
    scale: float,
    x: float,
    y: float,
    travel_m: float,
) -> NDArray[np.uint8]:
    """Return the highest cost in a square around each cell that the robot may get to.

    The square holds a footprint, float64[n, 2], times a scale; where the result is low its outline
    need not be drawn. It is built up from maxima over two, four, ... cells. Cells off the map count
    as UNKNOWN.

    Returns:
        uint8[H, W]; UNKNOWN farther than ``travel_m`` from the robot at (x, y).
    """
    size_y, size_x = costmap.costs.shape
    highest = np.full((size_y, size_x), UNKNOWN, np.uint8)
    reach_m = 0.0
    for k in range(footprint.shape[0]):
        reach_m = max(reach_m, scale * math.hypot(footprint[k, 0], footprint[k, 1]))
    reach = int(min(reach_m / costmap.resolution_m, max(size_x, size_y))) + 1
    x0, xn = _cells_within(x - costmap.origin_x_m, travel_m, costmap.resolution_m, size_x)
    y0, yn = _cells_within(y - costmap.origin_y_m, travel_m, costmap.resolution_m, size_y)
    if xn <= x0 or yn <= y0:
        return highest
    width, height = xn - x0 + 2 * reach, yn - y0 + 2 * reach
    first_x, first_y = max(x0 - reach, 0), max(y0 - reach, 0)
    end_x, end_y = min(xn + reach, size_x), min(yn + reach, size_y)
    around = np.full((height, width), UNKNOWN, np.uint8)
    around[first_y - y0 + reach : end_y - y0 + reach, first_x - x0 + reach : end_x - x0 + reach] = (
        costmap.costs[first_y:end_y, first_x:end_x]
    )
    square, taller = around.reshape(-1), np.empty(height * width, np.uint8)
    side, covered = 2 * reach + 1, 1
    while covered < side:
        # Rows run on into the next one: what is wrong then is in the columns that are left out.
        shift = min(covered, side - covered)
        _fill_higher(square, shift * width, taller)
        _fill_higher(taller, shift, square)
        covered += shift
    highest[y0:yn, x0:xn] = around[: yn - y0, : xn - x0]
    return highest


@njit(cache=True, nogil=True)
def _fill_higher(costs: NDArray[np.uint8], shift: int, higher: NDArray[np.uint8]) -> None:
    """Fill uint8[n] with the higher of each cost, uint8[n], and the one so far after it."""
    after = costs[shift:]
    for k in range(after.size):
        higher[k] = costs[k] if costs[k] > after[k] else after[k]


@njit(cache=True, nogil=True)
def _cells_within(
    centre_m: float, distance_m: float, resolution_m: float, size: int
) -> Tuple[int, int]:
    """Return the first cell of an axis within a distance of a point, and the one after the last."""
    first = max((centre_m - distance_m) / resolution_m - 1.0, 0.0)
    end = min((centre_m + distance_m) / resolution_m + 2.0, float(size))
    return (int(first), int(end)) if first < end else (0, 0)


@njit(cache=True, nogil=True)
def mark_footprint(
    costmap: CostmapView, footprint: NDArray[np.float64], pose: Triple, mask: NDArray[np.bool_]
) -> None:
    """Set the cells, bool[H, W], inside a footprint; the arguments are those of ``footprint_cost``.

    Where a vertex is off the map only the outline before it is set.
    """
    rotation = math.cos(pose[2]), math.sin(pose[2])
    vertices = np.empty((footprint.shape[0], 2), np.int64)
    for k in range(footprint.shape[0]):
        vertices[k] = _vertex_cell(costmap, footprint, k, pose, rotation)
        if vertices[k, 0] < 0 or vertices[k, 1] < 0:
            for j in range(k - 1):
                (x0, y0), (x1, y1) = vertices[j], vertices[j + 1]
                draw_line(mask.reshape(-1), mask.shape[1], x0, y0, x1, y1, np.inf, True)
            return
    fill_convex_polygon(mask, vertices, True)
