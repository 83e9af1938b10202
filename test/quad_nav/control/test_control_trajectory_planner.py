"""The trajectory planner: plan window, goal, oscillation and escape."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from local_planner_cases import ORIGIN, REST, SQUARE, WINDOW, boxed_in, free, line

from quad_nav.control.goal import is_stopped, stopping_command, turning_command
from quad_nav.control.oscillation import Oscillation
from quad_nav.control.plan_follower import count_passed, plan_in_window
from quad_nav.control.trajectory_planner import TrajectoryPlanner, TrajectoryPlannerParams
from quad_nav.errors import NoLocalPlan, NoValidTrajectory
from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.grid import LETHAL

PARAMS = TrajectoryPlannerParams(
    holonomic_robot=False,
    reject_colliding_escape=False,
    end_blocked_escape=False,
    predict_goal_turn=False,
)


def planner_at(plan, params=PARAMS, period_s=0.2) -> TrajectoryPlanner:
    planner = TrajectoryPlanner(params, SQUARE, period_s)
    planner.set_plan(plan)
    return planner


# Plan


def test_plan_in_window_ends_with_the_first_pose_outside():
    plan = line(-4.0, 0.0, 4.0, 0.0, count=9)
    part = plan_in_window(plan, WINDOW, Pose2D(0.0, 0.0), Pose2D(0.0, 0.0))
    assert part[:, 0].tolist() == [-1.0, 0.0, 1.0, 2.0]


def test_plan_is_taken_to_the_local_frame():
    local_from_plan = Pose2D(1.0, 0.0, math.pi / 2)
    plan = np.array([[0.0, 1.0, 0.0], [1.0, 1.0, 0.5]])
    part = plan_in_window(plan, WINDOW, Pose2D(0.0, 0.0), local_from_plan)
    np.testing.assert_allclose(
        part, [[0.0, 0.0, math.pi / 2], [0.0, 1.0, math.pi / 2 + 0.5]], atol=1e-12
    )


def test_poses_passed_are_those_a_metre_behind():
    plan = line(-1.25, 0.0, 0.5, 0.0, count=8)
    assert count_passed(plan, Pose2D(0.0, 0.0)) == 2
    assert count_passed(plan, Pose2D(9.0, 0.0)) == 8


@pytest.mark.parametrize("seed", range(8))
def test_the_part_in_the_window_is_that_of_the_transformed_plan(seed):
    random = np.random.default_rng(seed)
    plan = np.cumsum(random.normal(0.0, 0.2, (60, 3)), axis=0)
    pose, frame = Pose2D(*random.normal(0.0, 1.0, 3)), Pose2D(*random.normal(0.0, 1.0, 3))

    part = plan_in_window(plan, WINDOW, pose, frame)

    robot = pose.relative_to(frame)
    near = (robot.x_m - plan[:, 0]) ** 2 + (robot.y_m - plan[:, 1]) ** 2 <= 1.5**2
    first = int(np.argmax(near)) if near.any() else len(plan)
    far = np.flatnonzero(~near[first:])
    end = first + far[0] + 1 if len(far) else len(plan)
    np.testing.assert_array_equal(part, frame.transform_poses(plan[first:end]))  # bit for bit


# At the goal


def test_stopping_slows_each_component():
    command = stopping_command(Twist2D(0.5, -0.05, -0.8), PARAMS, 0.1)
    assert (command.vx_mps, command.vy_mps, command.vyaw_radps) == pytest.approx((0.25, 0, -0.48))


@pytest.mark.parametrize(
    "turn_rad, current_radps, period_s, expected_radps",
    [
        (0.8, 0.0, 1.0, 0.8),  # the turn itself
        (3.0, 0.0, 1.0, 1.0),  # max_rotational_vel
        (0.1, 0.0, 1.0, 0.4),  # min_in_place_vel_theta
        (-0.5, 0.3, 0.05, -0.46),  # 0.3 + 3.2 * 0.05
        (0.05, 1.0, 0.05, math.sqrt(2 * 3.2 * 0.05)),  # the braking curve
    ],
)
def test_turning_speed(turn_rad, current_radps, period_s, expected_radps):
    command = turning_command(turn_rad, Twist2D(vyaw_radps=current_radps), PARAMS, period_s)
    assert command.vyaw_radps == pytest.approx(expected_radps)
    assert command.vx_mps == command.vy_mps == 0.0


def test_stopped_within_the_given_velocities():
    assert is_stopped(Twist2D(0.01, -0.01, 0.01), PARAMS)
    assert not is_stopped(Twist2D(0.0, 0.0, 0.011), PARAMS)


# Oscillation


def test_second_turn_without_moving_is_stuck_until_the_robot_moves():
    oscillation = Oscillation()
    oscillation.record_turn((0.0, 0.0, 0.5), Pose2D(1.0, 0.0))
    assert oscillation.rotating_left and not oscillation.stuck_left
    oscillation.record_turn((0.0, 0.0, 0.5), Pose2D(1.0, 0.0))
    assert oscillation.stuck_left

    oscillation.forget_if_moved(Pose2D(1.04, 0.0), 0.05)
    assert oscillation.stuck_left
    oscillation.forget_if_moved(Pose2D(1.06, 0.0), 0.05)
    assert oscillation == Oscillation(since=Pose2D(1.0, 0.0))


def test_escape_ends_by_moving_or_turning():
    for moved, escaping in (
        (Pose2D(0.05, 0.0, 0.5), True),
        (Pose2D(0.11, 0.0), False),
        (Pose2D(0.0, 0.0, 1.6), False),
    ):
        oscillation = Oscillation()
        oscillation.begin_escape(Pose2D(0.0, 0.0))
        oscillation.end_escape_if_moved(moved, 0.1, math.pi / 2)
        assert oscillation.escaping == escaping


# The whole planner


def test_flies_straight_along_a_straight_plan():
    planner = planner_at(line(0.0, 0.0, 4.0, 0.0))

    control = planner.compute_velocity(WINDOW, free(), ORIGIN, Twist2D(0.5))

    assert control.command == Twist2D(pytest.approx(0.55), 0.0, 0.0)
    assert not control.goal_mode
    assert control.global_plan[-1, 0] == pytest.approx(1.6)
    np.testing.assert_allclose(np.diff(control.local_plan[:, 0])[1:], 0.55 * 1.7 / 37)
    assert not planner.is_goal_reached()


def test_no_plan_and_no_plan_near():
    planner = TrajectoryPlanner(PARAMS, SQUARE, 0.2)
    with pytest.raises(NoLocalPlan, match="no global plan"):
        planner.compute_velocity(WINDOW, free(), ORIGIN, REST)
    planner.set_plan(line(5.0, 5.0, 6.0, 5.0))
    with pytest.raises(NoLocalPlan, match="does not come near"):
        planner.compute_velocity(WINDOW, free(), ORIGIN, REST)


def test_out_of_reach_fails_and_leaves_the_plan_readable():
    planner = planner_at(line(0.0, 0.0, 1.0, 0.0))
    with pytest.raises(NoValidTrajectory, match="out of reach"):
        planner.compute_velocity(WINDOW, boxed_in(5), ORIGIN, REST)
    assert planner.best.cost == -2.0
    assert len(planner.local_global_plan) == 41


def test_backs_out_when_everything_collides():
    costs = free()
    costs[:, 34] = LETHAL  # the wall touches the outline at x = 0.20
    planner = planner_at(line(0.0, 0.0, 0.15, 0.0), replace(PARAMS, xy_goal_tolerance_m=0.05))

    control = planner.compute_velocity(WINDOW, costs, ORIGIN, REST)

    assert control.command == Twist2D(-0.1, 0.0, 0.0)
    assert control.cost == 1.0
    assert planner.oscillation.escaping


def test_at_the_goal_it_stops_then_turns_then_is_done():
    planner = planner_at(line(-1.0, 0.0, 0.05, 0.0, yaw=1.0))
    here = Pose2D(0.0, 0.0, 0.0)

    control = planner.compute_velocity(WINDOW, free(), here, Twist2D(0.6))
    assert control.command.vx_mps == pytest.approx(0.6 - 2.5 * 0.2)
    assert control.goal_mode and math.isnan(control.cost) and not len(control.local_plan)

    control = planner.compute_velocity(WINDOW, free(), here, REST)
    assert control.command.vyaw_radps == pytest.approx(0.64)  # 3.2 rad/s2 * 0.2 s
    assert planner.rotating_to_goal and not planner.is_goal_reached()

    control = planner.compute_velocity(WINDOW, free(), Pose2D(0.0, 0.0, 0.96), Twist2D(0, 0, 0.4))
    assert control.command.is_zero
    assert planner.is_goal_reached() and not planner.rotating_to_goal

    planner.set_plan(line(0.0, 0.0, 1.0, 0.0))
    assert not planner.is_goal_reached()


@pytest.mark.parametrize("latch", [True, False])
def test_latched_goal_holds_when_pushed_away(latch):
    planner = planner_at(
        line(-1.0, 0.0, 0.0, 0.0, yaw=1.0), replace(PARAMS, latch_xy_goal_tolerance=latch)
    )
    planner.compute_velocity(WINDOW, free(), ORIGIN, REST)

    control = planner.compute_velocity(WINDOW, free(), Pose2D(-0.3, 0.0), REST)

    assert control.goal_mode == latch


def test_pruning_drops_what_was_passed():
    plan = line(-1.25, 0.0, 0.5, 0.0, count=8)
    for prune, left in ((True, 6), (False, 8)):
        planner = planner_at(plan, replace(PARAMS, prune_plan=prune))
        planner.compute_velocity(WINDOW, free(), ORIGIN, REST)
        assert len(planner.plan) == left


def test_new_parameters_keep_the_plan_and_the_state():
    planner = planner_at(line(0.0, 0.0, 4.0, 0.0))
    planner.oscillation.rotating_left = True

    planner.set_params(replace(PARAMS, max_vel_x_mps=0.2))
    control = planner.compute_velocity(WINDOW, free(), ORIGIN, Twist2D(0.2))

    assert control.command.vx_mps == pytest.approx(0.2)
    assert planner.oscillation.rotating_left


# Fixed upstream bugs


def test_an_escape_must_lead_out_of_the_collision():
    params = replace(PARAMS, xy_goal_tolerance_m=0.05, reject_colliding_escape=True)
    costs = free()
    costs[:, 34] = LETHAL  # the wall touches the outline at x = 0.20
    plan = line(0.0, 0.0, 0.15, 0.0)
    control = planner_at(plan, params).compute_velocity(WINDOW, costs, ORIGIN, REST)
    assert control.command == Twist2D(-0.1, 0.0, 0.0)

    costs[:, 24] = LETHAL  # 0.1 m back, the outline touches this one at x = -0.30
    upstream = planner_at(plan, replace(params, reject_colliding_escape=False))
    assert upstream.compute_velocity(WINDOW, costs, ORIGIN, REST).command.vx_mps == -0.1
    fixed = planner_at(plan, params)
    with pytest.raises(NoValidTrajectory, match="collides"):
        fixed.compute_velocity(WINDOW, costs, ORIGIN, REST)
    assert not fixed.oscillation.escaping


@pytest.mark.parametrize("ends", [False, True])
@pytest.mark.parametrize("is_blocked", [False, True])
def test_an_escape_with_no_way_back_ends(ends, is_blocked):
    params = replace(PARAMS, reject_colliding_escape=True, end_blocked_escape=ends)
    costs = free()
    if is_blocked:
        costs[:, 24] = LETHAL  # 0.1 m back, the outline touches this wall at x = -0.30
    planner = planner_at(line(0.0, 0.0, 4.0, 0.0), params)
    state = planner.oscillation
    state.begin_escape(ORIGIN)
    state.stuck_left = state.stuck_right = True  # no turn in place either

    if is_blocked and not ends:
        with pytest.raises(NoValidTrajectory, match="collides"):
            planner.compute_velocity(WINDOW, costs, ORIGIN, REST)
        assert state.escaping
        return
    vx_mps = planner.compute_velocity(WINDOW, costs, ORIGIN, REST).command.vx_mps
    assert vx_mps == pytest.approx(0.55 if is_blocked else -0.1)
    assert state.escaping is not is_blocked


@pytest.mark.parametrize(
    "turn_rad, expected_radps",
    [
        (0.2, 0.2),  # below min_in_place_vel_theta: what is left in one period of 1 s
        (-0.06, -0.06),
        (3.0, 1.0),  # max_rotational_vel
    ],
)
def test_the_turn_at_the_goal_stops_where_one_period_ends(turn_rad, expected_radps):
    params = replace(PARAMS, predict_goal_turn=True, min_in_place_vel_theta_radps=1.0)
    assert turning_command(turn_rad, REST, params, 1.0).vyaw_radps == pytest.approx(expected_radps)
    at_10_hz = turning_command(turn_rad, REST, params, 0.1)
    assert abs(at_10_hz.vyaw_radps) * 0.1 <= abs(turn_rad) + 1e-12
