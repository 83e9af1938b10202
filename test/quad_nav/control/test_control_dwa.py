"""The dynamic window planner and its oscillation critic, with numbers worked out by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from local_planner_cases import ORIGIN, REST, SQUARE, WINDOW, free, line

from quad_nav.control.dwa_oscillation import OscillationCritic
from quad_nav.control.dwa_planner import DwaParams, DwaPlanner
from quad_nav.control.dwa_search import is_forbidden
from quad_nav.errors import NoValidTrajectory
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


# The whole planner


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


def test_cost_cloud_holds_the_cells_a_robot_could_be_in():
    costs = free()
    costs[0, 0], costs[0, 2] = LETHAL, 100
    plan, with_cloud = line(0.0, 0.0, 4.0, 0.0), replace(PARAMS, publish_cost_grid_pc=True)
    planner, silent = planner_at(plan, with_cloud), planner_at(plan)
    for each in (planner, silent):
        each.compute_velocity(WINDOW, costs, ORIGIN, Twist2D(0.3))

    cloud = planner.cost_cloud()

    assert len(silent.cost_cloud()) == 0

    assert cloud.shape == (3599, 7) and cloud.dtype == np.float32
    # Cell (2, 0) at x = -1.375, y = -1.475: 28 + 30 cells from the plan's beginning, cell
    # (30, 30), and 57 + 30 from its last cell on the map, (59, 30).
    row = cloud[np.flatnonzero(cloud[:, 5] == 100)[0]]
    np.testing.assert_allclose(row[:3], [-1.375, -1.475, 0.0], atol=1e-6)
    assert row[3:6].tolist() == [58, 87, 100]
    assert row[6] == pytest.approx(0.05 * (0.6 * 58 + 0.8 * 87) + 0.01 * 100)


def test_trajectories_have_the_cost_that_upstream_has_added_up():
    """Three samples of two poses: they turn by -0.4, 0 and 0.4 rad/s, which costs 0.4, 0, 0.4.

    Obstacles cost 10 each. Only the last trajectory, turned left by 0.2 rad at x = 0.1, has a
    corner in the cell of cost 50, and its turn is no longer added.
    """
    params = replace(
        PARAMS,
        **{"min_vel_x_mps": 0.2, "max_vel_x_mps": 0.2, "max_vel_theta_radps": 0.4},
        **{"sim_time_s": 1.0, "sim_granularity_m": 0.15, "angular_sim_granularity_rad": 0.25},
        **{"path_distance_bias": 0.0, "goal_distance_bias": 0.0, "vth_samples": 3},
        **{"occdist_scale": 1.0, "twirling_scale": 1.0},
    )
    costs = free() + np.uint8(10)
    costs[27, 36] = 50
    planner = DwaPlanner(params, 0.95 * np.asarray(SQUARE), PERIOD_S)
    assert planner.pop_trajectories() is None
    planner.set_plan(line(0.0, 0.0, 4.0, 0.0))
    planner.compute_velocity(WINDOW, costs, ORIGIN, Twist2D(0.2))

    points = planner.pop_trajectories()

    np.testing.assert_allclose(points[:, 0], [0.0, 0.1] * 3, atol=1e-6)
    assert not points[:, 1:3].any()
    np.testing.assert_allclose(points[:, 3], [0.0, -0.2, 0.0, 0.0, 0.0, 0.2], atol=1e-6)
    np.testing.assert_allclose(points[:, 4], [10.4, 10.4, 10.0, 10.0, 50.0, 50.0], atol=1e-5)
    assert planner.pop_trajectories() is None


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
