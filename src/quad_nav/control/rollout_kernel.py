"""Trajectory rollout: simulate velocity samples and score them.

``control/rollout.py`` has the maths, ``sample_motion`` the poses. Poses and velocities of the robot
are triples: x, y in metres and yaw in the costmap's frame; vx, vy in m/s and vtheta in rad/s in
the robot's frame.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.control.lanes import OFF_MAP, UNCERTAIN
from quad_nav.control.sample_motion import RolloutParams, last_cells, longest, step_count, travel
from quad_nav.costmap.collision import COLLIDES, Triple, footprint_cost, line_cost
from quad_nav.costmap.cost_grid_kernel import CostmapView, cell_of
from quad_nav.files.kernel_cache import njit
from quad_nav.grid import INSCRIBED

OUT_OF_REACH = -2.0  # the cost of a trajectory that leaves the reach of path or goal
_NO_LINE_OF_SIGHT = 1.7976931348623157e308
_HEADING_SCALE = 0.3


class RolloutInputs(NamedTuple):
    """State of the robot that trajectories begin with, and what they are scored against."""

    params: RolloutParams
    pose: Triple
    velocity: Triple

    costmap: CostmapView
    highest_near: NDArray[np.uint8]  # [H, W], no less than the highest cost under the footprint
    footprint: NDArray[np.float64]  # [n, 2], robot frame
    path_distance: NDArray[np.int32]  # [H, W]
    goal_distance: NDArray[np.int32]  # [H, W]
    plan: NDArray[np.float64]  # [m, 2 or more], columns x, y, m >= 1


@njit(cache=True, nogil=True)
def simulate(
    inputs: RolloutInputs,
    sample: NDArray[np.float64],
    points: NDArray[np.float64],
    with_footprint: bool = True,
) -> Tuple[float, int]:
    """Simulate and score a sample, float64[3]; fill its poses, float64[k, 3].

    Returns:
        The cost, COLLIDES (also off the map) or OUT_OF_REACH, and the number of poses before one
        that fails. Without ``with_footprint`` the costs under the footprint are left out.
    """
    params = inputs.params
    steps = travel(params, inputs.pose, inputs.velocity, sample, points)
    dt = params.sim_time_s / steps
    path_distance, goal_distance, occupancy, heading, time = 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(steps):
        x, y, theta = points[k]
        cell_x, cell_y = cell_of(inputs.costmap, x, y)
        if cell_x < 0 or cell_y < 0:
            return COLLIDES, k
        if with_footprint:
            occupancy = _occupancy(inputs, (x, y, theta), cell_x, cell_y, occupancy)
            if occupancy < 0.0:
                return COLLIDES, k
        if params.simple_attractor:
            goal_distance = (x - inputs.plan[-1, 0]) ** 2 + (y - inputs.plan[-1, 1]) ** 2
        elif not params.heading_scoring or _is_heading_step(params, time, dt):
            if params.heading_scoring:
                heading = _heading_difference(inputs, cell_x, cell_y, x, y, theta)
            path_distance = float(inputs.path_distance[cell_y, cell_x])
            goal_distance = float(inputs.goal_distance[cell_y, cell_x])
            if max(path_distance, goal_distance) >= inputs.path_distance.size:
                return OUT_OF_REACH, k
        time += dt
    if params.heading_scoring:
        return (
            params.occupancy_scale * occupancy
            + params.path_scale * path_distance
            + _HEADING_SCALE * heading
            + goal_distance * params.goal_scale
        ), steps
    return (
        params.path_scale * path_distance
        + goal_distance * params.goal_scale
        + params.occupancy_scale * occupancy
    ), steps


@njit(cache=True, nogil=True)
def _occupancy(
    inputs: RolloutInputs, pose: Triple, cell_x: int, cell_y: int, occupancy: float
) -> float:
    """Return the higher of an occupancy and that of a pose, COLLIDES where the footprint does."""
    if inputs.highest_near[cell_y, cell_x] <= occupancy:
        return occupancy  # the footprint changes nothing
    cost = footprint_cost(inputs.costmap, inputs.footprint, pose)
    if cost < 0.0:
        return COLLIDES
    return max(occupancy, cost, float(inputs.costmap.costs[cell_y, cell_x]))


@njit(cache=True, nogil=True)
def _is_heading_step(params: RolloutParams, time: float, dt: float) -> bool:
    start = params.heading_scoring_timestep_s
    return start <= time < start + dt


@njit(cache=True, nogil=True)
def _heading_difference(
    inputs: RolloutInputs, cell_x: int, cell_y: int, x: float, y: float, theta: float
) -> float:
    """Return the angle to the farthest plan point in sight of a cell; huge if there is none."""
    costmap = inputs.costmap
    for k in range(inputs.plan.shape[0] - 1, -1, -1):
        to_x, to_y = cell_of(costmap, inputs.plan[k, 0], inputs.plan[k, 1])
        if to_x < 0 or to_y < 0:
            continue
        if line_cost(costmap.costs, cell_x, cell_y, to_x, to_y, INSCRIBED) >= 0.0:
            centre_x = costmap.origin_x_m + (to_x + 0.5) * costmap.resolution_m
            centre_y = costmap.origin_y_m + (to_y + 0.5) * costmap.resolution_m
            turn = math.atan2(centre_y - y, centre_x - x) - theta
            return abs(math.atan2(math.sin(turn), math.cos(turn)))
    return _NO_LINE_OF_SIGHT


@njit(cache=True, nogil=True)
def trajectory(inputs: RolloutInputs, sample: Triple) -> Tuple[float, NDArray[np.float64]]:
    """Return the cost of a sample and its poses, float64[k, 3]; see ``simulate``."""
    row = np.array(sample)
    points = np.empty((step_count(inputs.params, row[0], row[1], row[2]), 3))
    cost, count = simulate(inputs, row, points)
    return cost, points[:count]


@njit(cache=True, nogil=True)
def score(
    inputs: RolloutInputs, samples: NDArray[np.float64]
) -> Tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Score samples, float64[n, 3].

    Returns:
        Costs, float64[n], and last poses, float64[n, 3], nan where the first pose fails.
    """
    points = np.empty((longest(inputs.params, samples), 3))
    costs = np.empty(samples.shape[0])
    ends = np.full((samples.shape[0], 3), np.nan)
    for k in range(samples.shape[0]):
        costs[k], count = simulate(inputs, samples[k], points)
        if count > 0:
            ends[k] = points[count - 1]
    return costs, ends


@njit(cache=True, nogil=True)
def cheapest(inputs: RolloutInputs, samples: NDArray[np.float64]) -> Tuple[int, float]:
    """Find the legal sample of lowest cost, the first of equals.

    Samples, float64[n, 3], are tried in the order of their least costs, until that is more than
    the best one's cost.

    Returns:
        Index and cost; the index is -1 if no sample is legal.
    """
    points = np.empty((longest(inputs.params, samples), 3))
    at_start = occupancy_at_start(inputs)
    best, best_cost = -1, np.inf
    if at_start < 0.0:
        return best, best_cost
    bounds = least_costs(inputs, samples, at_start, points)
    for _ in range(samples.shape[0]):
        k = int(np.argmin(bounds))
        if bounds[k] == np.inf or bounds[k] > best_cost:
            break
        cost, _ = cost_up_to(inputs, samples[k], at_start, best_cost, points)
        bounds[k] = np.inf
        if 0.0 <= cost < best_cost or (cost == best_cost and k < best):
            best, best_cost = k, cost
    return best, best_cost


@njit(cache=True, nogil=True)
def occupancy_at_start(inputs: RolloutInputs) -> float:
    """Return the occupancy at the pose, COLLIDES where the footprint does or off the map."""
    cell_x, cell_y = cell_of(inputs.costmap, inputs.pose[0], inputs.pose[1])
    if cell_x < 0 or cell_y < 0:
        return COLLIDES
    return _occupancy(inputs, inputs.pose, cell_x, cell_y, 0.0)


@njit(cache=True, nogil=True)
def _ends_decide(params: RolloutParams) -> bool:
    """Tell whether the cost is that of the last cell, plus no less than 0 for the occupancy."""
    return (
        params.occupancy_scale >= 0.0
        and not params.heading_scoring
        and not params.simple_attractor
        and min(params.acc_lim_x_mps2, params.acc_lim_y_mps2, params.acc_lim_theta_radps2) >= 0.0
    )


@njit(cache=True, nogil=True)
def least_costs(
    inputs: RolloutInputs,
    samples: NDArray[np.float64],
    at_start: float,
    points: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return the least that samples, float64[n, 3], cost if legal, inf for some that are not.

    That is the cost with the occupancy of the last cell alone, or without the footprint if other
    poses count as well; -inf if the footprint makes a sample cheaper. ``points``, float64[k, 3], is
    overwritten.
    """
    params = inputs.params
    bounds = np.full(samples.shape[0], -np.inf)
    if not params.occupancy_scale >= 0.0:
        return bounds
    if not _ends_decide(params):
        for k in range(samples.shape[0]):
            cost, _ = simulate(inputs, samples[k], points, False)
            bounds[k] = np.inf if cost == COLLIDES or cost == OUT_OF_REACH else cost
        return bounds
    size_x = inputs.costmap.costs.shape[1]
    cells = last_cells(params, inputs.costmap, inputs.pose, inputs.velocity, samples)
    for k in range(samples.shape[0]):
        cell = cells[k]
        if cell == UNCERTAIN:
            steps = travel(params, inputs.pose, inputs.velocity, samples[k], points)
            x, y = cell_of(inputs.costmap, points[steps - 1, 0], points[steps - 1, 1])
            cell = y * size_x + x if x >= 0 and y >= 0 else OFF_MAP
        bounds[k] = np.inf
        if cell != OFF_MAP:
            y, x = cell // size_x, cell % size_x
            occupancy = max(at_start, float(inputs.costmap.costs[y, x]))
            bounds[k] = _cost_of_end(inputs, x, y, occupancy)
    return bounds


@njit(cache=True, nogil=True)
def _cost_of_end(inputs: RolloutInputs, cell_x: int, cell_y: int, occupancy: float) -> float:
    """Return the cost of trajectories that end in a cell, infinite out of reach."""
    params = inputs.params
    path_distance = float(inputs.path_distance[cell_y, cell_x])
    goal_distance = float(inputs.goal_distance[cell_y, cell_x])
    if max(path_distance, goal_distance) >= inputs.path_distance.size:
        return np.inf
    return (
        params.path_scale * path_distance
        + goal_distance * params.goal_scale
        + params.occupancy_scale * occupancy
    )


@njit(cache=True, nogil=True)
def cost_up_to(
    inputs: RolloutInputs,
    sample: NDArray[np.float64],
    at_start: float,
    limit: float,
    points: NDArray[np.float64],
) -> Tuple[float, int]:
    """Return the cost of a sample as ``simulate`` does, or inf if it is more than a limit.

    Poses are examined from the last one on, where most trajectories fail that do. The occupancy at
    the robot's pose is known, 0 or more.
    """
    if not _ends_decide(inputs.params):
        return simulate(inputs, sample, points)
    steps = travel(inputs.params, inputs.pose, inputs.velocity, sample, points)
    occupancy, last_x, last_y = at_start, 0, 0
    for k in range(steps - 1, -1, -1):
        x, y, theta = points[k]
        cell_x, cell_y = cell_of(inputs.costmap, x, y)
        if cell_x < 0 or cell_y < 0:
            return np.inf, steps
        if k == steps - 1:
            last_x, last_y = cell_x, cell_y
        reach = max(inputs.path_distance[cell_y, cell_x], inputs.goal_distance[cell_y, cell_x])
        if reach >= inputs.path_distance.size:
            return np.inf, steps
        known = occupancy
        if k > 0:
            occupancy = _occupancy(inputs, (x, y, theta), cell_x, cell_y, occupancy)
        if occupancy == known:
            continue
        if occupancy < 0.0 or _cost_of_end(inputs, last_x, last_y, occupancy) > limit:
            return np.inf, steps
    return _cost_of_end(inputs, last_x, last_y, occupancy), steps
