"""Grids of costs: cells of points, polygons and discs, the nearest free cell, merged grids.

Mirrors ``costmap/cost_grid.py``.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.files.kernel_cache import njit
from quad_nav.grid import UNKNOWN


class CostmapView(NamedTuple):
    """A costmap as kernels take it."""

    costs: NDArray[np.uint8]  # [H, W], row 0 at the lower border
    origin_x_m: float  # corner of cell (0, 0) in the costmap's frame
    origin_y_m: float
    resolution_m: float


@njit(cache=True, nogil=True)
def cell_index(world_m: float, origin_m: float, resolution_m: float, size: int) -> int:
    """Return the index along one axis of the cell that holds a coordinate, -1 off the grid."""
    cell = (world_m - origin_m) / resolution_m
    if not 0.0 <= cell < size:
        return -1
    return int(cell)


@njit(cache=True, nogil=True)
def cell_of(costmap: CostmapView, x: float, y: float) -> Tuple[int, int]:
    """Return the cell (x, y) of a point in the costmap's frame, metres.

    An index is negative where the point is off the map.
    """
    size_y, size_x = costmap.costs.shape
    return (
        cell_index(x, costmap.origin_x_m, costmap.resolution_m, size_x),
        cell_index(y, costmap.origin_y_m, costmap.resolution_m, size_y),
    )


@njit(cache=True, nogil=True)
def include(bounds: NDArray[np.float64], x: float, y: float) -> None:
    """Grow bounds, float64[4] min x, min y, max x, max y in metres, to hold a point."""
    bounds[0] = min(bounds[0], x)
    bounds[1] = min(bounds[1], y)
    bounds[2] = max(bounds[2], x)
    bounds[3] = max(bounds[3], y)


@njit(cache=True, nogil=True)
def place_polygon(
    vertices: NDArray[np.float64],
    x: float,
    y: float,
    cos: float,
    sin: float,
    bounds: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Turn a polygon, float64[n, 2], then move it by (x, y); grow bounds, float64[4], by it.

    The order of operations is that of ``Pose2D.transform``.
    """
    placed = np.empty_like(vertices)
    for k in range(vertices.shape[0]):
        placed[k, 0] = cos * vertices[k, 0] - sin * vertices[k, 1] + x
        placed[k, 1] = sin * vertices[k, 0] + cos * vertices[k, 1] + y
        include(bounds, placed[k, 0], placed[k, 1])
    return placed


@njit(cache=True, nogil=True)
def fill_polygon(costmap: CostmapView, vertices: NDArray[np.float64], value: int) -> bool:
    """Set the cells of a convex polygon, float64[n, 2] metres in the costmap's frame.

    Returns:
        False if a vertex is off the grid and nothing was set. Fewer than three vertices set
        nothing either.
    """
    n = vertices.shape[0]
    cells = np.empty((n, 2), np.int64)
    for k in range(n):
        x, y = cell_of(costmap, vertices[k, 0], vertices[k, 1])
        if x < 0 or y < 0:
            return False
        cells[k, 0], cells[k, 1] = x, y
    if n >= 3:
        fill_convex_polygon(costmap.costs, cells, value)
    return True


@njit(cache=True, nogil=True)
def fill_convex_polygon(costs: NDArray[Any], vertices: NDArray[np.int64], value: int) -> None:
    """Set every cell of a convex polygon of cells (x, y), int64[n, 2], n >= 3, outline included.

    The outline is drawn with Bresenham's lines in the order of the vertices. Each column is filled
    from its lowest to its highest outline cell, as costmap_2d does.
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
def draw_line(
    flat_cells: NDArray[Any],
    size_x: int,
    x0: int,
    y0: int,
    x1: int,
    y1: int,
    max_cells: float,
    value: int,
) -> None:
    """Set the cells of Bresenham's line from (x0, y0) to (x1, y1), both on the grid and included.

    The cells, uint8 or bool[H * W], are row by row, ``size_x`` in each. The line is cut to
    ``max_cells``, measured along it.
    """
    dx, dy = x1 - x0, y1 - y0
    scale = 1.0
    if dx * dx + dy * dy > max_cells * max_cells:
        scale = max_cells / math.hypot(dx, dy)
    along, across = abs(dx), abs(dy)
    step_along = 1 if dx > 0 else -1
    step_across = size_x if dy > 0 else -size_x
    if across > along:
        along, across = across, along
        step_along, step_across = step_across, step_along
    cell = y0 * size_x + x0
    error = along // 2
    for _ in range(int(scale * along)):
        flat_cells[np.uint64(cell)] = value  # unsigned indices save the test for a negative one
        cell += step_along
        error += across
        if error >= along:
            cell += step_across
            error -= along
    flat_cells[np.uint64(cell)] = value


@njit(cache=True, nogil=True)
def _span_line(
    lowest: NDArray[np.int64], highest: NDArray[np.int64], x0: int, y0: int, x1: int, y1: int
) -> None:
    """Widen each column's span, lowest and highest int64[W], by the cells of one line."""
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


@njit(cache=True, nogil=True)
def reset_to(cells: NDArray[np.uint8], cost: int) -> None:
    """Give all cells, uint8[H, W], a cost; rows that have it are not written to.

    The system gives memory to a new grid when it is written to: large maps are mostly free.
    """
    wanted = np.uint8(cost)
    for y in range(cells.shape[0]):
        differences = np.uint8(0)
        for x in range(cells.shape[1]):  # a loop that the compiler makes vectors of
            differences |= cells[y, x] ^ wanted
        if differences != 0:
            for x in range(cells.shape[1]):
                cells[y, x] = wanted


@njit(cache=True, nogil=True)
def raise_to(below: NDArray[np.uint8], above: NDArray[np.uint8]) -> None:
    """Keep the higher cost of each cell, uint8[H, W], in ``below``; unknown is the lowest.

    Rows in which nothing is raised are not written to, as in ``reset_to``.
    """
    for y in range(below.shape[0]):
        any_higher = False
        for x in range(below.shape[1]):  # a loop that the compiler makes vectors of
            any_higher |= _is_raised(below[y, x], above[y, x])
        if any_higher:
            for x in range(below.shape[1]):
                if _is_raised(below[y, x], above[y, x]):
                    below[y, x] = above[y, x]


@njit(cache=True, nogil=True)
def _is_raised(cost: np.uint8, other: np.uint8) -> bool:
    return (cost == UNKNOWN) | ((other != UNKNOWN) & (other > cost))


@njit(cache=True, nogil=True)
def raise_discs(
    costmap: CostmapView, centres: NDArray[np.float64], radius_m: float, value: int
) -> None:
    """Raise to a value the cells whose centres lie in discs; cells that are higher stay.

    The discs have centres float64[n, 2], metres in the grid's frame.
    """
    cells, origin_x_m, origin_y_m, resolution_m = costmap
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

    Blocked cells, uint8[H, W], cannot be entered; the start may be one. Unwanted ones can be
    crossed and are no result.

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
