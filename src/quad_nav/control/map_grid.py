"""Distances over the local costmap: to the global plan, and to the local goal.

Both count steps between the four neighbours of a cell, around obstacles. The local goal is the
last cell of the plan's first stretch inside the local costmap. Cells under the robot's footprint
count as free for the path distance, so that a robot at an obstacle still finds a path to the
plan, but not for the goal distance.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quad_nav.control.map_grid_kernel import distances
from quad_nav.costmap.cost_grid_kernel import CostmapView
from quad_nav.geometry import Pose2D
from quad_nav.grid import GridSpec


@dataclass(frozen=True)
class DistanceGrids:
    """Distances in cells; H * W for obstacles that the wave touches, H * W + 1 for unreached cells.

    Attributes:
        path: int32[H, W], to the plan.
        goal: int32[H, W], to the local goal.
        within_robot: bool[H, W], cells inside of the footprint.
    """

    path: NDArray[np.int32]
    goal: NDArray[np.int32]
    within_robot: NDArray[np.bool_]


def distance_grids(
    costmap: CostmapView, plan: NDArray[np.float64], footprint: NDArray[np.float64], pose: Pose2D
) -> DistanceGrids:
    """Compute the distance grids of a plan.

    Without a point of the plan on known ground no cell is reached.

    Args:
        costmap: The local costmap.
        plan: float64[m, 2 or more], columns x, y of the plan, metres in the costmap's frame.
        footprint: float64[n, 2], metres in the robot's frame.
        pose: Pose of the robot in the costmap's frame.
    """
    path, goal, within_robot = distances(
        costmap, plan, footprint, float(pose.x_m), float(pose.y_m), float(pose.yaw_rad)
    )
    return DistanceGrids(path, goal, within_robot)


def cost_cloud(
    spec: GridSpec,
    costs: NDArray[np.uint8],
    path: NDArray[np.int32],
    goal: NDArray[np.int32],
    usable: NDArray[np.bool_],
    path_scale: float,
    goal_scale: float,
    occupancy_scale: float,
) -> NDArray[np.float32]:
    """Compute the costs of cells for the point cloud ``cost_cloud``.

    Args:
        spec: Grid of the local costmap.
        costs: uint8[H, W].
        path: int32[H, W], distance to the plan in cells.
        goal: int32[H, W], distance to the local goal in cells.
        usable: bool[H, W], cells to return.
        path_scale: Weight of the path distance, per cell.
        goal_scale: Weight of the goal distance, per cell.
        occupancy_scale: Weight of the costs.

    Returns:
        float32[n, 7], column by column of the grid: x, y, z = 0, path_cost, goal_cost,
        occ_cost, total_cost.
    """
    x, y = np.nonzero(usable.T)
    centre_x = spec.origin_x_m + (x + 0.5) * spec.resolution_m
    centre_y = spec.origin_y_m + (y + 0.5) * spec.resolution_m
    parts = path[y, x], goal[y, x], costs[y, x]
    total = path_scale * parts[0] + goal_scale * parts[1] + occupancy_scale * parts[2]
    return np.column_stack((centre_x, centre_y, np.zeros(len(x)), *parts, total)).astype(np.float32)
