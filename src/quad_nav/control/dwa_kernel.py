"""Dynamic window controller: simulate a sample, and what its obstacles cost.

``control/dwa_critics.py`` has the maths, ``dwa_search`` the search for the cheapest sample. Poses
and velocities are rounded to single precision at every step, as upstream keeps them. Poses and
velocities of the robot are triples: x, y in metres and yaw in the costmap's frame; vx, vy in m/s
and vtheta in rad/s in the robot's frame.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.costmap.collision import Triple, footprint_cost
from quad_nav.costmap.cost_grid_kernel import CostmapView, cell_of
from quad_nav.files.kernel_cache import njit

_TOLERANCE = 1e-4
# Columns of the distances
GOAL_FRONT, ALIGNMENT, PATH, GOAL = 0, 1, 2, 3


class Motion(NamedTuple):
    """Parameters of the simulation."""

    sim_time_s: float
    sim_granularity_m: float
    angular_sim_granularity_rad: float
    acceleration_limits: Triple  # x, y, theta
    min_vel_trans_mps: float
    max_vel_trans_mps: float
    min_vel_theta_radps: float
    accelerates: bool  # approach the sample as the limits allow; else have its velocity at once


class MapGrids(NamedTuple):
    """Distance grids, and which of them count."""

    costmap: CostmapView
    path: NDArray[np.int32]  # [H, W]
    goal: NDArray[np.int32]  # [H, W]
    goal_front: NDArray[np.int32]  # [H, W]
    forward_point_distance_m: float
    follows_path: bool
    follows_goal: bool
    aligns: bool


class Obstacles(NamedTuple):
    """Input of the obstacle critic."""

    costmap: CostmapView
    highest_near: NDArray[np.uint8]  # [H, W], no less than the highest cost under any footprint
    footprint: NDArray[np.float64]  # [n, 2], robot frame, not scaled
    scale: float  # weight; 0 for no obstacle critic
    sums: bool  # sum costs along the trajectory; else take the highest


@njit(cache=True, nogil=True)
def sample_grid(
    lowest: Triple, highest: Triple, counts: Tuple[int, int, int]
) -> NDArray[np.float64]:
    """Return samples between two velocities, float64[n, 3]; vtheta varies fastest.

    Values along each axis are those of ``spaced``, of single precision.
    """
    of_x = spaced(lowest[0], highest[0], counts[0])
    of_y = spaced(lowest[1], highest[1], counts[1])
    of_theta = spaced(lowest[2], highest[2], counts[2])
    samples = np.empty((of_x.size * of_y.size * of_theta.size, 3))
    k = 0
    for vx in of_x:
        for vy in of_y:
            for vtheta in of_theta:
                samples[k, 0], samples[k, 1] = _single(vx), _single(vy)
                samples[k, 2] = _single(vtheta)
                k += 1
    return samples


@njit(cache=True, nogil=True)
def spaced(start: float, end: float, count: int) -> NDArray[np.float64]:
    """Return ``count`` values from start to end, at least both ends, and 0 if stepped over."""
    values = np.empty(max(count, 2) + 1)
    values[0] = start
    if start == end:
        return values[:1]
    step = (end - start) / (max(count, 2) - 1)
    value, filled = start, 0
    for _ in range(max(count, 2) - 1):
        values[filled] = value
        filled += 1
        if value < 0.0 < value + step:
            values[filled] = 0.0
            filled += 1
        value += step  # summed up: the last bit of a sample can decide between equal costs
    values[filled] = end
    return values[: filled + 1]


@njit(cache=True, nogil=True)
def step_count(motion: Motion, sample: NDArray[np.float64]) -> int:
    """Count the steps of a sample's simulation, float64[3]; 0 outside of the speed limits."""
    speed, turn = math.hypot(sample[0], sample[1]), abs(sample[2])
    if (
        0.0 <= motion.min_vel_trans_mps
        and speed + _TOLERANCE < motion.min_vel_trans_mps
        and 0.0 <= motion.min_vel_theta_radps
        and turn + _TOLERANCE < motion.min_vel_theta_radps
    ):
        return 0
    if 0.0 <= motion.max_vel_trans_mps < speed - _TOLERANCE:
        return 0
    return int(
        math.ceil(
            max(
                speed * motion.sim_time_s / motion.sim_granularity_m,
                turn * motion.sim_time_s / motion.angular_sim_granularity_rad,
            )
        )
    )


@njit(cache=True, nogil=True)
def simulate(
    motion: Motion,
    pose: Triple,
    velocity: Triple,
    sample: NDArray[np.float64],
    points: NDArray[np.float64],
) -> Tuple[int, Triple]:
    """Simulate a sample, float64[3], from the robot's pose and velocity; fill poses, float64[k, 3].

    Returns:
        The number of poses, and the command: the sample, or what comes nearest to it after
        one step.
    """
    steps = step_count(motion, sample)
    command = command_of(motion, velocity, sample, steps)
    if steps == 0:
        return 0, command
    dt = motion.sim_time_s / steps
    vx, vy, vtheta = command
    x, y, theta = pose
    for k in range(steps):
        points[k, 0], points[k, 1], points[k, 2] = x, y, theta
        if motion.accelerates:
            vx, vy, vtheta = _accelerated(motion, sample, vx, vy, vtheta, dt)
        dx, dy = vx * math.cos(theta), vx * math.sin(theta)
        if vy != 0.0:
            side = math.pi / 2 + theta
            dx, dy = dx + vy * math.cos(side), dy + vy * math.sin(side)
        x, y, theta = _single(x + dx * dt), _single(y + dy * dt), _single(theta + vtheta * dt)
    return steps, command


@njit(cache=True, nogil=True)
def command_of(motion: Motion, velocity: Triple, sample: NDArray[np.float64], steps: int) -> Triple:
    """Return the command of a sample: itself, or what comes nearest to it after one step."""
    if steps == 0 or not motion.accelerates:
        return sample[0], sample[1], sample[2]
    vx, vy, vtheta = velocity
    return _accelerated(motion, sample, vx, vy, vtheta, motion.sim_time_s / steps)


@njit(cache=True, nogil=True)
def _accelerated(
    motion: Motion, sample: NDArray[np.float64], vx: float, vy: float, vtheta: float, dt: float
) -> Triple:
    limit_x, limit_y, limit_theta = motion.acceleration_limits
    return (
        _approach(sample[0], vx, limit_x * dt),
        _approach(sample[1], vy, limit_y * dt),
        _approach(sample[2], vtheta, limit_theta * dt),
    )


@njit(cache=True, nogil=True)
def _approach(wanted: float, current: float, max_change: float) -> float:
    if current < wanted:
        return _single(min(wanted, current + max_change))
    return _single(max(wanted, current - max_change))


@njit(cache=True, nogil=True)
def _single(value: float) -> Any:
    return np.float64(np.float32(value))


@njit(cache=True, nogil=True)
def is_within_reach(
    grids: MapGrids, points: NDArray[np.float64], count: int, distances: NDArray[np.float64]
) -> bool:
    """Tell whether path and goal are in reach from every pose, and it and its nose on the map.

    The last pose's distances fill float64[4]; those that do not count stay.
    """
    if grids.follows_path or grids.follows_goal:
        for k in range(count):
            cell_x, cell_y = cell_of(grids.costmap, points[k, 0], points[k, 1])
            if cell_x < 0 or cell_y < 0:
                return False
            if grids.follows_path:
                distances[PATH] = grids.path[cell_y, cell_x]
            if grids.follows_goal:
                distances[GOAL] = grids.goal[cell_y, cell_x]
            if max(distances[PATH], distances[GOAL]) >= grids.path.size:
                return False
    if grids.follows_goal or grids.aligns:
        return has_nose_on_map(grids, points, count, distances)
    return True


@njit(cache=True, nogil=True)
def has_nose_on_map(
    grids: MapGrids, points: NDArray[np.float64], count: int, distances: NDArray[np.float64]
) -> bool:
    """Tell whether the robot's nose is on the map at every pose; see ``is_within_reach``."""
    size_y, size_x = grids.path.shape
    forward = grids.forward_point_distance_m
    border = abs(forward) + grids.costmap.resolution_m
    min_x, min_y = grids.costmap.origin_x_m + border, grids.costmap.origin_y_m + border
    max_x = grids.costmap.origin_x_m + size_x * grids.costmap.resolution_m - border
    max_y = grids.costmap.origin_y_m + size_y * grids.costmap.resolution_m - border
    for k in range(count):
        x, y = points[k, 0], points[k, 1]
        if k < count - 1 and min_x < x < max_x and min_y < y < max_y:
            continue  # too far inside for any heading to matter
        cell_x, cell_y = cell_of(
            grids.costmap,
            x + forward * math.cos(points[k, 2]),
            y + forward * math.sin(points[k, 2]),
        )
        if cell_x < 0 or cell_y < 0:
            return False
        if grids.follows_goal:
            distances[GOAL_FRONT] = grids.goal_front[cell_y, cell_x]
        if grids.aligns:
            distances[ALIGNMENT] = grids.path[cell_y, cell_x]
    return True


@njit(cache=True, nogil=True)
def longest(motion: Motion, samples: NDArray[np.float64]) -> int:
    """Return the most poses of any sample, float64[n, 3]; at least 1."""
    steps = 1
    for k in range(samples.shape[0]):
        steps = max(steps, step_count(motion, samples[k]))
    return steps


@njit(cache=True, nogil=True)
def obstacle_cost(
    obstacles: Obstacles,
    footprint_scale: float,
    points: NDArray[np.float64],
    count: int,
    terms: NDArray[np.float64],
    limit: float,
) -> float:
    """Return the highest cost under the scaled footprint, or their sum; -1 on collision.

    Poses, ``count`` rows of float64[k, 3], are examined from the last one on, where most
    trajectories collide that do. Where the result leads, with the other critics' terms, to more
    than the limit, it may be too low.
    """
    if count > 0 and not math.isfinite(footprint_scale):
        return -1.0
    footprint = obstacles.footprint * footprint_scale
    total = 0.0
    for k in range(count - 1, -1, -1):
        pose = points[k, 0], points[k, 1], points[k, 2]
        cost = cost_of_pose(obstacles, footprint, pose, 0.0 if obstacles.sums else total)
        if cost < 0.0:
            return -1.0
        total = total + cost if obstacles.sums else max(total, cost)
        if obstacles.scale > 0.0 and total_cost(obstacles.scale * total, terms) > limit:
            return total
    return total


@njit(cache=True, nogil=True)
def cost_of_pose(
    obstacles: Obstacles, footprint: NDArray[np.float64], pose: Triple, known: float
) -> float:
    """Return the highest cost under a footprint, float64[n, 2], at a pose; -1 on collision.

    It is 0 where the cost is no more than a known one.
    """
    cell_x, cell_y = cell_of(obstacles.costmap, pose[0], pose[1])
    if cell_x < 0 or cell_y < 0:
        return -1.0
    if obstacles.highest_near[cell_y, cell_x] <= known:
        return 0.0
    cost = footprint_cost(obstacles.costmap, footprint, pose)
    return -1.0 if cost < 0.0 else max(cost, float(obstacles.costmap.costs[cell_y, cell_x]))


@njit(cache=True, nogil=True)
def total_cost(obstacle_term: float, terms: NDArray[np.float64]) -> float:
    """Add float64[n] in the critics' order: the last bit can decide between samples."""
    total = obstacle_term
    for term in terms:
        total += term
    return total
