"""Trajectory rollout: simulate velocity samples and score them.

``control/rollout.py`` has the maths. Poses and velocities of the robot are triples: x, y in metres
and yaw in the costmap's frame; vx, vy in m/s and vtheta in rad/s in the robot's frame.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.grid import INSCRIBED
from quad_nav.kernels.collision import COLLIDES, Triple, footprint_cost, line_cost
from quad_nav.kernels.cost_grid import CostmapView, cell_of
from quad_nav.kernels.jit import njit

OUT_OF_REACH = -2.0  # the cost of a trajectory that leaves the reach of path or goal
_NO_LINE_OF_SIGHT = 1.7976931348623157e308
_HEADING_SCALE = 0.3


class RolloutInputs(NamedTuple):
    """Costmap, footprint and plan that trajectories are scored against."""

    costmap: CostmapView
    highest_near: NDArray[np.uint8]  # [H, W], no less than the highest cost under the footprint
    footprint: NDArray[np.float64]  # [n, 2], robot frame
    path_distance: NDArray[np.int32]  # [H, W]
    goal_distance: NDArray[np.int32]  # [H, W]
    plan: NDArray[np.float64]  # [m, 2], m >= 1


class RolloutParams(NamedTuple):
    """Parameters of simulation and scoring."""

    sim_time_s: float
    sim_granularity_m: float
    angular_sim_granularity_rad: float
    acc_lim_x_mps2: float
    acc_lim_y_mps2: float
    acc_lim_theta_radps2: float
    path_scale: float
    goal_scale: float
    occupancy_scale: float
    heading_scoring: bool
    heading_scoring_timestep_s: float
    simple_attractor: bool


@njit(cache=True, nogil=True)
def step_count(params: RolloutParams, sample: NDArray[np.float64]) -> int:
    """Count the steps of the simulation of a sample, float64[3]; at least 1."""
    if params.heading_scoring:
        steps = int(params.sim_time_s / params.sim_granularity_m + 0.5)
    else:
        speed = math.hypot(sample[0], sample[1])
        steps = int(
            max(
                speed * params.sim_time_s / params.sim_granularity_m,
                abs(sample[2]) / params.angular_sim_granularity_rad,
            )
            + 0.5
        )
    return max(steps, 1)


@njit(cache=True, nogil=True)
def turn(
    params: RolloutParams, theta: float, vtheta: float, wanted: float, headings: NDArray[np.float64]
) -> None:
    """Fill headings, float64[steps, 3], with the yaw at each step, its cosine and its sine."""
    steps = headings.shape[0]
    dt = params.sim_time_s / steps
    for k in range(steps):
        headings[k, 0], headings[k, 1], headings[k, 2] = theta, math.cos(theta), math.sin(theta)
        vtheta = _approach(wanted, vtheta, params.acc_lim_theta_radps2 * dt)
        theta += vtheta * dt


@njit(cache=True, nogil=True)
def simulate(
    inputs: RolloutInputs,
    params: RolloutParams,
    pose: Triple,
    velocity: Triple,
    sample: NDArray[np.float64],
    headings: NDArray[np.float64],
    points: NDArray[np.float64],
    with_footprint: bool = True,
) -> Tuple[float, int]:
    """Simulate and score a sample.

    Args:
        inputs: Costmap, footprint and plan.
        params: Parameters.
        pose: Pose of the robot.
        velocity: Velocity of the robot.
        sample: float64[3], vx, vy, vtheta.
        headings: float64[steps, 3], filled by ``turn`` for the sample.
        points: float64[k, 3], filled with poses; ends before a pose that fails.
        with_footprint: False to leave out the costs under the footprint.

    Returns:
        The cost, COLLIDES (also off the map) or OUT_OF_REACH, and the number of poses.
    """
    steps = headings.shape[0]
    dt = params.sim_time_s / steps
    x, y = pose[0], pose[1]
    vx, vy = velocity[0], velocity[1]
    path_distance, goal_distance, occupancy, heading, time = 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(steps):
        theta, cos, sin = headings[k]
        cell_x, cell_y = cell_of(inputs.costmap, x, y)
        if cell_x < 0 or cell_y < 0:
            return COLLIDES, k
        # Where nothing near costs more than what is known the footprint changes nothing.
        if with_footprint and inputs.highest_near[cell_y, cell_x] > occupancy:
            cost = footprint_cost(inputs.costmap, inputs.footprint, x, y, theta)
            if cost < 0.0:
                return COLLIDES, k
            occupancy = max(occupancy, cost, float(inputs.costmap.costs[cell_y, cell_x]))
        if params.simple_attractor:
            goal_distance = (x - inputs.plan[-1, 0]) ** 2 + (y - inputs.plan[-1, 1]) ** 2
        elif not params.heading_scoring or _is_heading_step(params, time, dt):
            if params.heading_scoring:
                heading = _heading_difference(inputs, cell_x, cell_y, x, y, theta)
            path_distance = float(inputs.path_distance[cell_y, cell_x])
            goal_distance = float(inputs.goal_distance[cell_y, cell_x])
            if max(path_distance, goal_distance) >= inputs.path_distance.size:
                return OUT_OF_REACH, k
        points[k, 0], points[k, 1], points[k, 2] = x, y, theta
        vx = _approach(sample[0], vx, params.acc_lim_x_mps2 * dt)
        vy = _approach(sample[1], vy, params.acc_lim_y_mps2 * dt)
        speed_x, speed_y = vx * cos, vx * sin
        if vy != 0.0:
            side = math.pi / 2 + theta
            speed_x += vy * math.cos(side)
            speed_y += vy * math.sin(side)
        x += speed_x * dt
        y += speed_y * dt
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
def _approach(wanted: float, current: float, max_change: float) -> float:
    if wanted >= current:
        return min(wanted, current + max_change)
    return max(wanted, current - max_change)


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
def score(
    inputs: RolloutInputs,
    params: RolloutParams,
    pose: Triple,
    velocity: Triple,
    samples: NDArray[np.float64],
    limit: float,
) -> Tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Score samples.

    Args:
        inputs: Costmap, footprint and plan.
        params: Parameters.
        pose: Pose of the robot.
        velocity: Velocity of the robot.
        samples: float64[n, 3].
        limit: Samples known to cost more get an infinite cost.

    Returns:
        Costs, float64[n], and last poses, float64[n, 3], nan where the first pose fails.
    """
    headings, places = _all_turns(params, pose, velocity, samples)
    points = np.empty((headings.shape[1], 3))
    bounds = _lower_bounds(inputs, params, pose, velocity, samples, headings, places, points)
    costs = np.empty(samples.shape[0])
    ends = np.full((samples.shape[0], 3), np.nan)
    for k in range(samples.shape[0]):
        if bounds[k] > limit:
            costs[k] = np.inf
            continue
        turned = headings[places[k], : step_count(params, samples[k])]
        costs[k], count = simulate(inputs, params, pose, velocity, samples[k], turned, points)
        if count > 0:
            ends[k] = points[count - 1]
    return costs, ends


@njit(cache=True, nogil=True)
def cheapest(
    inputs: RolloutInputs,
    params: RolloutParams,
    pose: Triple,
    velocity: Triple,
    samples: NDArray[np.float64],
) -> Tuple[int, float]:
    """Find the legal sample of lowest cost, the first of equals.

    Samples, float64[n, 3], are tried in the order of their costs without the footprint, which is
    the slow part, until that is more than the best one's cost.

    Returns:
        Index and cost; the index is -1 if no sample is legal.
    """
    headings, places = _all_turns(params, pose, velocity, samples)
    points = np.empty((headings.shape[1], 3))
    bounds = _lower_bounds(inputs, params, pose, velocity, samples, headings, places, points)
    best, best_cost = -1, np.inf
    for k in np.argsort(bounds, kind="mergesort"):
        if bounds[k] > best_cost:
            break
        if bounds[k] == COLLIDES or bounds[k] == OUT_OF_REACH:
            continue
        turned = headings[places[k], : step_count(params, samples[k])]
        cost, _ = simulate(inputs, params, pose, velocity, samples[k], turned, points)
        if cost >= 0.0 and (cost < best_cost or (cost == best_cost and k < best)):
            best, best_cost = k, cost
    return best, best_cost


@njit(cache=True, nogil=True)
def _lower_bounds(
    inputs: RolloutInputs,
    params: RolloutParams,
    pose: Triple,
    velocity: Triple,
    samples: NDArray[np.float64],
    headings: NDArray[np.float64],
    places: NDArray[np.int64],
    points: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return the least costs of samples, float64[n]: without the footprint, if that only adds."""
    bounds = np.full(samples.shape[0], -np.inf)
    if params.occupancy_scale >= 0.0:
        for k in range(samples.shape[0]):
            turned = headings[places[k], : step_count(params, samples[k])]
            bounds[k], _ = simulate(
                inputs, params, pose, velocity, samples[k], turned, points, False
            )
    return bounds


@njit(cache=True, nogil=True)
def _all_turns(
    params: RolloutParams, pose: Triple, velocity: Triple, samples: NDArray[np.float64]
) -> Tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return ``turn`` of all samples, float64[m, longest, 3], and the row of each, int64[n].

    Many samples turn in the same way, with as many steps.
    """
    longest = 1
    for k in range(samples.shape[0]):
        longest = max(longest, step_count(params, samples[k]))
    turns = np.empty((samples.shape[0], 2))
    places = np.empty(samples.shape[0], dtype=np.int64)
    known = 0
    for k in range(samples.shape[0]):
        steps, vtheta = step_count(params, samples[k]), samples[k, 2]
        places[k] = -1
        for place in range(known):
            if turns[place, 0] == steps and turns[place, 1] == vtheta:
                places[k] = place
                break
        if places[k] < 0:
            places[k] = known
            turns[known, 0], turns[known, 1] = steps, vtheta
            known += 1
    headings = np.empty((known, longest, 3))
    for place in range(known):
        turn(params, pose[2], velocity[2], turns[place, 1], headings[place, : int(turns[place, 0])])
    return headings, places
