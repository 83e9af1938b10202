"""The global planner on maps small enough to be worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest
from costmap_maps import costs_of

from quad_nav.errors import GoalOutsideMap, NoPath, StartOutsideMap
from quad_nav.geometry import Pose2D
from quad_nav.grid import INSCRIBED, LETHAL, UNKNOWN, GridSpec
from quad_nav.plan.global_planner import SearchPlanner, SearchPlannerParams, wave_params

FIELD = """
    .........
    .........
    .........
    .........
    .........
"""
WALL = """
    ...........
    .....#.....
    .....#.....
    ...........
    ...........
"""
CORRIDOR = """
    #######
    .......
    #######
"""
SEARCHES = [
    pytest.param(
        {"use_dijkstra": dijkstra, "use_quadratic": quadratic, "use_grid_path": grid},
        id=f"{'Dijkstra' if dijkstra else 'A*'}, {'quadratic' if quadratic else 'simple'},"
        f" {'grid' if grid else 'gradient'}",
    )
    for dijkstra in (True, False)
    for quadratic in (True, False)
    for grid in (True, False)
]


def spec_of(costs: np.ndarray) -> GridSpec:
    """One metre per cell, origin at zero: (x + 0.5, y + 0.5) is the centre of cell (x, y)."""
    return GridSpec(costs.shape[1], costs.shape[0], 1.0)


def planned(costs: np.ndarray, start, goal, offset_m=0.5, **params):
    """The planner and its plan between two cells, from centre to centre or near them."""
    planner = SearchPlanner(SearchPlannerParams(**params))
    plan = planner.make_plan(
        spec_of(costs),
        costs,
        Pose2D(start[0] + offset_m, start[1] + offset_m, 0.3),
        Pose2D(goal[0] + offset_m, goal[1] + offset_m, 0.7),
    )
    return planner, plan


def plan_of(costs: np.ndarray, start, goal, offset_m=0.5, **params) -> np.ndarray:
    return planned(costs, start, goal, offset_m, **params)[1]


def test_wave_prices_are_scaled_and_end_one_below_lethal():
    costs = [0, 60, 100, 252, INSCRIBED, UNKNOWN]

    params = wave_params(SearchPlannerParams())

    assert params.price[costs].tolist() == [50, 230, 252, 253, 253, 252]
    assert np.isfinite(params.crossing[costs]).tolist() == [True, True, True, False, False, True]
    assert params.crossing[0] == np.float32(50 * 0.707106781)
    # 252 is lethal - 1, and that an obstacle
    assert wave_params(SearchPlannerParams(allow_unknown=False)).price[UNKNOWN] == 253


@pytest.mark.parametrize("params", SEARCHES)
def test_every_search_goes_round_a_wall_from_start_to_goal(params):
    costs = costs_of(WALL)

    plan = plan_of(costs, (2, 2), (8, 2), offset_m=0.6, **params)

    np.testing.assert_allclose(plan[0, :2], 2.5 if params["use_grid_path"] else 2.6, atol=1e-6)
    assert plan[-1].tolist() == [8.6, 2.6, 0.7]
    cells = np.floor(plan[:, :2]).astype(int)
    assert (costs[cells[:, 1], cells[:, 0]] != LETHAL).all()
    assert cells[:, 1].min() == 1  # the only gap


def test_obstacles_within_two_cells_of_the_goal_may_be_cut():
    # As upstream, which gives every cell there a potential.
    costs = costs_of(WALL)
    plan = plan_of(costs, (2, 2), (6, 2), use_grid_path=True)
    assert LETHAL in costs[plan[:, 1].astype(int), plan[:, 0].astype(int)]
    around = plan_of(costs, (2, 2), (6, 2), use_grid_path=True, old_navfn_behavior=True)
    assert LETHAL not in costs[around[:-2, 1].astype(int), around[:-2, 0].astype(int)]


def test_start_and_goal_off_the_map():
    with pytest.raises(StartOutsideMap, match=r"\(-0\.50, 1\.50\)"):
        plan_of(costs_of(CORRIDOR), (-1, 1), (5, 1))
    with pytest.raises(GoalOutsideMap, match=r"\(9\.50, 1\.50\)"):
        plan_of(costs_of(CORRIDOR), (1, 1), (9, 1))


@pytest.mark.parametrize("params", SEARCHES)
def test_without_an_outline_the_border_may_be_used(params):
    costs = costs_of(FIELD)
    planner, plan = planned(costs, (0, 0), (8, 4), 0.6, outline_map=False, **params)
    np.testing.assert_allclose(plan[0, :2], 0.5 if params["use_grid_path"] else 0.6, atol=1e-6)
    assert plan[-1].tolist() == [8.6, 4.6, 0.7]
    assert planner.potential.shape == costs.shape
    assert LETHAL not in costs
    with pytest.raises(NoPath):
        plan_of(costs, (0, 0), (8, 4), 0.6, **params)
