"""Dynamic window controller: find the cheapest sample.

``control/dwa_critics.py`` has the maths. Where a sample ends gives the least that it costs; samples
are tried in that order until the least is more than the best cost so far.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.control.dwa_kernel import (
    ALIGNMENT,
    GOAL,
    GOAL_FRONT,
    PATH,
    MapGrids,
    Motion,
    Obstacles,
    command_of,
    cost_of_pose,
    is_within_reach,
    longest,
    obstacle_cost,
    simulate,
    step_count,
    total_cost,
)
from quad_nav.control.lanes import (
    LANES,
    LAST,
    OFF_MAP,
    ROWS,
    TURN,
    X,
    Y,
    cell_of_end,
    doubt_of,
    fill_lane,
    travel_lanes,
)
from quad_nav.costmap.collision import Triple
from quad_nav.costmap.cost_grid_kernel import CostmapView
from quad_nav.files.kernel_cache import njit

TERMS = 5  # parts of the cost beside the obstacles': goal_front, alignment, path, goal, twirling
_ROUNDING = 1e-7  # of single precision, with room


class Weights(NamedTuple):
    """Weights of the critics but the obstacles', and what decides the footprint's size."""

    path_scale: float  # per cell
    goal_scale: float  # per cell
    twirling_scale: float
    scaling_speed_mps: float
    max_scaling_factor: float
    max_vel_trans_mps: float


class Directions(NamedTuple):
    """Directions that the oscillation critic allows, each of x, y, theta."""

    positive_only: Tuple[bool, bool, bool]
    negative_only: Tuple[bool, bool, bool]


class Critics(NamedTuple):
    """State of the robot that samples begin with, and what they are scored against."""

    pose: Triple
    velocity: Triple
    motion: Motion
    grids: MapGrids
    obstacles: Obstacles
    weights: Weights
    directions: Directions


@njit(cache=True, nogil=True)
def cheapest(critics: Critics, samples: NDArray[np.float64]) -> Tuple[int, float]:
    """Find the legal sample, of float64[n, 3], of lowest cost, the first of equals.

    Returns:
        Index and cost; (-1, inf) if no sample is legal.
    """
    motion, obstacles, weights = critics.motion, critics.obstacles, critics.weights
    points = np.empty((longest(motion, samples), 3))
    terms = np.empty(TERMS)
    bounds = least_costs(critics, samples, points)
    best, best_cost = -1, np.inf
    for _ in range(samples.shape[0]):
        k = int(np.argmin(bounds))
        if bounds[k] == np.inf or bounds[k] > best_cost:
            break
        bounds[k] = np.inf
        count, command = simulate(motion, critics.pose, critics.velocity, samples[k], points)
        distances = np.zeros(4)
        if not is_within_reach(critics.grids, points, count, distances):
            continue
        fill_terms(weights, distances, command, terms)
        cost = total_cost(0.0, terms)
        if obstacles.scale != 0.0:
            scale = footprint_scale(weights, command)
            obstacle = obstacle_cost(obstacles, scale, points, count, terms, best_cost)
            if obstacle < 0.0:
                continue
            cost = total_cost(obstacles.scale * obstacle, terms)
        if cost < best_cost or (cost == best_cost and k < best):
            best, best_cost = k, cost
    return best, best_cost


@njit(cache=True, nogil=True)
def footprint_scale(weights: Weights, command: Triple) -> float:
    """Return the factor of the footprint's size at a command."""
    speed = math.hypot(command[0], command[1])
    if not speed > weights.scaling_speed_mps:
        return 1.0
    room_mps = weights.max_vel_trans_mps - weights.scaling_speed_mps
    if room_mps == 0.0:
        return np.inf
    share = (speed - weights.scaling_speed_mps) / room_mps
    return weights.max_scaling_factor * share + 1.0


@njit(cache=True, nogil=True)
def fill_terms(
    weights: Weights, distances: NDArray[np.float64], command: Triple, terms: NDArray[np.float64]
) -> None:
    """Fill float64[TERMS], the critics' costs but the obstacles', from distances, float64[4]."""
    terms[GOAL_FRONT] = distances[GOAL_FRONT] * weights.goal_scale
    terms[ALIGNMENT] = distances[ALIGNMENT] * weights.path_scale
    terms[PATH] = distances[PATH] * weights.path_scale
    terms[GOAL] = distances[GOAL] * weights.goal_scale
    terms[TERMS - 1] = weights.twirling_scale * abs(command[2])


@njit(cache=True, nogil=True)
def largest_footprint_scale(
    motion: Motion, weights: Weights, velocity: Triple, samples: NDArray[np.float64]
) -> float:
    """Return the largest finite factor of the footprint's size of any sample, at least 1."""
    largest = 1.0
    for k in range(samples.shape[0]):
        steps = step_count(motion, samples[k])
        scale = abs(footprint_scale(weights, command_of(motion, velocity, samples[k], steps)))
        if math.isfinite(scale):
            largest = max(largest, scale)
    return largest


@njit(cache=True, nogil=True)
def is_forbidden(directions: Directions, command: Triple) -> bool:
    """Tell whether a command goes in a direction that is not allowed."""
    for k in range(3):
        if (command[k] < 0.0 and directions.positive_only[k]) or (
            command[k] > 0.0 and directions.negative_only[k]
        ):
            return True
    return False


@njit(cache=True, nogil=True)
def least_costs(
    critics: Critics, samples: NDArray[np.float64], points: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the least that samples, float64[n, 3], cost if legal, inf for some that are not.

    That is the cost of the last pose; of obstacles, those under the first pose and in the last
    pose's cell count. ``points``, float64[k, 3], is overwritten.
    """
    motion, pose, velocity = critics.motion, critics.pose, critics.velocity
    bounds = np.full(samples.shape[0], np.inf)
    tried = np.empty(LANES, np.int64)
    is_certain = np.empty(LANES, np.bool_)
    state = np.zeros(ROWS * LANES)
    distances, terms = np.empty(4), np.empty(TERMS)
    # Without acceleration lanes begin with the sample's velocity: any limit keeps it.
    limits = motion.acceleration_limits
    at_start = np.empty(LANES)
    obstacles, scale, cost = critics.obstacles, np.nan, 0.0
    filled = 0
    for k in range(samples.shape[0]):
        sample = samples[k, 0], samples[k, 1], samples[k, 2]
        steps = step_count(motion, samples[k])
        command = command_of(motion, velocity, samples[k], steps)
        if steps > 0 and not is_forbidden(critics.directions, command):
            dt = motion.sim_time_s / steps
            if obstacles.scale > 0.0 and footprint_scale(critics.weights, command) != scale:
                scale = footprint_scale(critics.weights, command)
                cost = cost_of_pose(obstacles, obstacles.footprint * scale, pose, 0.0)
            tried[filled] = k
            at_start[filled] = cost
            is_certain[filled] = fill_lane(state, filled, pose[2], command, sample, dt, steps - 1)
            filled += 1
        if filled == LANES or k == samples.shape[0] - 1:
            travel_lanes(state, limits)
            for i in range(filled):
                if at_start[i] < 0.0:
                    continue
                bound, is_known = _cost_of_end(
                    critics, samples[tried[i]], at_start[i], state, i, distances, terms
                )
                if not (is_known and is_certain[i]):
                    bound = _cost_of_last(critics, samples[tried[i]], points)
                bounds[tried[i]] = bound
            filled = 0
    return bounds


@njit(cache=True, nogil=True)
def _cell_at(costmap: CostmapView, x_m: float, y_m: float, doubt: float) -> Tuple[int, int]:
    """Return the column and the row of an end in the costmap's frame, see ``cell_of_end``."""
    return cell_of_end(
        (x_m - costmap.origin_x_m) / costmap.resolution_m,
        (y_m - costmap.origin_y_m) / costmap.resolution_m,
        costmap.costs.shape,
        doubt,
    )


@njit(cache=True, nogil=True)
def _cost_of_end(
    critics: Critics,
    sample: NDArray[np.float64],
    obstacle: float,
    state: NDArray[np.float64],
    lane: int,
    distances: NDArray[np.float64],
    terms: NDArray[np.float64],
) -> Tuple[float, bool]:
    """Return the least cost of a sample by where its lane ends, and whether that is certain.

    The obstacle's cost given is that under the first pose, or 0. distances, float64[4], and terms,
    float64[TERMS], are overwritten.
    """
    grids, costmap = critics.grids, critics.grids.costmap
    pose, velocity = critics.pose, critics.velocity
    resolution_m, forward_m = costmap.resolution_m, grids.forward_point_distance_m
    way_m = critics.motion.sim_time_s * (
        max(abs(sample[0]), abs(velocity[0])) + max(abs(sample[1]), abs(velocity[1]))
    )
    heading, last = abs(pose[2]) + abs(state[TURN + lane]), state[LAST + lane]
    farthest = (max(abs(pose[0]), abs(pose[1])) + way_m) / resolution_m
    x, y = pose[0] + state[X + lane], pose[1] + state[Y + lane]
    distances[:] = 0.0
    if grids.follows_path or grids.follows_goal:
        doubt = doubt_of(_ROUNDING, last, farthest, way_m / resolution_m, heading)
        cell_x, cell_y = _cell_at(costmap, x, y, doubt)
        if cell_x < 0:
            return np.inf, cell_x == OFF_MAP
        if grids.follows_path:
            distances[PATH] = grids.path[cell_y, cell_x]
        if grids.follows_goal:
            distances[GOAL] = grids.goal[cell_y, cell_x]
        if max(distances[PATH], distances[GOAL]) >= grids.path.size:
            return np.inf, True
        obstacle = max(obstacle, float(costmap.costs[cell_y, cell_x]))
    if grids.follows_goal or grids.aligns:
        doubt = doubt_of(
            _ROUNDING, last, farthest, (way_m + abs(forward_m)) / resolution_m, heading
        )
        theta = pose[2] + state[TURN + lane]
        x, y = x + forward_m * math.cos(theta), y + forward_m * math.sin(theta)
        cell_x, cell_y = _cell_at(costmap, x, y, doubt)
        if cell_x < 0:
            return np.inf, cell_x == OFF_MAP
        if grids.follows_goal:
            distances[GOAL_FRONT] = grids.goal_front[cell_y, cell_x]
        if grids.aligns:
            distances[ALIGNMENT] = grids.path[cell_y, cell_x]
    steps = step_count(critics.motion, sample)
    command = command_of(critics.motion, velocity, sample, steps)
    fill_terms(critics.weights, distances, command, terms)
    return total_cost(max(critics.obstacles.scale, 0.0) * obstacle, terms), True


@njit(cache=True, nogil=True)
def _cost_of_last(
    critics: Critics, sample: NDArray[np.float64], points: NDArray[np.float64]
) -> float:
    """Return the cost of a sample, float64[3], without obstacles, inf if it is illegal."""
    distances, terms = np.zeros(4), np.empty(TERMS)
    count, command = simulate(critics.motion, critics.pose, critics.velocity, sample, points)
    if not is_within_reach(critics.grids, points, count, distances):
        return np.inf
    fill_terms(critics.weights, distances, command, terms)
    return total_cost(0.0, terms)
