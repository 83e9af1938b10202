"""Filling a convex polygon on a grid."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def fill_convex_polygon(costs, vertices, value):
    """Set every cell of a convex polygon, outline included.

    vertices: int64[n, 2], cells (x, y) inside the grid, n >= 3. The outline is drawn
    with Bresenham's lines in the order of the vertices; each column is filled from its
    lowest to its highest outline cell.
    """
    size_y, size_x = costs.shape
    lowest = np.full(size_x, size_y, np.int64)
    highest = np.full(size_x, -1, np.int64)
    n = vertices.shape[0]
    for k in range(n):
        after = (k + 1) % n
        _span_line(
            lowest, highest, vertices[k, 0], vertices[k, 1], vertices[after, 0], vertices[after, 1]
        )
    for x in range(size_x):
        for y in range(lowest[x], highest[x] + 1):
            costs[y, x] = value


@njit(cache=True, nogil=True)
def _span_line(lowest, highest, x0, y0, x1, y1):
    """Widen each column's span by the cells of one line."""
    dx, dy = x1 - x0, y1 - y0
    step_x = 1 if dx > 0 else -1
    step_y = 1 if dy > 0 else -1
    steps_x, steps_y = abs(dx), abs(dy)
    along_x = steps_x >= steps_y
    steps = max(steps_x, steps_y)
    error = steps // 2
    x, y = x0, y0
    for _ in range(steps + 1):
        lowest[x] = min(lowest[x], y)
        highest[x] = max(highest[x], y)
        error += steps_y if along_x else steps_x
        carry = error >= steps
        if carry:
            error -= steps
        if along_x or carry:
            x += step_x
        if carry or not along_x:
            y += step_y
