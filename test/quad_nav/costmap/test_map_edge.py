"""Plans keep off the edge of the global costmap, beyond which there may be a wall."""

from __future__ import annotations

import numpy as np
import pytest

from quad_nav.config import load
from quad_nav.costmap.map_edge import closed_edge
from quad_nav.errors import PlanningError
from quad_nav.geometry import Pose2D
from quad_nav.grid import FREE, LETHAL
from quad_nav.scenario.assembly import build_navigator

RADIUS_M = 0.5  # 5 cells
SIZE_M = 10.0
START, GOAL = Pose2D(2.0, 5.0), Pose2D(8.0, 5.0)
TREE = {
    "robot_radius": RADIUS_M,
    "footprint_padding": 0.0,
    "width": SIZE_M,
    "height": SIZE_M,
    "resolution": 0.1,
    "static_map": False,
}


def navigator_with(costmap=None, **own):
    """A navigator before a wall across its map, from y = 0.5 m up: only the edge is free."""
    tree = {"global_costmap": {**TREE, **(costmap or {})}, **own}
    navigator = build_navigator(load(tree))
    navigator.global_costmap.costs[5:, 50] = LETHAL
    return navigator


def lowest_y_m(plan):
    return float(plan[:, 1].min())


def test_a_plan_does_not_lead_between_an_obstacle_and_the_edge():
    navigator = navigator_with()
    navigator.global_costmap.costs[-8:, 50] = FREE  # a gap of 0.8 m at the other end
    plan = navigator.make_plan(START, GOAL)
    assert 9.2 <= plan[:, 1].max() <= SIZE_M - RADIUS_M


def test_upstream_plans_along_the_edge():
    navigator = navigator_with(plan_inside_map=False)
    assert lowest_y_m(navigator.make_plan(START, GOAL)) < RADIUS_M


@pytest.mark.parametrize("start, goal", [(Pose2D(2.0, 0.45), GOAL), (START, Pose2D(8.0, 0.45))])
def test_a_robot_leaves_the_edge_and_flies_to_it(start, goal):
    navigator = navigator_with()
    plan = navigator.make_plan(start, goal)
    assert lowest_y_m(plan) < RADIUS_M
    assert plan[-1, :2].tolist() == [goal.x_m, goal.y_m]


def test_costs_are_what_they_were_after_the_search():
    costmap = navigator_with().global_costmap
    costmap.costs[...] = np.random.default_rng(0).integers(0, 255, costmap.costs.shape)
    before = costmap.costs.copy()
    with pytest.raises(PlanningError):
        with closed_edge(costmap, START, GOAL):
            edge = np.ones_like(before, dtype=bool)
            edge[5:-5, 5:-5] = False
            assert (costmap.costs[edge] == LETHAL).all()
            np.testing.assert_array_equal(costmap.costs[~edge], before[~edge])
            raise PlanningError("no plan")
    np.testing.assert_array_equal(costmap.costs, before)


def test_a_gap_as_wide_as_the_strip_is_no_way():
    navigator = navigator_with()
    with pytest.raises(PlanningError):
        navigator.make_plan(START, GOAL)
