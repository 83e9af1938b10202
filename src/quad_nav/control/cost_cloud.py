"""What each cell of the local window costs: the point cloud ``cost_cloud``."""

from __future__ import annotations

import numpy as np

from quad_nav.grid import GridSpec


def cost_cloud(
    spec: GridSpec,
    costs: np.ndarray,
    path: np.ndarray,
    goal: np.ndarray,
    usable: np.ndarray,
    path_scale: float,
    goal_scale: float,
    occupancy_scale: float,
) -> np.ndarray:
    """The cells that are ``usable``, bool[H, W], as float32[n, 7], column by column.

    Rows x, y, z = 0, path_cost, goal_cost, occ_cost, total_cost. ``path`` and
    ``goal`` are distances in cells, int32[H, W]; scales are per cell.
    """
    x, y = np.nonzero(usable.T)
    centre_x = spec.origin_x_m + (x + 0.5) * spec.resolution_m
    centre_y = spec.origin_y_m + (y + 0.5) * spec.resolution_m
    parts = path[y, x], goal[y, x], costs[y, x]
    total = path_scale * parts[0] + goal_scale * parts[1] + occupancy_scale * parts[2]
    return np.column_stack((centre_x, centre_y, np.zeros(len(x)), *parts, total)).astype(np.float32)
