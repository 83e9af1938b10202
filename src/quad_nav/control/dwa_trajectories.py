"""Dynamic window controller: all trajectories that it looks at, for ``trajectory_cloud``.

Upstream scores the samples in turn, critic by critic, and stops as soon as one costs more than the
best before it. The search of ``dwa_search`` finds the same one without most of that work, so this
work is done only for those who ask to see it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from quad_nav.control.dwa_kernel import (
    ALIGNMENT,
    GOAL,
    GOAL_FRONT,
    PATH,
    MapGrids,
    has_nose_on_map,
    is_within_reach,
    longest,
    obstacle_cost,
    simulate,
)
from quad_nav.control.dwa_search import Critics, footprint_scale, is_forbidden
from quad_nav.costmap.collision import Triple
from quad_nav.files.kernel_cache import njit


@njit(cache=True, nogil=True)
def explored_points(critics: Critics, samples: NDArray[np.float64]) -> NDArray[np.float32]:
    """Return the poses of the samples, float64[n, 3], that upstream does not discard.

    Returns:
        float32[k, 5]: x, y, 0, yaw and the trajectory's cost as far as upstream adds it up.
    """
    points = np.empty((longest(critics.motion, samples), 3))
    rows = np.zeros((samples.shape[0] * points.shape[0], 5), np.float32)
    filled, best = 0, np.inf
    for k in range(samples.shape[0]):
        count, command = simulate(
            critics.motion, critics.pose, critics.velocity, samples[k], points
        )
        # A best cost of 0 stops nothing, as upstream.
        limit = best if best > 0.0 else np.inf
        cost = _cost(critics, points, count, command, limit) if count > 0 else -1.0
        if cost < 0.0:
            continue
        best = min(best, cost)
        for i in range(count):
            rows[filled, 0], rows[filled, 1] = points[i, 0], points[i, 1]
            rows[filled, 3], rows[filled, 4] = points[i, 2], cost
            filled += 1
    return rows[:filled]


@njit(cache=True, nogil=True)
def _cost(
    critics: Critics, points: NDArray[np.float64], count: int, command: Triple, limit: float
) -> float:
    """Add the critics' costs up until they exceed a limit; -1 for what is discarded before."""
    grids, obstacles, weights = critics.grids, critics.obstacles, critics.weights
    if is_forbidden(critics.directions, command):
        return -1.0
    total = 0.0
    if obstacles.scale != 0.0:
        scale = footprint_scale(weights, command)
        cost = obstacle_cost(obstacles, scale, points, count, np.empty(0), np.inf)
        if cost < 0.0:
            return -1.0
        total = obstacles.scale * cost
        if total > limit:
            return total
    distances = np.zeros(4)
    if (grids.follows_goal or grids.aligns) and not has_nose_on_map(
        grids, points, count, distances
    ):
        return -1.0
    total += distances[GOAL_FRONT] * weights.goal_scale
    if total > limit:
        return total
    total += distances[ALIGNMENT] * weights.path_scale
    if total > limit:
        return total
    if not is_within_reach(_only(grids, grids.follows_path, False), points, count, distances):
        return -1.0
    total += distances[PATH] * weights.path_scale
    if total > limit:
        return total
    if not is_within_reach(_only(grids, False, grids.follows_goal), points, count, distances):
        return -1.0
    total += distances[GOAL] * weights.goal_scale
    return total if total > limit else total + weights.twirling_scale * abs(command[2])


@njit(cache=True, nogil=True)
def _only(grids: MapGrids, follows_path: bool, follows_goal: bool) -> MapGrids:
    """Return the distances with one critic in use."""
    return MapGrids(
        grids.costmap,
        grids.path,
        grids.goal,
        grids.goal_front,
        grids.forward_point_distance_m,
        follows_path,
        follows_goal,
        False,
    )
