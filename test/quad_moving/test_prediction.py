"""Rollouts judged against where moving obstacles will be, with numbers worked out by hand."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from local_planner_cases import ORIGIN, SQUARE, WINDOW, free, line

from quad_nav.control.dwa_critics import Critics
from quad_nav.control.dwa_oscillation import OscillationCritic
from quad_nav.control.dwa_planner import DwaParams, DwaPlanner
from quad_nav.control.moving_discs import MovingDiscs, passing_cost
from quad_nav.control.prediction import NO_DISCS, join_discs, predict, rollout_discs
from quad_nav.control.rollout import Rollout
from quad_nav.control.trajectory_planner import TrajectoryPlannerParams
from quad_nav.costmap.collision import COLLIDES
from quad_nav.geometry import Twist2D
from quad_nav.navigator.control_supervisor import ControlSupervisor
from quad_nav.navigator.tick import RobotPoses, Tick
from quad_nav.tracking.tracks import Tracks

SECOND = TrajectoryPlannerParams(sim_time_s=1.0, occdist_scale=0.01, holonomic_robot=False)
FLYING = Twist2D(0.5)
AHEAD = (0.5, 0.0, 0.0)


def tracks(*states, radius_m=0.3):
    n = len(states)
    return Tracks(
        0.0, np.arange(n), np.array(states).reshape(n, 4), np.zeros((n, 4, 4)), np.full(n, radius_m)
    )


def discs(*states, radius_m=0.3, rollout_s=1.0, pose=ORIGIN):
    """Predictions for a robot of 0 m radius that keeps 0.05 m clear."""
    seen = tracks(*states, radius_m=radius_m)
    return rollout_discs(seen, pose, 0.0, 0.05, rollout_s)


def rollout(moving):
    plan = line(0.0, 0.0, 1.0, 0.0)
    return Rollout(SECOND, WINDOW, free(), SQUARE, plan, ORIGIN, FLYING, moving)


def test_predictions_move_on_and_grow_uncertain():
    found = predict(tracks([1.0, 0.0, 0.5, -1.0]), np.array([0.0, 2.0]), (0.5, 0.0))
    np.testing.assert_allclose(found[0, 0], [0.5, 0.0, 0.3, 0.08])
    np.testing.assert_allclose(found[1, 0], [1.5, -2.0, 0.3, 0.08 + 2.0 * 0.05])


def test_discs_of_a_rollout_span_its_time_and_hold_the_robots_radius():
    seen = tracks([1.0, 0.0, 0.0, 1.0])
    moving = rollout_discs(seen, ORIGIN, 0.25, 0.1, 1.63)
    assert moving.discs.shape == (34, 1, 4)  # 33 steps of at most 0.05 s
    np.testing.assert_allclose(moving.discs[[0, -1], 0, :3], [[1.0, 0.0, 0.55], [1.0, 1.63, 0.55]])


def test_an_obstacle_that_overlaps_the_robot_counts_as_smaller():
    assert discs([0.2, 0.0, 0.0, 0.0]).discs[-1, 0, 2] == pytest.approx(0.2)


@pytest.mark.parametrize(
    "distance_m, sigma_m, expected",
    [
        (0.45, 0.2, COLLIDES),
        (0.45, 0.31, 252.0),  # too uncertain to forbid
        (0.55, 0.2, 252.0),  # inside of the clearance
        (0.8, 0.2, 252.0 * math.exp(-0.5)),  # one standard deviation from it
        (1.21, 0.2, 0.0),  # more than three
    ],
)
def test_passes_cost_by_distance_and_uncertainty(distance_m, sigma_m, expected):
    moving = MovingDiscs(np.array([[[1.0, 0.0, 0.5, sigma_m]]]), 0.1)
    assert passing_cost(moving, 0.0, 1.0, distance_m) == pytest.approx(expected)


def test_the_share_of_the_time_chooses_the_prediction():
    moving = MovingDiscs(np.array([[[k, 0.0, 0.1, 0.01]] for k in range(5)], float), 0.0)
    assert [passing_cost(moving, share, 2.0, 0.0) for share in (0.0, 0.37, 0.4, 0.6, 0.63)] == [
        0.0,
        0.0,
        COLLIDES,
        COLLIDES,
        0.0,
    ]


@pytest.mark.parametrize(
    "state, collides",
    [
        ([0.25, 1.0, 0.0, -1.0], True),  # meets the robot in the end
        ([0.25, 2.0, 0.0, -1.0], False),  # comes a second too late
        ([0.5, 0.0, 0.0, 0.0], True),  # stands ahead
        ([0.5, 0.0, 0.0, 1.0], False),  # is ahead, and gone when the robot is there
    ],
)
def test_a_rollout_collides_where_the_obstacle_will_be(state, collides):
    assert (rollout(discs(state)).trajectory(AHEAD).cost == COLLIDES) is collides


def test_a_pass_costs_as_the_highest_cell_on_the_way():
    """The robot flies by at 0.41 m: 0.06 m beyond radius and clearance, all the time."""
    moving = discs([0.0, 0.41, 0.5, 0.0])
    moving.discs[:, :, 3] = 0.06
    alone = rollout(NO_DISCS).trajectory(AHEAD).cost
    # The obstacle is up to 0.0125 m ahead or behind, half of a prediction's step.
    nearest = 252.0 * math.exp(-0.5)
    assert rollout(moving).trajectory(AHEAD).cost == pytest.approx(alone + 0.01 * nearest, rel=1e-3)


def test_the_cheapest_sample_is_that_of_all_scores():
    turns = np.linspace(-1.0, 1.0, 9)
    samples = np.array([(vx, 0.0, turn) for vx in (0.1, 0.3, 0.5) for turn in turns])
    random, illegal = np.random.default_rng(3), 0
    for _ in range(20):
        states = random.uniform([0.4, -1.0, -1.0, -1.0], [1.5, 1.0, 1.0, 1.0], (3, 4))
        judged = rollout(discs(*states))
        costs, _ = judged.score(samples)
        illegal += np.count_nonzero(costs < 0.0)
        costs = np.where(costs < 0.0, np.inf, costs)
        k = int(np.argmin(costs))
        assert judged.cheapest(samples) == ((k, costs[k]) if costs[k] < np.inf else None)
    assert illegal > 50


DWA = DwaParams(
    sim_time_s=1.0,
    min_vel_x_mps=0.5,
    max_vel_x_mps=0.5,
    min_vel_y_mps=0.0,
    max_vel_y_mps=0.0,
    max_vel_trans_mps=1.0,
    max_vel_theta_radps=0.0,
    occdist_scale=0.01,
    predict_goal_turn=False,
)


@pytest.mark.parametrize("sums", [False, True])
@pytest.mark.parametrize(
    "state, legal", [([0.5, 0.0, 0.0, 0.0], False), ([0.5, 0.0, 0.0, 1.0], True)]
)
def test_the_dynamic_window_is_judged_too(state, legal, sums):
    params = replace(DWA, sum_scores=sums)
    plan = line(0.0, 0.0, 1.0, 0.0)
    judged = Critics(
        params, WINDOW, free(), SQUARE, plan, ORIGIN, FLYING, moving=discs(state)
    ).choose(OscillationCritic(), 0.2)
    assert (judged.cost >= 0.0) is legal


def supervised():
    planner = DwaPlanner(DWA, SQUARE, 0.2)
    control = ControlSupervisor(planner)
    control.set_plan(line(0.0, 0.0, 1.0, 0.0))
    return control


def command_of(control, moving):
    tick, costmap = Tick(0.0), SimpleNamespace(spec=WINDOW, costs=free())
    done = control.compute_velocity(tick, costmap, RobotPoses(ORIGIN, ORIGIN), FLYING, moving)
    return done, tick.command


def test_the_robot_waits_where_only_what_moves_leaves_no_trajectory():
    assert command_of(supervised(), NO_DISCS) == (True, Twist2D(0.5))
    assert command_of(supervised(), discs([1.0, 0.0, -1.0, 0.0])) == (True, Twist2D())


def test_without_a_plan_there_is_no_command_either_way():
    control = supervised()
    control.set_plan(line(50.0, 0.0, 51.0, 0.0))
    assert command_of(control, discs([1.0, 0.0, -1.0, 0.0])) == (False, None)


def test_joined_discs_are_in_c_order():
    # an index with a mask puts the masked axis first in memory
    masked = np.arange(24.0).reshape(2, 3, 4)[:, np.array([True, False, True])]
    assert not masked.flags.c_contiguous
    joined = join_discs(masked, np.zeros((2, 1, 4)))
    assert joined.flags.c_contiguous and joined.shape == (2, 3, 4)
    assert joined[1, :, 0].tolist() == [12.0, 20.0, 0.0]
