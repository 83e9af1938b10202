"""Forward samples and turns in place of the trajectory planner, and the best of them.

``control/velocity_search.py`` has the rules.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.control.rollout_kernel import (
    RolloutInputs,
    cheapest,
    cost_up_to,
    least_costs,
    occupancy_at,
)
from quad_nav.control.sample_motion import RolloutParams, longest
from quad_nav.costmap.collision import Triple
from quad_nav.costmap.cost_grid_kernel import cell_of
from quad_nav.files.kernel_cache import njit

NO_SAMPLE = -1.0


class VelocityWindow(NamedTuple):
    """Velocities that can be reached."""

    min_vx_mps: float
    max_vx_mps: float
    min_vtheta_radps: float
    max_vtheta_radps: float


class SampleRules(NamedTuple):
    """Samples of a window, and which of them are tried."""

    vx_samples: int
    vtheta_samples: int
    holonomic: bool  # try two diagonals
    goes_forward: bool  # False to try only turns in place
    slowest_turn_radps: float  # slower turns in place are as fast as this
    lookahead_m: float  # turns in place are compared by the cell so far ahead
    stuck_left: bool  # forbids turns in place of negative vtheta
    stuck_right: bool  # forbids turns in place of positive vtheta


@njit(cache=True, nogil=True)
def search(
    inputs: RolloutInputs,
    params: RolloutParams,
    pose: Triple,
    velocity: Triple,
    window: VelocityWindow,
    rules: SampleRules,
) -> Tuple[Triple, float, float]:
    """Find the best forward sample or turn in place.

    Args:
        inputs: Costmap, footprint and plan.
        params: Parameters of the rollout.
        pose: Pose of the robot.
        velocity: Velocity of the robot.
        window: Velocities that can be reached.
        rules: Samples to try.

    Returns:
        The sample, its cost, NO_SAMPLE if none is legal, and the distance to the goal, in cells,
        of the cell that it ends facing, inf for a forward sample.
    """
    thetas, theta_step = spaced(
        window.min_vtheta_radps, window.max_vtheta_radps, rules.vtheta_samples
    )
    sample, cost = (0.0, 0.0, 0.0), NO_SAMPLE
    if rules.goes_forward:
        samples = forward_samples(window, thetas, rules)
        k, least = cheapest(inputs, params, pose, velocity, samples)
        if k >= 0:
            sample, cost = (samples[k, 0], samples[k, 1], samples[k, 2]), least
    limit = cost if cost >= 0.0 and sample[1] == 0.0 else np.inf
    turns = turns_in_place(thetas, theta_step, rules)
    k, least, facing = best_turn(inputs, params, pose, velocity, turns, limit, rules.lookahead_m)
    if k >= 0:
        sample, cost = (0.0, 0.0, turns[k, 2]), least
    return sample, cost, facing


@njit(cache=True, nogil=True)
def spaced(start: float, end: float, count: int) -> Tuple[NDArray[np.float64], float]:
    """Return ``count`` values from start to end, float64[n], and their step.

    The step is infinite for one value. Values are summed step by step, because equal costs are
    common and the last bit of a sample decides between them.
    """
    count = max(count, 1)
    values = np.empty(count)
    values[0] = start
    if count == 1:
        return values, np.inf
    step = (end - start) / (count - 1)
    for k in range(1, count):
        values[k] = values[k - 1] + step
    return values, step


@njit(cache=True, nogil=True)
def forward_samples(
    window: VelocityWindow, thetas: NDArray[np.float64], rules: SampleRules
) -> NDArray[np.float64]:
    """Return float64[n, 3]: for each vx straight ahead, then all vtheta but the last."""
    speeds, _ = spaced(window.min_vx_mps, window.max_vx_mps, rules.vx_samples)
    in_grid = speeds.size * thetas.size
    samples = np.zeros((in_grid + 2 if rules.holonomic else in_grid, 3))
    for k in range(in_grid):
        samples[k, 0] = speeds[k // thetas.size]
        turn = k % thetas.size
        samples[k, 2] = thetas[turn - 1] if turn > 0 else 0.0
    if rules.holonomic:
        samples[in_grid, 0], samples[in_grid, 1] = 0.1, 0.1
        samples[in_grid + 1, 0], samples[in_grid + 1, 1] = 0.1, -0.1
    return samples


@njit(cache=True, nogil=True)
def turns_in_place(
    thetas: NDArray[np.float64], theta_step: float, rules: SampleRules
) -> NDArray[np.float64]:
    """Return the turns that are fast enough and allowed, float64[n, 3]."""
    turns = np.zeros((thetas.size, 3))
    count = 0
    for theta in thetas:
        is_stuck = rules.stuck_left if theta < 0.0 else rules.stuck_right
        if is_stuck or not abs(theta) > theta_step:
            continue
        slowest = rules.slowest_turn_radps
        turns[count, 2] = max(theta, slowest) if theta > 0.0 else min(theta, -slowest)
        count += 1
    return turns[:count]


@njit(cache=True, nogil=True)
def best_turn(
    inputs: RolloutInputs,
    params: RolloutParams,
    pose: Triple,
    velocity: Triple,
    turns: NDArray[np.float64],
    limit: float,
    lookahead_m: float,
) -> Tuple[int, float, float]:
    """Find the turn that ends facing the cell nearest to the goal.

    Args:
        inputs: Costmap, footprint and plan.
        params: Parameters of the rollout.
        pose: Pose of the robot.
        velocity: Velocity of the robot.
        turns: float64[n, 3].
        limit: Highest cost of the first turn; each may cost no more than the one before.
        lookahead_m: Distance of the faced cell.

    Returns:
        Index, cost and distance in cells; (-1, inf, inf) if no turn is legal.
    """
    best, best_cost, facing = -1, limit, np.inf
    at_start = occupancy_at(inputs, pose)
    if at_start < 0.0:
        return best, np.inf, facing
    points = np.empty((longest(params, turns), 3))
    bounds = least_costs(inputs, params, pose, velocity, turns, at_start, points)
    for k in range(turns.shape[0]):
        if bounds[k] == np.inf or bounds[k] > best_cost:
            continue
        cost, count = cost_up_to(
            inputs, params, pose, velocity, turns[k], at_start, best_cost, points
        )
        if not 0.0 <= cost <= best_cost or cost == np.inf:
            continue
        x, y, theta = points[count - 1]
        cell_x, cell_y = cell_of(
            inputs.costmap, x + math.cos(theta) * lookahead_m, y + math.sin(theta) * lookahead_m
        )
        if cell_x >= 0 and cell_y >= 0 and inputs.goal_distance[cell_y, cell_x] < facing:
            best, best_cost = k, cost
            facing = float(inputs.goal_distance[cell_y, cell_x])
    return best, best_cost, facing
