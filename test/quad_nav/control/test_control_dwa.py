"""The dynamic window planner and its oscillation critic, with numbers worked out by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from local_planner_cases import ORIGIN, REST, SQUARE, WINDOW, boxed_in, free, line

from quad_nav.control.dwa_critics import NO_LEGAL_TRAJECTORY
from quad_nav.control.dwa_oscillation import OscillationCritic
from quad_nav.control.dwa_planner import DwaParams, DwaPlanner
from quad_nav.control.dwa_search import is_forbidden
from quad_nav.errors import NoLocalPlan, NoValidTrajectory
from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.grid import LETHAL

PERIOD_S = 0.2
PARAMS = DwaParams(max_vel_y_mps=0.0, min_vel_y_mps=0.0, predict_goal_turn=False)


def planner_at(plan, params=PARAMS) -> DwaPlanner:
    planner = DwaPlanner(params, SQUARE, PERIOD_S)
    planner.set_plan(plan)
    return planner


# Oscillation


def noted(critic, *commands, pose=ORIGIN):
    for command in commands:
        critic.record(command, pose, slow_mps=0.1, reset_dist_m=0.05, reset_angle_rad=0.2)
    return critic


def forbidden_of(critic, commands):
    return [is_forbidden(critic.directions, tuple(command)) for command in commands]


def test_reversal_forbids_the_direction_given_up():
    critic = noted(OscillationCritic(), (0.0, 0.0, 0.5), (0.0, 0.0, -0.5))

    forbidden = forbidden_of(critic, [[0.0, 0.0, 0.5], [0.0, 0.0, 0.0], [0.3, 0.1, -0.1]])

    assert forbidden == [True, False, False]
    assert critic.turn.going_negative and not critic.turn.going_positive


def test_turns_do_not_count_at_speed():
    critic = noted(OscillationCritic(), (0.3, 0.0, 0.5), (0.3, 0.0, -0.5))
    assert not critic.turn.is_restricted and not critic.turn.going_negative
    assert critic.forward.going_positive


def test_two_reversals_leave_only_standing():
    critic = noted(OscillationCritic(), (0.2, 0.0, 0.0), (-0.2, 0.0, 0.0), (0.2, 0.0, 0.0))
    forbidden = forbidden_of(critic, [[0.2, 0.0, 0.0], [-0.2, 0.0, 0.0], [0.0, 0.0, 0.0]])
    assert forbidden == [True, True, False]


@pytest.mark.parametrize(
    "pose, restricted",
    [
        (Pose2D(1.04, 1.0), True),
        (Pose2D(1.06, 1.0), False),
        (Pose2D(1.0, 1.0, 0.19), True),
        (Pose2D(1.0, 1.0, -0.21), False),
    ],
)
def test_restrictions_end_by_moving_or_turning(pose, restricted):
    critic = noted(OscillationCritic(), (0.0, 0.2, 0.0), (0.0, -0.2, 0.0), pose=Pose2D(1.0, 1.0))
    assert critic.strafe.negative_only
    noted(critic, (0.0, 0.0, 0.0), pose=pose)
    assert critic.strafe.is_restricted == restricted
    assert critic.strafe.going_negative == restricted


# The whole planner


def test_flies_straight_along_a_straight_plan():
    planner = planner_at(line(0.0, 0.0, 4.0, 0.0))

    control = planner.compute_velocity(WINDOW, free(), ORIGIN, Twist2D(0.5))

    assert control.command.vx_mps == pytest.approx(0.55)
    assert control.command.vyaw_radps == control.command.vy_mps == 0.0
    assert not control.goal_mode and control.cost == planner.best.cost
    assert control.global_plan[-1, 0] == pytest.approx(1.6)
    np.testing.assert_allclose(np.diff(control.local_plan[:, 0]), 0.55 * 1.7 / 38, atol=1e-6)
    assert planner.oscillation.forward.going_positive
    assert not planner.is_goal_reached()


def test_no_plan_and_no_plan_near():
    planner = DwaPlanner(PARAMS, SQUARE, PERIOD_S)
    with pytest.raises(NoLocalPlan, match="no global plan"):
        planner.compute_velocity(WINDOW, free(), ORIGIN, REST)
    planner.set_plan(line(5.0, 5.0, 6.0, 5.0))
    with pytest.raises(NoLocalPlan, match="does not come near"):
        planner.compute_velocity(WINDOW, free(), ORIGIN, REST)


def test_no_legal_velocity_fails_and_leaves_the_plan_readable():
    planner = planner_at(line(0.0, 0.0, 1.0, 0.0))
    with pytest.raises(NoValidTrajectory, match="none of the sampled velocities"):
        planner.compute_velocity(WINDOW, boxed_in(4), ORIGIN, REST)
    assert planner.best.cost == NO_LEGAL_TRAJECTORY
    assert len(planner.local_global_plan) == 41


def test_at_the_goal_it_stops_then_turns_then_is_done():
    planner = planner_at(line(-1.0, 0.0, 0.05, 0.0, yaw=1.0))

    control = planner.compute_velocity(WINDOW, free(), ORIGIN, Twist2D(0.6, 0.0, -0.8))
    assert control.command.vx_mps == pytest.approx(0.6 - 2.5 * PERIOD_S)
    assert control.command.vyaw_radps == pytest.approx(-0.8 + 3.2 * PERIOD_S)
    assert control.goal_mode and math.isnan(control.cost) and not len(control.local_plan)

    control = planner.compute_velocity(WINDOW, free(), ORIGIN, REST)
    assert control.command.vyaw_radps == pytest.approx(3.2 * PERIOD_S)
    assert planner.rotating_to_goal and planner.xy_tolerance_latch

    facing = Pose2D(0.0, 0.0, 0.96)
    control = planner.compute_velocity(WINDOW, free(), facing, Twist2D(0.0, 0.0, 0.4))
    assert control.command.is_zero
    assert not planner.rotating_to_goal and not planner.is_goal_reached()  # still turning

    planner.compute_velocity(WINDOW, free(), facing, Twist2D(0.0, 0.0, 0.1))
    assert planner.is_goal_reached()

    planner.set_plan(line(0.0, 0.0, 1.0, 0.0))
    assert not planner.is_goal_reached() and not planner.xy_tolerance_latch


def test_goal_is_the_end_of_the_whole_plan():
    # It leaves the costmap and comes back: the local plan ends far away, the plan does not.
    out_and_back = np.vstack((line(0.0, 0.0, 4.0, 0.0), line(4.0, 0.0, 0.0, 0.05)))
    control = planner_at(out_and_back).compute_velocity(WINDOW, free(), ORIGIN, REST)
    assert control.goal_mode


def test_plan_is_taken_to_the_local_frame():
    planner = planner_at(line(0.0, 0.0, 0.0, 1.0, yaw=0.5))
    # The plan's frame is turned by -90 degrees: its y axis is the local x axis.
    control = planner.compute_velocity(
        WINDOW, free(), Pose2D(1.0, 0.0, 0.0), REST, local_from_plan=Pose2D(0.0, 0.0, -math.pi / 2)
    )
    assert control.goal_mode
    assert control.command.vyaw_radps == pytest.approx(-3.2 * PERIOD_S)


@pytest.mark.parametrize("latch", [True, False])
def test_latched_goal_holds_when_pushed_away(latch):
    planner = planner_at(
        line(-1.0, 0.0, 0.0, 0.0, yaw=1.0), replace(PARAMS, latch_xy_goal_tolerance=latch)
    )
    planner.compute_velocity(WINDOW, free(), ORIGIN, REST)

    control = planner.compute_velocity(WINDOW, free(), Pose2D(-0.3, 0.0), REST)

    assert control.goal_mode == latch


def test_no_room_to_turn_at_the_goal():
    costs = free()
    costs[30, 34] = LETHAL  # x 0.20 to 0.25, y 0 to 0.05: under the outline
    planner = planner_at(line(-1.0, 0.0, 0.0, 0.0, yaw=1.0))
    with pytest.raises(NoValidTrajectory, match="no room to stop and turn"):
        planner.compute_velocity(WINDOW, costs, ORIGIN, REST)
    assert len(planner.cost_cloud()) == 0


def test_the_turn_is_judged_by_the_distances_of_the_last_search():
    plan = line(-1.0, 0.0, 0.0, 0.0, yaw=1.0)
    unreached = free()
    unreached[:, 28] = LETHAL  # x -0.10 to -0.05, between the robot and its goal
    planner = planner_at(plan, replace(PARAMS, occdist_scale=0.0))
    with pytest.raises(NoValidTrajectory):  # the path is cut off from x = 0.3
        planner.compute_velocity(WINDOW, free() + np.uint8(LETHAL), Pose2D(0.3, 0.0), REST)
    with pytest.raises(NoValidTrajectory, match="no room"):
        planner.compute_velocity(WINDOW, free(), Pose2D(0.05, 0.0), REST)
    planner.compute_velocity(WINDOW, free(), Pose2D(-0.3, 0.0), REST)
    assert planner.compute_velocity(WINDOW, unreached, Pose2D(0.05, 0.0), REST).goal_mode


@pytest.mark.parametrize(
    "forget",
    [
        lambda planner: planner.compute_velocity(WINDOW, free(), ORIGIN, REST),
        lambda planner: planner.set_plan(line(0.0, 0.0, 1.0, 0.0)),
    ],
)
def test_a_stop_at_the_goal_and_a_new_plan_forget_oscillations(forget):
    planner = planner_at(line(-1.0, 0.0, 0.0, 0.0, yaw=1.0))
    noted(planner.oscillation, (0.0, 0.0, 0.5), (0.0, 0.0, -0.5))
    forget(planner)
    assert not planner.oscillation.turn.is_restricted


def test_pruning_drops_what_was_passed():
    plan = line(-1.25, 0.0, 0.5, 0.0, count=8)
    for prune, left in ((True, 6), (False, 8)):
        planner = planner_at(plan, replace(PARAMS, prune_plan=prune))
        planner.compute_velocity(WINDOW, free(), ORIGIN, Twist2D(0.3))
        assert len(planner.plan) == left


def test_new_parameters_keep_the_plan_and_the_state():
    planner = planner_at(line(0.0, 0.0, 4.0, 0.0))
    noted(planner.oscillation, (0.0, 0.0, 0.5))

    planner.set_params(replace(PARAMS, max_vel_x_mps=0.2))
    control = planner.compute_velocity(WINDOW, free(), ORIGIN, Twist2D(0.2))

    assert control.command.vx_mps == pytest.approx(0.2)
    assert planner.oscillation.turn.going_positive


def test_cost_cloud_holds_the_cells_a_robot_could_be_in():
    costs = free()
    costs[0, 0], costs[0, 2] = LETHAL, 100
    planner = planner_at(line(0.0, 0.0, 4.0, 0.0))
    planner.compute_velocity(WINDOW, costs, ORIGIN, Twist2D(0.3))

    cloud = planner.cost_cloud()

    assert cloud.shape == (3599, 7) and cloud.dtype == np.float32
    # Cell (2, 0) at x = -1.375, y = -1.475: 28 + 30 cells from the plan's beginning, cell
    # (30, 30), and 57 + 30 from its last cell on the map, (59, 30).
    row = cloud[np.flatnonzero(cloud[:, 5] == 100)[0]]
    np.testing.assert_allclose(row[:3], [-1.375, -1.475, 0.0], atol=1e-6)
    assert row[3:6].tolist() == [58, 87, 100]
    assert row[6] == pytest.approx(0.05 * (0.6 * 58 + 0.8 * 87) + 0.01 * 100)
