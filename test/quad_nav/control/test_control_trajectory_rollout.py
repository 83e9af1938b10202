"""Distances, footprint costs, rollouts and velocity windows, with numbers worked out by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from costmap_maps import costs_of
from local_planner_cases import ORIGIN, REST, SQUARE, WINDOW, boxed_in, free, line

from quad_nav.control.map_grid import distance_grids
from quad_nav.control.rollout import Rollout, costmap_view, footprint_cost
from quad_nav.control.trajectory_planner import TrajectoryPlannerParams
from quad_nav.control.velocity_search import velocity_window
from quad_nav.control.velocity_search_kernel import spaced
from quad_nav.costmap.collision import highest_near
from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.grid import INSCRIBED, LETHAL, UNKNOWN, GridSpec

PARAMS = TrajectoryPlannerParams(
    holonomic_robot=False,
    reject_colliding_escape=False,
    end_blocked_escape=False,
    predict_goal_turn=False,
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


@pytest.mark.parametrize("reach_m, travel_m", [(0.2, 0.3), (0.02, 0.5), (0.9, 5.0), (9.0, 0.1)])
def test_highest_near_is_the_highest_in_a_square(reach_m, travel_m):
    random = np.random.default_rng(0)
    costs = random.integers(0, 250, WINDOW.shape).astype(np.uint8)
    costs[random.random(WINDOW.shape) < 0.9] = 0
    x, y = 0.6, -1.3

    needle = np.array([[0.0, 0.0], [-0.5 * reach_m, 0.0]])
    found = highest_near(costmap_view(WINDOW, costs), needle, 2.0, x, y, travel_m)

    reach = min(int(reach_m / 0.05), 60) + 1
    padded = np.pad(costs, reach, constant_values=UNKNOWN)
    squares = np.lib.stride_tricks.sliding_window_view(padded, (2 * reach + 1,) * 2)
    centres = -1.475 + 0.05 * np.arange(60)
    travelled = (abs(centres - y)[:, None] <= travel_m) & (abs(centres - x) <= travel_m)
    expected = squares.max(axis=(2, 3))
    assert (found[travelled] == expected[travelled]).all()
    assert ((found == expected) | (found == UNKNOWN)).all()


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
    assert rollout(boxed_in(5)).trajectory((0.5, 0.0, 0.0)).cost == -2.0
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
