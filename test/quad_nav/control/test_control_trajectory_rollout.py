"""Distances, footprint costs, rollouts and velocity windows, with numbers worked out by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from costmap_maps import costs_of
from local_planner_cases import ORIGIN, REST, SQUARE, WINDOW, free, line

from quad_nav.control.map_grid import distance_grids
from quad_nav.control.rollout import Rollout
from quad_nav.control.trajectory_planner import TrajectoryPlannerParams
from quad_nav.costmap.collision import footprint_cost, highest_near
from quad_nav.costmap.cost_grid import costmap_view
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

    grids = distance_grids(costmap_view(spec, costs), plan, SQUARE, (0.5, 0.5, 0.0))

    assert grids.path.tolist() == [[2, 3, 3, 2, 3], [1, 15, 15, 1, 2], [0, 0, 0, 0, 1]]
    assert grids.goal.tolist() == [[5, 4, 3, 2, 3], [4, 15, 15, 1, 2], [3, 2, 1, 0, 1]]


# Footprint


@pytest.mark.parametrize(
    "cost, under_the_outline",
    [(0, 0), (100, 100), (INSCRIBED, INSCRIBED), (LETHAL, -1), (UNKNOWN, -2)],
)
def test_footprint_cost_is_the_highest_under_the_outline(cost, under_the_outline):
    costs = free()
    costs[30, 34] = cost  # x 0.20 to 0.25, y 0.00 to 0.05

    assert (
        footprint_cost(costmap_view(WINDOW, costs), SQUARE, (0.02, 0.0, 0.0)) == under_the_outline
    )


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
