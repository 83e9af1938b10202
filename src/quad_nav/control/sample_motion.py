"""Motion of the trajectory planner's samples: their poses, and the cells where they end.

``control/rollout.py`` has the maths. Poses and velocities of the robot are triples: x, y in metres
and yaw in the costmap's frame; vx, vy in m/s and vtheta in rad/s in the robot's frame.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.control.lanes import (
    LANES,
    LAST,
    ROWS,
    TURN,
    UNCERTAIN,
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

_ROUNDING = 1e-15  # of a double, with room


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
def step_count(params: RolloutParams, vx: float, vy: float, vtheta: float) -> int:
    """Count the steps of the simulation of a sample; at least 1."""
    if params.heading_scoring:
        steps = int(params.sim_time_s / params.sim_granularity_m + 0.5)
    else:
        speed = math.hypot(vx, vy) if vy != 0.0 else abs(vx)
        steps = int(
            max(
                speed * params.sim_time_s / params.sim_granularity_m,
                abs(vtheta) / params.angular_sim_granularity_rad,
            )
            + 0.5
        )
    return max(steps, 1)


@njit(cache=True, nogil=True)
def longest(params: RolloutParams, samples: NDArray[np.float64]) -> int:
    """Return the most steps of any sample, float64[n, 3]; at least 1."""
    steps = 1
    for k in range(samples.shape[0]):
        steps = max(steps, step_count(params, samples[k, 0], samples[k, 1], samples[k, 2]))
    return steps


@njit(cache=True, nogil=True)
def travel(
    params: RolloutParams,
    pose: Triple,
    velocity: Triple,
    sample: NDArray[np.float64],
    points: NDArray[np.float64],
) -> int:
    """Simulate a sample, float64[3], from the robot's pose and velocity.

    Returns:
        The number of poses, which fill float64[k, 3].
    """
    steps = step_count(params, sample[0], sample[1], sample[2])
    dt = params.sim_time_s / steps
    x, y, theta = pose
    vx, vy, vtheta = velocity
    for k in range(steps):
        points[k, 0], points[k, 1], points[k, 2] = x, y, theta
        vx = _approach(sample[0], vx, params.acc_lim_x_mps2 * dt)
        vy = _approach(sample[1], vy, params.acc_lim_y_mps2 * dt)
        vtheta = _approach(sample[2], vtheta, params.acc_lim_theta_radps2 * dt)
        speed_x, speed_y = vx * math.cos(theta), vx * math.sin(theta)
        if vy != 0.0:
            side = math.pi / 2 + theta
            speed_x += vy * math.cos(side)
            speed_y += vy * math.sin(side)
        x += speed_x * dt
        y += speed_y * dt
        theta += vtheta * dt
    return steps


@njit(cache=True, nogil=True)
def _approach(wanted: float, current: float, max_change: float) -> float:
    if wanted >= current:
        return min(wanted, current + max_change)
    return max(wanted, current - max_change)


@njit(cache=True, nogil=True)
def last_cells(
    params: RolloutParams,
    costmap: CostmapView,
    pose: Triple,
    velocity: Triple,
    samples: NDArray[np.float64],
) -> NDArray[np.int64]:
    """Find the cells of the samples' last poses without the poses before.

    Acceleration limits are 0 or more, samples float64[n, 3].

    Returns:
        int64[n], flat cells; OFF_MAP off the map, UNCERTAIN within rounding of a cell's border.
    """
    cells = np.full(samples.shape[0], UNCERTAIN, np.int64)
    limits = params.acc_lim_x_mps2, params.acc_lim_y_mps2, params.acc_lim_theta_radps2
    resolution_m = costmap.resolution_m
    start_x = (pose[0] - costmap.origin_x_m) / resolution_m
    start_y = (pose[1] - costmap.origin_y_m) / resolution_m
    state = np.empty(ROWS * LANES)
    is_certain = np.empty(LANES, np.bool_)
    for first in range(0, samples.shape[0], LANES):
        for i in range(LANES):
            k = min(first + i, samples.shape[0] - 1)
            vx, vy, vtheta = samples[k, 0], samples[k, 1], samples[k, 2]
            steps = step_count(params, vx, vy, vtheta)
            dt = params.sim_time_s / steps
            is_certain[i] = fill_lane(state, i, pose[2], velocity, (vx, vy, vtheta), dt, steps - 1)
        travel_lanes(state, limits)
        for i in range(min(LANES, samples.shape[0] - first)):
            if not is_certain[i]:
                continue
            way_x, way_y = state[X + i] / resolution_m, state[Y + i] / resolution_m
            fastest = max(abs(velocity[0]), abs(samples[first + i, 0])) + max(
                abs(velocity[1]), abs(samples[first + i, 1])
            )
            doubt = doubt_of(
                _ROUNDING,
                state[LAST + i],
                max(abs(pose[0]), abs(pose[1])) / resolution_m,
                fastest * params.sim_time_s / resolution_m,
                abs(pose[2]) + abs(state[TURN + i]),
            )
            x, y = cell_of_end(start_x + way_x, start_y + way_y, costmap.costs.shape, doubt)
            cells[first + i] = y * costmap.costs.shape[1] + x if x >= 0 else x
    return cells
