"""The trajectory planner's parts, with numbers worked out by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from costmap_maps import costs_of

from quad_nav.control.goal import is_stopped, stopping_command, turning_command
from quad_nav.control.map_grid import distance_grids
from quad_nav.control.oscillation import Oscillation
from quad_nav.control.plan_follower import count_passed, plan_in_window
from quad_nav.control.rollout import Rollout, costmap_view, footprint_cost
from quad_nav.control.trajectory_planner import TrajectoryPlanner, TrajectoryPlannerParams
from quad_nav.control.velocity_search import spaced, velocity_window
from quad_nav.errors import NoLocalPlan, NoValidTrajectory
from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.grid import INSCRIBED, LETHAL, UNKNOWN, GridSpec

REST = Twist2D()
ORIGIN = Pose2D(0.0, 0.0)
PARAMS = TrajectoryPlannerParams(
    holonomic_robot=False, reject_colliding_escape=False, predict_goal_turn=False
)
SQUARE = np.array([[0.2, 0.2], [-0.2, 0.2], [-0.2, -0.2], [0.2, -0.2]])
# 3 m x 3 m of 5 cm cells around (0, 0)
WINDOW = GridSpec(60, 60, 0.05, -1.5, -1.5)


def free() -> np.ndarray:
    return np.zeros(WINDOW.shape, dtype=np.uint8)


def boxed_in() -> np.ndarray:
    """A lethal ring 0.3 m around (0, 0), outside the square footprint."""
    costs = free()
    costs[24:36, 24:36] = LETHAL
    costs[25:35, 25:35] = 0
    return costs


def line(x0: float, y0: float, x1: float, y1: float, yaw: float = 0.0, count: int = 41):
    return np.column_stack(
        (np.linspace(x0, x1, count), np.linspace(y0, y1, count), np.full(count, yaw))
    )


def rollout(costs=None, pose=ORIGIN, velocity=REST, params=PARAMS, plan=None):
    return Rollout(
        params,
        WINDOW,
        free() if costs is None else costs,
        SQUARE,
        line(0.0, 0.0, 1.0, 0.0) if plan is None else plan,
        pose,
        velocity,
    )


def planner_at(plan, params=PARAMS, period_s=0.2) -> TrajectoryPlanner:
    planner = TrajectoryPlanner(params, SQUARE, period_s)
    planner.set_plan(plan)
    return planner


# Distances


def test_distances_go_round_obstacles_and_mark_what_they_touch():
    costs = costs_of("""
        .....
        .##..
        .....
    """)
    spec = GridSpec(5, 3, 1.0)
    plan = np.array([[0.5, 2.5], [3.5, 2.5]])

    grids = distance_grids(costmap_view(spec, costs), plan, SQUARE, Pose2D(0.5, 0.5))

    assert grids.path.tolist() == [[2, 3, 3, 2, 3], [1, 15, 15, 1, 2], [0, 0, 0, 0, 1]]
    assert grids.goal.tolist() == [[5, 4, 3, 2, 3], [4, 15, 15, 1, 2], [3, 2, 1, 0, 1]]


def test_path_distance_forgives_obstacles_under_the_robot():
    costs = costs_of("""
        ...
        ###
        ...
    """)
    window = costmap_view(GridSpec(3, 3, 1.0), costs)
    plan = np.array([[0.5, 2.5], [2.5, 2.5]])

    grids = distance_grids(window, plan, SQUARE, Pose2D(1.5, 1.5))

    assert grids.within_robot.tolist() == [[False] * 3, [False, True, False], [False] * 3]
    assert grids.path.tolist() == [[3, 2, 3], [9, 1, 9], [0, 0, 0]]
    assert grids.goal.tolist() == [[10, 10, 10], [9, 9, 9], [2, 1, 0]]


def test_nothing_is_reached_from_a_plan_off_the_map():
    window = costmap_view(GridSpec(3, 3, 1.0), np.zeros((3, 3), dtype=np.uint8))

    grids = distance_grids(window, np.array([[5.0, 5.0]]), SQUARE, Pose2D(1.5, 1.5))

    assert (grids.path == 10).all() and (grids.goal == 10).all()


def test_local_goal_is_the_end_of_the_first_stretch_inside():
    window = costmap_view(GridSpec(4, 1, 1.0), np.zeros((1, 4), dtype=np.uint8))
    plan = np.array([[-0.5, 0.5], [0.5, 0.5], [1.5, 0.5], [1.5, 1.5], [3.5, 1.5], [3.5, 0.5]])

    grids = distance_grids(window, plan, SQUARE, Pose2D(0.5, 0.5))

    assert grids.goal.tolist() == [[1, 0, 1, 2]]


# Footprint


@pytest.mark.parametrize(
    "cost, under_the_outline",
    [(0, 0), (100, 100), (INSCRIBED, INSCRIBED), (LETHAL, -1), (UNKNOWN, -2)],
)
def test_footprint_cost_is_the_highest_under_the_outline(cost, under_the_outline):
    costs = free()
    costs[30, 34] = cost  # x 0.20 to 0.25, y 0.00 to 0.05

    assert footprint_cost(WINDOW, costs, SQUARE, Pose2D(0.02, 0.0)) == under_the_outline


def test_obstacle_inside_the_outline_is_not_seen():
    costs = free()
    costs[30, 30] = LETHAL

    assert footprint_cost(WINDOW, costs, SQUARE, Pose2D(0.0, 0.0)) == 0


@pytest.mark.parametrize("x_m", [-1.4, 1.4, 5.0])
def test_footprint_off_the_map(x_m):
    assert footprint_cost(WINDOW, free(), SQUARE, Pose2D(x_m, 0.0)) == -3


# Rollout


def test_straight_trajectory_advances_by_the_granularity():
    trajectory = rollout(velocity=Twist2D(0.5)).trajectory((0.5, 0.0, 0.0))

    assert len(trajectory.points) == 34  # 0.5 m/s * 1.7 s / 0.025 m
    np.testing.assert_allclose(trajectory.points[:, 0], 0.025 * np.arange(34), atol=1e-12)
    assert not trajectory.points[:, 1:].any()


def test_velocity_follows_the_acceleration_limit():
    params = replace(PARAMS, acc_lim_x_mps2=1.0, sim_time_s=1.0, sim_granularity_m=0.25)

    trajectory = rollout(params=params).trajectory((1.0, 0.0, 0.0))

    # dt 0.25 s: 0.25, 0.5, 0.75 m/s
    np.testing.assert_allclose(trajectory.points[:, 0], [0.0, 0.0625, 0.1875, 0.375], atol=1e-12)


def test_cost_is_the_weighted_sum_at_the_last_pose():
    costs = free()
    costs[34, 28:33] = 50  # under the outline's left side along the whole path
    params = replace(
        PARAMS,
        sim_time_s=1.0,
        sim_granularity_m=0.25,
        path_distance_bias=2.0,
        goal_distance_bias=3.0,
        occdist_scale=0.1,
    )
    plan = line(0.01, 0.11, 1.01, 0.11)

    trajectory = rollout(
        costs, pose=Pose2D(0.01, 0.01), velocity=Twist2D(0.5), params=params, plan=plan
    ).trajectory((0.5, 0.0, 0.0))

    # Last pose x = 0.26: 2 cells to the path, 15 + 2 to the goal, 5 cm each.
    assert trajectory.cost == pytest.approx(2.0 * 0.05 * 2 + 3.0 * 0.05 * 17 + 0.1 * 50)


def test_without_meter_scoring_distances_count_in_cells():
    params = replace(
        PARAMS,
        meter_scoring=False,
        respect_meter_scoring=True,
        path_distance_bias=1.0,
        goal_distance_bias=10.0,
    )
    plan = line(0.01, 0.11, 1.01, 0.11)

    cost = rollout(pose=Pose2D(0.01, 0.01), params=params, plan=plan).trajectory((0.0,) * 3).cost

    assert cost == 1.0 * 2 + 10.0 * 22


def test_collision_and_no_way_end_a_trajectory():
    assert rollout(boxed_in()).trajectory((0.5, 0.0, 0.0)).cost == -2.0
    costs = free()
    costs[:, 40] = LETHAL  # x = 0.5, behind the local goal
    blocked = rollout(costs, plan=line(0.0, 0.0, 0.45, 0.0), velocity=Twist2D(0.5))
    trajectory = blocked.trajectory((0.5, 0.0, 0.0))
    assert trajectory.cost == -1.0
    np.testing.assert_allclose(trajectory.points[-1, 0], 0.275)  # 0.30 + 0.20 touches the wall


def test_scores_equal_single_trajectories():
    costs = free()
    costs[10:20, 40:50] = LETHAL
    costs[20:24, 36:52] = 120
    scored = rollout(costs, velocity=Twist2D(0.2, 0.0, 0.3))
    samples = np.array([[0.3, 0.0, -1.0], [0.5, 0.0, 0.5], [0.0, 0.0, 1.0], [0.1, -0.3, 0.0]])

    values, ends = scored.score(samples)

    for sample, value, end in zip(samples.tolist(), values, ends):
        trajectory = scored.trajectory(tuple(sample))
        assert value == trajectory.cost
        assert end.tolist() == trajectory.points[-1].tolist()


def test_cost_cloud_holds_the_cells_a_robot_could_be_in():
    costs = free()
    costs[0, 0], costs[0, 1], costs[0, 2] = LETHAL, INSCRIBED, 100
    cloud = rollout(costs).cost_cloud()

    under_robot = int(rollout(costs).grids.within_robot.sum())
    assert len(cloud) == 3600 - under_robot - 2
    # Cell (2, 0) at x = -1.375, y = -1.475: 28 cells left of the path and 30 below it.
    row = cloud[np.flatnonzero(cloud[:, 5] == 100)[0]]
    np.testing.assert_allclose(row[:3], [-1.375, -1.475, 0.0], atol=1e-6)
    assert row[3:6].tolist() == [58, 30 + 48, 100]
    assert row[6] == pytest.approx(0.6 * 0.05 * 58 + 0.8 * 0.05 * 78 + 0.01 * 100)


# Velocities


def test_spaced_sums_its_steps():
    values, step = spaced(0.1, 0.3, 3)
    assert values.tolist() == [0.1, 0.1 + step, 0.1 + step + step]
    assert spaced(0.1, 0.3, 1)[0].tolist() == [0.1]


def test_velocity_window_without_dwa_spans_the_whole_simulation():
    params = replace(PARAMS, acc_lim_x_mps2=0.1, acc_lim_theta_radps2=0.2, sim_time_s=2.0)

    window = velocity_window(rollout(velocity=Twist2D(0.25, 0.0, 0.125)), params, 0.05)

    assert window.min_vx_mps == pytest.approx(0.05)
    assert window.max_vx_mps == pytest.approx(0.45)
    assert window.min_vtheta_radps == pytest.approx(-0.275)
    assert window.max_vtheta_radps == pytest.approx(0.525)


def test_velocity_window_with_dwa_spans_one_period():
    params = replace(PARAMS, acc_lim_x_mps2=1.0, acc_lim_theta_radps2=2.0, dwa=True)

    window = velocity_window(rollout(velocity=Twist2D(0.25, 0.0, 0.125)), params, 0.05)

    assert (window.min_vx_mps, window.max_vx_mps) == pytest.approx((0.2, 0.3))
    assert (window.min_vtheta_radps, window.max_vtheta_radps) == pytest.approx((0.025, 0.225))


def test_top_speed_does_not_overshoot_the_local_goal():
    near = rollout(plan=line(0.0, 0.0, 0.34, 0.0))
    assert velocity_window(near, PARAMS, 0.05).max_vx_mps == pytest.approx(0.2)


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
        planner.compute_velocity(WINDOW, boxed_in(), ORIGIN, REST)
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
