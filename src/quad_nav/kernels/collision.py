"""Loops over the cells that a footprint's outline covers."""
from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

LETHAL = 254
UNKNOWN = 255
COLLIDES = -1.0
IN_UNKNOWN = -2.0
OFF_THE_MAP = -3.0


class Window(NamedTuple):
    """A costmap as kernels take it."""

    costs: np.ndarray  # uint8[H, W]
    origin_x_m: float
    origin_y_m: float
    resolution_m: float


@njit(cache=True, nogil=True)
def cell_of(window, x, y):
    """(inside, cell_x, cell_y) of a world point; cells are cut towards the lower left."""
    if x < window.origin_x_m or y < window.origin_y_m:
        return False, 0, 0
    cell_x = int((x - window.origin_x_m) / window.resolution_m)
    cell_y = int((y - window.origin_y_m) / window.resolution_m)
    size_y, size_x = window.costs.shape
    return cell_x < size_x and cell_y < size_y, cell_x, cell_y


@njit(cache=True, nogil=True)
def line_cost(costs, x0, y0, x1, y1):
    """The highest cost on a Bresenham line, ends included; negative at the first obstacle."""
    dx, dy = abs(x1 - x0), abs(y1 - y0)
    step_x = 1 if x1 >= x0 else -1
    step_y = 1 if y1 >= y0 else -1
    steep = dy > dx
    length, minor = (dy, dx) if steep else (dx, dy)
    error = length // 2
    x, y = x0, y0
    highest = 0
    for _ in range(length + 1):
        cost = costs[y, x]
        if cost > highest:
            if cost == UNKNOWN:
                return IN_UNKNOWN
            if cost == LETHAL:
                return COLLIDES
            highest = cost
        error += minor
        if error >= length:
            error -= length
            x += step_x
            y += step_y
        elif steep:
            y += step_y
        else:
            x += step_x
    return float(highest)


@njit(cache=True, nogil=True)
def footprint_cost(window, footprint, x, y, theta):
    """The highest cost under a footprint's outline at a pose, or what forbids it.

    Negative where the outline meets a lethal (COLLIDES) or unknown cell
    (IN_UNKNOWN) or leaves the map (OFF_THE_MAP). Fewer than three points are a
    circle: only the centre's cell counts, and inscribed cost collides.
    """
    inside, cell_x, cell_y = cell_of(window, x, y)
    if not inside:
        return OFF_THE_MAP
    if footprint.shape[0] < 3:
        return _centre_cost(window.costs[cell_y, cell_x])
    cos_theta, sin_theta = math.cos(theta), math.sin(theta)
    last = footprint.shape[0] - 1
    first_inside, first_x, first_y = _vertex_cell(window, footprint[0], x, y, cos_theta, sin_theta)
    if not first_inside:
        return OFF_THE_MAP
    from_x, from_y = first_x, first_y
    highest = 0.0
    for k in range(1, last + 2):
        to_x, to_y = first_x, first_y
        if k <= last:
            inside, to_x, to_y = _vertex_cell(window, footprint[k], x, y, cos_theta, sin_theta)
            if not inside:
                return OFF_THE_MAP
        cost = line_cost(window.costs, from_x, from_y, to_x, to_y)
        if cost < 0.0:
            return cost
        highest = max(highest, cost)
        from_x, from_y = to_x, to_y
    return highest


@njit(cache=True, nogil=True)
def _centre_cost(cost):
    if cost == UNKNOWN:
        return IN_UNKNOWN
    if cost >= LETHAL - 1:
        return COLLIDES
    return float(cost)


@njit(cache=True, nogil=True)
def _vertex_cell(window, vertex, x, y, cos_theta, sin_theta):
    return cell_of(window, x + (vertex[0] * cos_theta - vertex[1] * sin_theta),
                   y + (vertex[0] * sin_theta + vertex[1] * cos_theta))


@njit(cache=True, nogil=True)
def mark_footprint(window, footprint, x, y, theta, mask):
    """Set the cells of a footprint's outline and inside in ``mask``, bool[H, W].

    Where a vertex is off the map, the outline stops before it and nothing is
    filled. A footprint of at most one point marks the centre's cell.
    """
    if footprint.shape[0] <= 1:
        inside, cell_x, cell_y = cell_of(window, x, y)
        if inside:
            mask[cell_y, cell_x] = True
        return
    cos_theta, sin_theta = math.cos(theta), math.sin(theta)
    count = footprint.shape[0]
    for k in range(count):
        inside, x0, y0 = _vertex_cell(window, footprint[k], x, y, cos_theta, sin_theta)
        if not inside:
            return
        inside, x1, y1 = _vertex_cell(window, footprint[(k + 1) % count], x, y,
                                      cos_theta, sin_theta)
        if not inside:
            return
        _mark_line(mask, x0, y0, x1, y1)
    _fill_columns(mask)


@njit(cache=True, nogil=True)
def _mark_line(mask, x0, y0, x1, y1):
    dx, dy = abs(x1 - x0), abs(y1 - y0)
    step_x = 1 if x1 >= x0 else -1
    step_y = 1 if y1 >= y0 else -1
    steep = dy > dx
    length, minor = (dy, dx) if steep else (dx, dy)
    error = length // 2
    x, y = x0, y0
    for _ in range(length + 1):
        mask[y, x] = True
        error += minor
        if error >= length:
            error -= length
            x += step_x
            y += step_y
        elif steep:
            y += step_y
        else:
            x += step_x


@njit(cache=True, nogil=True)
def _fill_columns(mask):
    """Between the lowest and the highest marked cell of each column."""
    size_y, size_x = mask.shape
    for x in range(size_x):
        lowest, highest = size_y, -1
        for y in range(size_y):
            if mask[y, x]:
                lowest = min(lowest, y)
                highest = y
        for y in range(lowest, highest):
            mask[y, x] = True
