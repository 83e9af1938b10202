"""Distances over the local costmap: to the global plan, and to the local goal.

Both count steps between the four neighbours of a cell, around obstacles. The local goal is the
last cell of the plan's first stretch inside the local costmap. Cells under the robot's footprint
count as free for the path distance, so that a robot at an obstacle still finds a path to the
plan, but not for the goal distance.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.costmap.collision import Triple, mark_footprint
from quad_nav.costmap.cost_grid_kernel import CostmapView, cell_of
from quad_nav.files.kernel_cache import njit
from quad_nav.grid import INSCRIBED, UNKNOWN


class DistanceGrids(NamedTuple):
    """Distances in cells; H * W for obstacles that the wave touches, H * W + 1 for unreached cells.

    Attributes:
        path: int32[H, W], to the plan.
        goal: int32[H, W], to the local goal.
        within_robot: bool[H, W], cells inside of the footprint.
    """

    path: NDArray[np.int32]
    goal: NDArray[np.int32]
    within_robot: NDArray[np.bool_]


def cost_cloud(
    costmap: CostmapView,
    path: NDArray[np.int32],
    goal: NDArray[np.int32],
    usable: NDArray[np.bool_],
    scales: Triple,
) -> NDArray[np.float32]:
    """Compute the costs of usable cells, bool[H, W], for the point cloud ``cost_cloud``.

    Distances to plan and local goal are int32[H, W], in cells; the scales are weights of path and
    goal distance, per cell, and of the costs.

    Returns:
        float32[n, 7], column by column of the grid: x, y, z = 0, path_cost, goal_cost,
        occ_cost, total_cost.
    """
    x, y = np.nonzero(usable.T)
    centre_x = costmap.origin_x_m + (x + 0.5) * costmap.resolution_m
    centre_y = costmap.origin_y_m + (y + 0.5) * costmap.resolution_m
    parts = path[y, x], goal[y, x], costmap.costs[y, x]
    total = scales[0] * parts[0] + scales[1] * parts[1] + scales[2] * parts[2]
    return np.column_stack((centre_x, centre_y, np.zeros(len(x)), *parts, total)).astype(np.float32)


@njit(cache=True, nogil=True)
def distance_grids(
    costmap: CostmapView,
    plan: NDArray[np.float64],
    footprint: NDArray[np.float64],
    pose: Triple,
) -> DistanceGrids:
    """Measure the distances to a plan and its local goal.

    Without a point of the plan on known ground no cell is reached.

    Args:
        costmap: The costmap.
        plan: float64[m, 2 or more], columns x, y in the costmap's frame, metres.
        footprint: float64[n, 2], metres in the robot's frame.
        pose: x, y and heading of the robot in the costmap's frame, metres and radians.
    """
    within_robot = np.zeros(costmap.costs.shape, np.bool_)
    cells = cells_on_plan(costmap, plan)
    to_goal = spread(costmap.costs, within_robot, cells[-1:])
    mark_footprint(costmap, footprint, pose, within_robot)
    return DistanceGrids(spread(costmap.costs, within_robot, cells), to_goal, within_robot)


@njit(cache=True, nogil=True)
def distances_ahead(
    costmap: CostmapView, plan: NDArray[np.float64], front_x: float, front_y: float
) -> Tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.int32]]:
    """Measure the distances to a plan, to its local goal, and to that moved ahead, in cells.

    The plan's end moved ahead is (front_x, front_y). Each is int32[H, W], as from ``spread``.
    """
    nowhere = np.zeros(costmap.costs.shape, np.bool_)
    cells = cells_on_plan(costmap, plan)
    front = plan.copy()
    front[-1, 0], front[-1, 1] = front_x, front_y
    ahead = cells_on_plan(costmap, front)
    return (
        spread(costmap.costs, nowhere, cells),
        spread(costmap.costs, nowhere, cells[-1:]),
        spread(costmap.costs, nowhere, ahead[-1:]),
    )


@njit(cache=True, nogil=True)
def cells_on_plan(costmap: CostmapView, points: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return the cells that a plan passes in its first stretch over known ground.

    Gaps wider than a cell are filled by interpolation. Points before the stretch are skipped; it
    ends at the first point off the map or on an unknown cell.

    Returns:
        int64[n], flat cells in the plan's order, repeated where the plan is dense.
    """
    resolution = costmap.resolution_m
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
            cell_x, cell_y = cell_of(costmap, x, y)
            if cell_x >= 0 and cell_y >= 0 and costmap.costs[cell_y, cell_x] != UNKNOWN:
                cells[count] = cell_y * costmap.costs.shape[1] + cell_x
                count += 1
            elif count > 0:
                return cells[:count]
    return cells[:count]


@njit(cache=True, nogil=True)
def spread(
    costs: NDArray[np.uint8], passable: NDArray[np.bool_], sources: NDArray[np.int64]
) -> NDArray[np.int32]:
    """Count the steps from each cell to the nearest source over free cells, 4-connected.

    Cells of inscribed cost or more are obstacles, but those that are passable, bool[H, W]. Sources,
    int64[k] flat cells, are at 0 whatever their cost.

    Returns:
        int32[H, W]; H * W for obstacles that the wave touches, H * W + 1 for cells that it
        does not reach.
    """
    size_y, size_x = costs.shape
    obstacle, unreached, blocked = costs.size, costs.size + 1, costs.size + 2
    width = size_x + 2  # a border that is neither free nor blocked ends the wave
    grid = np.full((size_y + 2, width), -1, np.int32)
    for y in range(size_y):
        _fill_unreached(costs[y], passable[y], grid[y + 1, 1:-1], unreached, blocked)
    distance = grid.reshape(-1)
    queue = np.empty(costs.size, np.int32)
    count = 0
    for source in sources:
        cell = (source // size_x + 1) * width + source % size_x + 1
        if distance[cell] != 0:
            distance[cell] = 0
            queue[count] = cell
            count += 1
    head = 0
    while head < count:
        cell = np.int64(queue[head])
        head += 1
        further = distance[cell] + 1
        for offset in (-1, 1, -width, width):
            neighbour = np.uint64(cell + offset)
            if distance[neighbour] <= obstacle:
                continue  # most of them
            if distance[neighbour] == unreached:
                distance[neighbour] = further
                queue[count] = neighbour
                count += 1
            else:
                distance[neighbour] = obstacle
    inner = np.empty((size_y, size_x), np.int32)
    for y in range(size_y):
        _fill_lower(grid[y + 1, 1:-1], unreached, inner[y])
    return inner


@njit(cache=True, nogil=True)
def _fill_unreached(
    costs: NDArray[np.uint8],
    passable: NDArray[np.bool_],
    distance: NDArray[np.int32],
    unreached: int,
    blocked: int,
) -> None:
    """Fill a row of distances before the wave; without branches, for vectors."""
    of_free, of_blocked = np.int32(unreached), np.int32(blocked)
    for x in range(costs.size):
        is_blocked = (costs[x] >= INSCRIBED) & (passable[x] == 0)
        distance[x] = of_blocked if is_blocked else of_free


@njit(cache=True, nogil=True)
def _fill_lower(distance: NDArray[np.int32], most: int, lower: NDArray[np.int32]) -> None:
    """Fill a row with distances up to a highest one."""
    highest = np.int32(most)
    for x in range(distance.size):
        lower[x] = min(distance[x], highest)
