"""Global planner: A*, and two descents of a potential.

Grids are flat arrays, cell = y * size_x + x; no cell of the outermost ring may be entered.
``plan/global_planner.py`` has the maths, ``wavefront_kernel`` that of Dijkstra's search.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.files.kernel_cache import njit
from quad_nav.plan.descent import leaves_map, step_down, surroundings
from quad_nav.plan.wavefront_kernel import NOT_REACHED, arrival_at


class Queue(NamedTuple):
    """Binary heap of cells, the lowest priority on top; equal ones are ordered as upstream."""

    priorities: NDArray[np.float32]  # [n]
    cells: NDArray[np.int64]  # [n]


@njit(cache=True, nogil=True)
def _sift_up(queue: Queue, hole: int, priority: np.float32, cell: int) -> None:
    """Put an entry into a hole, or above it while the parent has a higher priority."""
    while hole > 0:
        parent = (hole - 1) // 2
        if not queue.priorities[parent] > priority:
            break
        queue.priorities[hole], queue.cells[hole] = queue.priorities[parent], queue.cells[parent]
        hole = parent
    queue.priorities[hole], queue.cells[hole] = priority, cell


@njit(cache=True, nogil=True)
def _pop(queue: Queue, count: int) -> int:
    """Take the top of ``count`` entries; the last one fills the hole from below.

    Of equal children the right one rises.
    """
    top, count = queue.cells[0], count - 1
    priority, cell = queue.priorities[count], queue.cells[count]
    hole, child = 0, 2
    while child <= count:
        if child == count or queue.priorities[child] > queue.priorities[child - 1]:
            child -= 1
        queue.priorities[hole], queue.cells[hole] = queue.priorities[child], queue.cells[child]
        hole, child = child, 2 * child + 2
    _sift_up(queue, hole, priority, cell)
    return top


@njit(cache=True, nogil=True)
def a_star(
    step_costs: NDArray[np.uint8],
    enterable: NDArray[np.bool_],
    potential: NDArray[np.float32],
    size_x: int,
    start: int,
    goal: int,
    neutral: int,
    planar: bool,
    max_visits: int,
) -> bool:
    """Spread a potential from a start until the goal is visited; return whether it was.

    A cell's potential is final when it is first touched.

    Args:
        step_costs: uint8[n], cost of a step to each cell.
        enterable: bool[n].
        potential: float32[n], all NOT_REACHED; filled.
        size_x: Cells in a row.
        start: Flat cell.
        goal: Flat cell.
        neutral: Cost of a free cell, weight of the heuristic.
        planar: True for potentials of a planar wave.
        max_visits: Most cells to visit.
    """
    size = potential.size
    queue = Queue(np.empty(size, dtype=np.float32), np.empty(size, dtype=np.int64))
    potential[start] = 0.0
    queue.priorities[0], queue.cells[0] = 0.0, start
    count = 1
    for _ in range(max_visits):
        if count == 0:
            break
        cell = _pop(queue, count)
        count -= 1
        if cell == goal:
            return True
        for offset in (1, -1, size_x, -size_x):
            following = cell + offset
            if not (
                0 <= following < size
                and enterable[following]
                and potential[following] >= NOT_REACHED
            ):
                continue
            cost = step_costs[following]
            if planar:
                potential[following] = arrival_at(potential, size_x, following, cost, True)
            else:
                potential[following] = potential[cell] + np.float32(cost)
            blocks = abs(goal % size_x - following % size_x) + abs(
                goal // size_x - following // size_x
            )
            priority = np.float32(potential[following] + np.float32(blocks * neutral))
            _sift_up(queue, count, priority, following)
            count += 1
    return False


@njit(cache=True, nogil=True)
def fill_around(
    step_costs: NDArray[np.uint8],
    potential: NDArray[np.float32],
    size_x: int,
    centre: int,
    planar: bool,
) -> None:
    """Give unreached cells within two cells of a flat cell a potential, too.

    Column by column, each from its neighbours as they then are. Arrays as for ``a_star``.
    """
    for dx in range(-2, 3):
        for dy in range(-2, 3):
            cell = centre + dx + size_x * dy
            if size_x <= cell < potential.size - size_x and potential[cell] >= NOT_REACHED:
                potential[cell] = arrival_at(potential, size_x, cell, step_costs[cell], planar)


@njit(cache=True, nogil=True)
def gradient_path(
    potential: NDArray[np.float32],
    size_x: int,
    start_x: float,
    start_y: float,
    goal_x: float,
    goal_y: float,
    path: NDArray[np.float32],
) -> int:
    """Follow the gradient of float32[n] down from the goal to the start, both in cells.

    The path, float32[k, 2], is filled with cells (x, y).

    Returns:
        The number of points, 0 if the descent ends elsewhere.
    """
    cell = int(goal_y) * size_x + int(goal_x)
    dx, dy = np.float32(goal_x - int(goal_x)), np.float32(goal_y - int(goal_y))
    around, known = surroundings(potential, size_x, cell), cell
    for k in range(path.shape[0]):
        x, y = np.float32(cell % size_x + dx), np.float32(cell // size_x + dy)
        if abs(x - start_x) < 0.5 and abs(y - start_y) < 0.5:
            path[k, 0], path[k, 1] = start_x, start_y
            return k + 1
        if leaves_map(potential, size_x, cell):
            return 0
        path[k, 0], path[k, 1] = x, y
        if cell != known:
            around, known = surroundings(potential, size_x, cell), cell
        goes_on, cell, dx, dy = step_down(potential, size_x, around, cell, dx, dy, path, k)
        if not goes_on:
            return 0
    return 0


@njit(cache=True, nogil=True)
def grid_path(
    potential: NDArray[np.float32],
    size_x: int,
    start_x: float,
    start_y: float,
    goal_x: float,
    goal_y: float,
    path: NDArray[np.float32],
) -> int:
    """Go from the goal to the lowest of eight neighbours until the start's cell.

    As ``gradient_path``; the first point is the goal, the others are cells.
    """
    size_y = potential.size // size_x
    path[0, 0], path[0, 1] = goal_x, goal_y
    x, y = int(goal_x), int(goal_y)
    from_x, from_y = goal_x, goal_y  # only the first step starts between cells
    for k in range(1, path.shape[0] + 1):
        if x == int(start_x) and y == int(start_y):
            return k
        if k == path.shape[0]:
            break
        lowest, lowest_x, lowest_y = NOT_REACHED, -1, -1
        for step_x in (-1, 0, 1):
            for step_y in (-1, 0, 1):
                next_x, next_y = int(from_x + step_x), int(from_y + step_y)
                if (
                    (step_x != 0 or step_y != 0)
                    and 0 <= next_x < size_x
                    and 0 <= next_y < size_y
                    and potential[next_y * size_x + next_x] < lowest
                ):
                    lowest = potential[next_y * size_x + next_x]
                    lowest_x, lowest_y = next_x, next_y
        if lowest_x < 0:
            break
        x, y = lowest_x, lowest_y
        from_x, from_y = float(x), float(y)
        path[k, 0], path[k, 1] = x, y
    return 0
