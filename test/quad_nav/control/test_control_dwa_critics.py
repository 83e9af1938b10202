"""Velocity samples and critics of the dynamic window planner, with numbers worked out by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from local_planner_cases import ORIGIN, REST, SQUARE, WINDOW, free, line

from quad_nav.control.dwa_critics import NO_LEGAL_TRAJECTORY, Critics, velocity_samples
from quad_nav.control.dwa_kernel import is_within_reach, obstacle_cost, spaced
from quad_nav.control.dwa_oscillation import OscillationCritic
from quad_nav.control.dwa_planner import DwaParams
from quad_nav.control.dwa_search import TERMS, fill_terms, footprint_scale
from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.grid import LETHAL

PERIOD_S = 0.2
PARAMS = DwaParams(max_vel_y_mps=0.0, min_vel_y_mps=0.0, predict_goal_turn=False)


def critics(params=PARAMS, costs=None, pose=ORIGIN, velocity=REST, plan=None):
    return Critics(
        params,
        WINDOW,
        free() if costs is None else costs,
        SQUARE,
        line(0.0, 0.0, 1.0, 0.0) if plan is None else plan,
        pose,
        velocity,
    )


def only(vx, vy=0.0, vtheta_up_to=0.0, **more):
    """Parameters that sample one velocity, for a robot that has it already."""
    return replace(
        PARAMS,
        min_vel_x_mps=vx,
        max_vel_x_mps=vx,
        min_vel_y_mps=vy,
        max_vel_y_mps=vy,
        max_vel_theta_radps=vtheta_up_to,
        max_vel_trans_mps=1.0,
        **more,
    )


def chosen(params, **state):
    return critics(params, **state).choose(OscillationCritic(), PERIOD_S)


# Samples


@pytest.mark.parametrize(
    "start, end, count, values",
    [
        (0.0, 0.5, 3, [0.0, 0.25, 0.5]),
        (-1.0, 2.0, 2, [-1.0, 0.0, 2.0]),  # 0 is put between
        (-1.0, 1.0, 3, [-1.0, 0.0, 1.0]),  # 0 is there already
        (0.25, 0.75, 1, [0.25, 0.75]),  # both ends at least
        (0.5, 0.5, 4, [0.5]),
        (0.75, 0.5, 2, [0.75, 0.5]),  # faster than allowed: down to the limit
    ],
)
def test_spaced(start, end, count, values):
    assert spaced(start, end, count).tolist() == values


# Critics


def test_cost_is_the_weighted_sum_of_the_critics():
    costs = free()
    costs[34, 28:33] = 50  # under the outline's left side along the whole path
    params = only(0.25, sim_time_s=1.0, sim_granularity_m=0.125)

    best = chosen(
        params,
        costs=costs,
        pose=Pose2D(0.01, 0.01),
        velocity=Twist2D(0.25),
        plan=line(0.01, 0.11, 1.01, 0.11),
    )

    # Last pose x = 0.135, cell (32, 30): 2 cells from the path and 18 + 2 from the local goal,
    # cell (50, 32). Its nose, x = 0.46, cell (39, 30): 2 from the path and 17 + 2 from the cell
    # (56, 32) of (1.333, 0.142), 0.325 m beyond the local goal.
    obstacle, goal_front, alignment, path, goal = 50, 19, 2, 2, 20
    assert best.cost == pytest.approx(
        0.01 * obstacle + 0.05 * (0.8 * goal_front + 0.6 * alignment + 0.6 * path + 0.8 * goal)
    )


def test_costs_on_the_way_count_by_the_highest_or_are_summed():
    costs = free()
    costs[:, 30:33] = [10, 30, 20]
    params = only(
        0.5,
        sim_time_s=0.3,
        sim_granularity_m=0.05,
        path_distance_bias=0.0,
        goal_distance_bias=0.0,
        occdist_scale=1.0,
    )
    state = {"costs": costs, "pose": Pose2D(0.225, 0.02), "velocity": Twist2D(0.5)}

    # 3 poses, x = 0.225, 0.275, 0.325: the outline's rear at 0.025, 0.075, 0.125.
    assert chosen(params, **state).cost == 30.0
    assert chosen(replace(params, sum_scores=True), **state).cost == 30.0 + 30.0 + 20.0


def test_footprint_grows_with_the_speed():
    commands = (0.25, 0.0, 0.0), (0.4, 0.0, 0.0), (0.33, 0.44, 0.0), (-0.55, 0.0, 1.0)
    scales = [footprint_scale(critics().weights, command) for command in commands]
    np.testing.assert_allclose(scales, [1.0, 1.1, 1.2, 1.2])


@pytest.mark.parametrize(
    "change",
    [
        {},
        {"sum_scores": True},
        {"use_dwa": False},
        {"twirling_scale": 0.3},
        {"occdist_scale": 0.0},
        {"path_distance_bias": 0.0},
        {"goal_distance_bias": 0.0, "max_vel_y_mps": 0.1},
        {"angular_sim_granularity_rad": 2.0},  # turns too far in a step for a bound of its end
    ],
)
def test_search_finds_what_scoring_every_sample_finds(change):
    legal = 0
    for seed in range(6):
        random = np.random.default_rng(seed)
        costs = random.integers(0, 30, WINDOW.shape).astype(np.uint8)
        costs[random.integers(0, 60, 12), random.integers(0, 60, 12)] = LETHAL
        costs[24:37, 24:37] = 0
        params = replace(PARAMS, vx_samples=4, vth_samples=9, **change)
        pose = Pose2D(*random.uniform(-0.1, 0.1, 2), random.uniform(-1.0, 1.0))
        state = critics(params, costs, pose, Twist2D(0.3, 0.0, 0.2))

        best = state.choose(OscillationCritic(), PERIOD_S)

        cost, command = scored_one_by_one(state)
        assert best.cost == (cost if cost < math.inf else NO_LEGAL_TRAJECTORY)
        if cost < math.inf:
            assert best.sample == command
            legal += 1
    assert legal >= 4


def scored_one_by_one(state):
    """The lowest cost of all samples, inf without a legal one, and its command."""
    best, best_command = math.inf, None
    samples = velocity_samples(state.params, state.pose, state.velocity, state.goal, PERIOD_S)
    obstacles = state.obstacles(1.2)._replace(highest_near=np.full(WINDOW.shape, 255, np.uint8))
    for sample in samples:
        points, command = state.simulate(sample)
        distances, terms = np.zeros(4), np.empty(TERMS)
        if not len(points) or not is_within_reach(state.map_grids, points, len(points), distances):
            continue
        fill_terms(state.weights, distances, command, terms)
        scale = footprint_scale(state.weights, command)
        obstacle = obstacle_cost(obstacles, scale, points, len(points), terms, math.inf)
        if obstacle < 0.0 and state.params.occdist_scale:
            continue
        cost = state.params.occdist_scale * obstacle
        for term in terms:
            cost += term
        if cost < best:
            best, best_command = cost, command
    return best, best_command
