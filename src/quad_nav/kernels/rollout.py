"""Loops of the trajectory rollout: simulate a velocity sample and score it.

The maths is in ``control/rollout.py``.
"""
from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from quad_nav.grid import INSCRIBED
from quad_nav.kernels.collision import COLLIDES, Window, cell_of, footprint_cost, line_cost

NO_WAY = -2.0  # the cost of a trajectory that leaves the reach of path or goal
_NO_LINE_OF_SIGHT = 1.7976931348623157e308
_HEADING_SCALE = 0.3


class Scene(NamedTuple):
    """What trajectories are scored against."""

    window: Window
    highest_near: np.ndarray   # uint8[H, W], no less than the highest cost under the footprint
    footprint: np.ndarray      # float64[n, 2], robot frame
    path_distance: np.ndarray  # int32[H, W]
    goal_distance: np.ndarray  # int32[H, W]
    plan: np.ndarray           # float64[m, 2], m >= 1


class Rules(NamedTuple):
    """How they are simulated and scored."""

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
def step_count(rules, sample):
    """Into how many steps the simulation of a sample (vx, vy, vtheta) is cut."""
    if rules.heading_scoring:
        steps = int(rules.sim_time_s / rules.sim_granularity_m + 0.5)
    else:
        speed = math.hypot(sample[0], sample[1])
        steps = int(max(speed * rules.sim_time_s / rules.sim_granularity_m,
                        abs(sample[2]) / rules.angular_sim_granularity_rad) + 0.5)
    return max(steps, 1)


@njit(cache=True, nogil=True)
def simulate(scene, rules, pose, velocity, sample, points):
    """Cost of one sample and the number of poses written to ``points``, float64[k, 3].

    Negative cost: COLLIDES (or off the map) and NO_WAY; ``points`` then ends
    before the pose that failed.
    """
    steps = step_count(rules, sample)
    dt = rules.sim_time_s / steps
    x, y, theta = pose
    vx, vy, vtheta = velocity
    path_distance, goal_distance, occupancy, heading, time = 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(steps):
        cell_x, cell_y = cell_of(scene.window, x, y)
        if cell_x < 0 or cell_y < 0:
            return COLLIDES, k
        if scene.highest_near[cell_y, cell_x] > occupancy:  # else the footprint changes nothing
            cost = footprint_cost(scene.window, scene.footprint, x, y, theta)
            if cost < 0.0:
                return COLLIDES, k
            occupancy = max(occupancy, cost, float(scene.window.costs[cell_y, cell_x]))
        if rules.simple_attractor:
            goal_distance = (x - scene.plan[-1, 0]) ** 2 + (y - scene.plan[-1, 1]) ** 2
        elif not rules.heading_scoring or _is_heading_step(rules, time, dt):
            if rules.heading_scoring:
                heading = _heading_difference(scene, cell_x, cell_y, x, y, theta)
            path_distance = float(scene.path_distance[cell_y, cell_x])
            goal_distance = float(scene.goal_distance[cell_y, cell_x])
            if max(path_distance, goal_distance) >= scene.path_distance.size:
                return NO_WAY, k
        points[k, 0], points[k, 1], points[k, 2] = x, y, theta
        vx = _approach(sample[0], vx, rules.acc_lim_x_mps2 * dt)
        vy = _approach(sample[1], vy, rules.acc_lim_y_mps2 * dt)
        vtheta = _approach(sample[2], vtheta, rules.acc_lim_theta_radps2 * dt)
        side = math.pi / 2 + theta
        x, y = (x + (vx * math.cos(theta) + vy * math.cos(side)) * dt,
                y + (vx * math.sin(theta) + vy * math.sin(side)) * dt)
        theta += vtheta * dt
        time += dt
    if rules.heading_scoring:
        return (rules.occupancy_scale * occupancy + rules.path_scale * path_distance
                + _HEADING_SCALE * heading + goal_distance * rules.goal_scale), steps
    return (rules.path_scale * path_distance + goal_distance * rules.goal_scale
            + rules.occupancy_scale * occupancy), steps


@njit(cache=True, nogil=True)
def _approach(wanted, current, max_change):
    if wanted >= current:
        return min(wanted, current + max_change)
    return max(wanted, current - max_change)


@njit(cache=True, nogil=True)
def _is_heading_step(rules, time, dt):
    start = rules.heading_scoring_timestep_s
    return start <= time < start + dt


@njit(cache=True, nogil=True)
def _heading_difference(scene, cell_x, cell_y, x, y, theta):
    """Angle to the farthest plan point in sight of a cell; huge when there is none."""
    window = scene.window
    for k in range(scene.plan.shape[0] - 1, -1, -1):
        to_x, to_y = cell_of(window, scene.plan[k, 0], scene.plan[k, 1])
        if to_x < 0 or to_y < 0:
            continue
        if line_cost(window.costs, cell_x, cell_y, to_x, to_y, INSCRIBED) >= 0.0:
            centre_x = window.origin_x_m + (to_x + 0.5) * window.resolution_m
            centre_y = window.origin_y_m + (to_y + 0.5) * window.resolution_m
            turn = math.atan2(centre_y - y, centre_x - x) - theta
            return abs(math.atan2(math.sin(turn), math.cos(turn)))
    return _NO_LINE_OF_SIGHT


@njit(cache=True, nogil=True)
def score(scene, rules, pose, velocity, samples):
    """Cost float64[n] and last pose float64[n, 3] of each sample, float64[n, 3].

    The last pose is nan for a sample whose first pose fails.
    """
    longest = 1
    for k in range(samples.shape[0]):
        longest = max(longest, step_count(rules, samples[k]))
    points = np.empty((longest, 3))
    costs = np.empty(samples.shape[0])
    ends = np.full((samples.shape[0], 3), np.nan)
    for k in range(samples.shape[0]):
        costs[k], count = simulate(scene, rules, pose, velocity, samples[k], points)
        if count > 0:
            ends[k] = points[count - 1]
    return costs, ends
