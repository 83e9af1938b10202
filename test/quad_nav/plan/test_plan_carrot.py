"""The carrot planner on maps small enough to be worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest
from costmap_maps import costs_of

from quad_nav.errors import NoPath
from quad_nav.geometry import Pose2D
from quad_nav.grid import GridSpec
from quad_nav.plan.carrot import Carrot, CarrotParams

# A square robot of 0.8 m, so that it fills its cell.
ROBOT = np.array([[0.4, 0.4], [-0.4, 0.4], [-0.4, -0.4], [0.4, -0.4]])
FIELD = """
    ...........
    ...........
    ...........
"""
WALL = """
    .....#.....
    .....#.....
    .....#.....
"""
START, GOAL = Pose2D(0.5, 1.5, 0.0), Pose2D(10.5, 1.5, 0.0)


def plan_of(text: str, start: Pose2D, goal: Pose2D, robot: np.ndarray = ROBOT) -> np.ndarray:
    costs = costs_of(text)
    return Carrot(CarrotParams(), robot).make_plan(
        GridSpec(costs.shape[1], costs.shape[0], 1.0), costs, start, goal
    )


def test_straight_to_a_free_goal():
    assert plan_of(FIELD, START, GOAL).tolist() == [[0.5, 1.5, 0.0], [10.5, 1.5, 0.0]]


def test_a_goal_in_a_wall_is_drawn_back_a_hundredth_at_a_time():
    plan = plan_of(WALL, START, Pose2D(5.5, 1.5))
    # The front corners at x + 0.4 are clear of the wall at 5 m from x < 4.6 on: steps of 0.05 m.
    assert plan[-1].tolist() == pytest.approx([4.55, 1.5, 0.0])


def test_heading_is_drawn_back_with_the_position_the_short_way():
    square = 0.2 * ROBOT
    plan = plan_of(FIELD, Pose2D(0.5, 1.5, 3.0), Pose2D(20.5, 1.5, -3.0), square)
    share = (plan[-1, 0] - 0.5) / 20.0
    turned = 3.0 + share * (2 * np.pi - 6.0)
    assert np.cos(plan[-1, 2] - turned) == pytest.approx(1.0)
    assert plan[0].tolist() == [0.5, 1.5, 3.0]


def test_nowhere_to_be():
    with pytest.raises(NoPath, match=r"\(5\.50, 1\.50\) to \(5\.50, 2\.50\)"):
        plan_of(WALL, Pose2D(5.5, 1.5), Pose2D(5.5, 2.5))
