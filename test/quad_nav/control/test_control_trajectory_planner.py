"""The trajectory planner: plan window, goal, oscillation and escape."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from local_planner_cases import ORIGIN, REST, SQUARE, WINDOW, free, line

from quad_nav.control.oscillation import Oscillation
from quad_nav.control.plan_follower import plan_in_window, turning_command
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


# The whole planner


def test_no_plan_and_no_plan_near():
    planner = TrajectoryPlanner(PARAMS, SQUARE, 0.2)
    with pytest.raises(NoLocalPlan, match="no global plan"):
        planner.compute_velocity(WINDOW, free(), ORIGIN, REST)
    planner.set_plan(line(5.0, 5.0, 6.0, 5.0))
    with pytest.raises(NoLocalPlan, match="does not come near"):
        planner.compute_velocity(WINDOW, free(), ORIGIN, REST)


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
