"""Loops of the distance grids: the plan's cells, and steps from them."""
from __future__ import annotations

import math

import numpy as np
from numba import njit

from quad_nav.grid import INSCRIBED, UNKNOWN
from quad_nav.kernels.collision import cell_of


@njit(cache=True, nogil=True)
def cells_on_plan(window, points):
    """Cells that a plan passes in its first stretch over known ground, int64[n].

    ``points`` is float64[m, 2]; gaps wider than a cell are filled by
    interpolation. Flat indices, in the plan's order, repeated where the plan is
    dense. Points before the stretch are skipped; it ends at the first point off
    the map or on an unknown cell.
    """
    resolution = window.resolution_m
    steps = np.ones(points.shape[0], np.int64)
    for k in range(1, points.shape[0]):
        dx, dy = points[k, 0] - points[k - 1, 0], points[k, 1] - points[k - 1, 1]
        distance2 = dx * dx + dy * dy
        if distance2 > resolution * resolution:
            steps[k] = int(math.ceil(math.sqrt(distance2) / resolution))
    cells = np.empty(steps.sum(), np.int64)
    count = 0
    for k in range(points.shape[0]):
        last = max(k - 1, 0)
        step_x = (points[k, 0] - points[last, 0]) / steps[k]
        step_y = (points[k, 1] - points[last, 1]) / steps[k]
        for j in range(1, steps[k] + 1):
            x, y = points[k, 0], points[k, 1]
            if j < steps[k]:
                x, y = points[last, 0] + j * step_x, points[last, 1] + j * step_y
            cell_x, cell_y = cell_of(window, x, y)
            if cell_x >= 0 and cell_y >= 0 and window.costs[cell_y, cell_x] != UNKNOWN:
                cells[count] = cell_y * window.costs.shape[1] + cell_x
                count += 1
            elif count > 0:
                return cells[:count]
    return cells[:count]


@njit(cache=True, nogil=True)
def spread(costs, passable, sources):
    """Steps to the nearest source over free cells, 4-connected, int32[H, W].

    ``sources`` are flat cells, themselves at 0 whatever their cost. Cells of at
    least inscribed cost are entered only where ``passable``, bool[H, W];
    otherwise they get H * W if the wave touches them. Cells that it does not
    reach keep H * W + 1.
    """
    size_y, size_x = costs.shape
    obstacle, unreached = costs.size, costs.size + 1
    distance = np.full(costs.size, unreached, np.int32)
    blocked = ((costs >= INSCRIBED) & ~passable).ravel()
    queue = np.empty(costs.size, np.int64)
    count = 0
    for source in sources:
        if distance[source] == unreached:
            distance[source] = 0
            queue[count] = source
            count += 1
    head = 0
    while head < count:
        cell = queue[head]
        head += 1
        x = cell % size_x
        for offset in (-1, 1, -size_x, size_x):
            neighbour = cell + offset
            if ((offset == -1 and x == 0) or (offset == 1 and x == size_x - 1)
                    or not 0 <= neighbour < costs.size or distance[neighbour] != unreached):
                continue
            if blocked[neighbour]:
                distance[neighbour] = obstacle
                continue
            distance[neighbour] = distance[cell] + 1
            queue[count] = neighbour
            count += 1
    return distance.reshape(costs.shape)
