"""Velocity samples and critics of the dynamic window planner, with numbers worked out by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from local_planner_cases import ORIGIN, REST, SQUARE, WINDOW, boxed_in, free, line

from quad_nav.control.dwa_critics import NO_LEGAL_TRAJECTORY, Critics
from quad_nav.control.dwa_kernel import is_within_reach, obstacle_cost, spaced, step_count
from quad_nav.control.dwa_oscillation import OscillationCritic
from quad_nav.control.dwa_planner import DwaParams
from quad_nav.control.dwa_samples import velocity_samples
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


def test_samples_span_what_one_period_reaches():
    params = replace(
        PARAMS, acc_lim_x_mps2=0.5, acc_lim_theta_radps2=1.0, vx_samples=2, vth_samples=2
    )

    samples = velocity_samples(params, ORIGIN, (0.25, 0.0, 0.5), ORIGIN, 0.25)

    assert samples.tolist() == [
        [0.125, 0.0, 0.25],
        [0.125, 0.0, 0.75],
        [0.375, 0.0, 0.25],
        [0.375, 0.0, 0.75],
    ]


def test_samples_without_dwa_span_the_simulation_and_do_not_overshoot():
    params = replace(
        PARAMS,
        use_dwa=False,
        sim_time_s=2.0,
        vx_samples=2,
        vth_samples=2,
        acc_lim_theta_radps2=0.125,
    )

    samples = velocity_samples(params, ORIGIN, (0.0, 0.0, 0.25), Pose2D(0.5, 0.0), 0.25)

    assert samples.tolist() == [
        [0.0, 0.0, 0.0],
        [0.0, 0.0, 0.5],
        [0.25, 0.0, 0.0],
        [0.25, 0.0, 0.5],
    ]


def test_samples_are_single_precision():
    samples = velocity_samples(only(0.1), ORIGIN, (0.1, 0.0, 0.0), ORIGIN, PERIOD_S)
    assert samples.tolist() == [[float(np.float32(0.1)), 0.0, 0.0]]


# Simulation


def test_straight_trajectory_advances_by_the_granularity():
    best = chosen(only(0.5), velocity=Twist2D(0.5))

    assert len(best.points) == 34  # 0.5 m/s * 1.7 s / 0.025 m
    np.testing.assert_allclose(best.points[:, 0], 0.025 * np.arange(34), atol=1e-6)
    assert not best.points[:, 1:].any()
    assert best.sample == (0.5, 0.0, 0.0)


def test_sideways_is_to_the_left_of_the_heading():
    best = chosen(
        only(0.0, 0.25, sim_time_s=1.0, sim_granularity_m=0.125),
        pose=Pose2D(0.0, 0.0, math.pi / 2),
        velocity=Twist2D(0.0, 0.25),
    )

    np.testing.assert_allclose(
        best.points, [[0, 0, math.pi / 2], [-0.125, 0, math.pi / 2]], atol=1e-6
    )


def test_turns_are_cut_by_the_angular_granularity():
    params = replace(
        PARAMS,
        min_vel_x_mps=0.0,
        max_vel_x_mps=0.0,
        max_vel_theta_radps=0.5,
        sim_time_s=1.0,
        angular_sim_granularity_rad=0.25,
        acc_lim_theta_radps2=0.0,
    )
    best = chosen(params, velocity=Twist2D(0.0, 0.0, 0.5))
    assert best.points.tolist() == [[0.0, 0.0, 0.0], [0.0, 0.0, 0.25]]


def test_without_dwa_the_command_is_the_first_step():
    params = only(1.0, use_dwa=False, acc_lim_x_mps2=1.0, sim_time_s=1.0, sim_granularity_m=0.25)
    state = critics(params, plan=line(0.0, 0.0, 1.2, 0.0))

    points, command = state.simulate(np.array([1.0, 0.0, 0.0]))

    assert command == (0.25, 0.0, 0.0)
    # The first pose is left at the velocity after it: 0.5, 0.75, 1 m/s for 0.25 s each.
    assert points[:, 0].tolist() == [0.0, 0.125, 0.3125, 0.5625]


@pytest.mark.parametrize(
    "velocity, legal",
    [
        ((0.05, 0.0, 0.3), False),  # too slow either way
        ((0.1, 0.0, 0.0), True),
        ((0.0, 0.0, 0.4), True),
        ((0.55, 0.0, 0.0), True),
        ((0.5, 0.3, 0.0), False),  # 0.58 m/s together
    ],
)
def test_speed_limits(velocity, legal):
    assert (step_count(critics().motion, np.array(velocity)) > 0) == legal


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


@pytest.mark.parametrize("cheat_factor, cells", [(0.1, 3 + 8), (1.0, 3)])
def test_near_the_goal_there_is_no_alignment(cheat_factor, cells):
    params = only(
        0.25,
        sim_time_s=1.0,
        sim_granularity_m=0.125,
        goal_distance_bias=0.0,
        path_distance_bias=1.0,
        cheat_factor=cheat_factor,
    )
    # The local goal is 0.23 m away. The last pose, cell (32, 29), is 3 from the path; the nose,
    # cell (39, 29), is 3 + 5 from the path's end, cell (34, 32).
    best = chosen(
        params, pose=Pose2D(0.01, -0.01), velocity=Twist2D(0.25), plan=line(0.01, 0.11, 0.21, 0.11)
    )
    assert best.cost == pytest.approx(0.05 * cells)


def test_twirling_costs_its_speed():
    params = replace(
        PARAMS,
        min_vel_x_mps=0.0,
        max_vel_x_mps=0.0,
        max_vel_theta_radps=0.5,
        acc_lim_theta_radps2=0.0,
        twirling_scale=2.0,
        path_distance_bias=0.0,
        goal_distance_bias=0.0,
    )
    assert chosen(params, velocity=Twist2D(0.0, 0.0, -0.5)).cost == 1.0


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


def test_fast_robot_keeps_off_what_a_slow_one_passes():
    costs = free()
    costs[34, :] = LETHAL  # y 0.20 to 0.25
    pose = Pose2D(0.0, -0.01)  # outline at 0.19 unscaled, 0.214 at 0.43 m/s
    assert (
        chosen(
            replace(only(0.25), max_vel_trans_mps=0.55),
            costs=costs,
            pose=pose,
            velocity=Twist2D(0.25),
        ).cost
        >= 0.0
    )
    assert (
        chosen(
            replace(only(0.43), max_vel_trans_mps=0.55),
            costs=costs,
            pose=pose,
            velocity=Twist2D(0.43),
        ).cost
        == NO_LEGAL_TRAJECTORY
    )


def test_no_room_to_grow_is_an_endless_footprint():
    params = replace(only(0.5), scaling_speed_mps=0.49999, max_vel_trans_mps=0.49999)
    assert chosen(params, velocity=Twist2D(0.5)).cost == NO_LEGAL_TRAJECTORY


def test_without_weight_obstacles_are_not_looked_at():
    params = replace(only(0.25), path_distance_bias=0.0, goal_distance_bias=0.0)
    state = {"costs": boxed_in(4), "velocity": Twist2D(0.25)}
    assert chosen(params, **state).cost == NO_LEGAL_TRAJECTORY
    assert chosen(replace(params, occdist_scale=0.0), **state).cost == 0.0


def test_nose_may_not_leave_the_map():
    params = replace(only(0.25), forward_point_distance_m=0.8)
    plan = line(0.0, 0.0, 0.6, 0.0)
    state = {"pose": Pose2D(0.5, 0.0), "velocity": Twist2D(0.25), "plan": plan}
    # The last pose, x = 0.9, looks at 1.7 m; the map ends at 1.5 m.
    assert chosen(params, **state).cost == NO_LEGAL_TRAJECTORY
    assert chosen(replace(params, forward_point_distance_m=0.5), **state).cost > 0.0


def test_behind_a_wall_path_and_goal_are_out_of_reach():
    costs = free()
    costs[:, 42] = LETHAL  # x 0.60 to 0.65, out of the outline's reach
    state = {"costs": costs, "velocity": Twist2D(0.125), "plan": line(0.9, 0.0, 1.2, 0.0)}
    params = only(0.125)
    assert chosen(params, **state).cost == NO_LEGAL_TRAJECTORY
    assert (
        chosen(replace(params, path_distance_bias=0.0, goal_distance_bias=0.0), **state).cost == 0.0
    )


def test_first_of_equals_wins():
    params = replace(PARAMS, path_distance_bias=0.0, goal_distance_bias=0.0)
    best = chosen(params, velocity=Twist2D(0.25, 0.0, 0.0))
    assert best.cost == 0.0
    # 0.25 -+ 2.5 * 0.2 cut to 0 .. 0.55; -+ 3.2 * 0.2. Turning in place is legal from 0.4 rad/s.
    assert best.sample == pytest.approx((0.0, 0.0, -0.64))


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
