"""The global planner on maps small enough to be worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest
from costmap_maps import costs_of, drawn, picture

from quad_nav.errors import GoalOutsideMap, NoPath, StartOutsideMap
from quad_nav.geometry import Pose2D
from quad_nav.grid import INSCRIBED, LETHAL, UNKNOWN, GridSpec
from quad_nav.plan.global_planner import (
    SearchPlanner,
    SearchPlannerParams,
    byte_costs,
    wave_params,
)
from quad_nav.plan.orientations import OrientationMode

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
WALL_ACROSS = """
    .........
    ....#....
    ....#....
    .........
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


def test_wave_adds_whole_prices_and_compares_exact_ones():
    params = wave_params(SearchPlannerParams(neutral_cost=66, cost_factor=0.55))

    assert params.price[[0, 60, 100]].tolist() == [66, 99, 121]
    assert params.price[1] == 66
    assert params.crossing[1] == pytest.approx(66.55 * 0.707106781)


def test_step_costs_of_a_star_are_bytes():
    costs = np.array([[0, 100, 205, 206, 252, UNKNOWN]], dtype=np.uint8)
    assert byte_costs(costs, SearchPlannerParams()).tolist() == [50, 150, 255, 0, 46, 49]


def test_potential_of_a_corridor():
    for params in ({}, {"use_quadratic": False}, {"use_dijkstra": False}):
        planner, _ = planned(
            costs_of(CORRIDOR),
            (1, 1),
            (5, 1),
            use_grid_path=True,
            old_navfn_behavior=True,
            **params,
        )
        assert planner.potential[1].tolist() == [1e10, 0, 50, 100, 150, 200, 1e10]


def test_potential_of_a_diagonal_neighbour():
    planar, _ = planned(costs_of(FIELD), (3, 2), (5, 2), old_navfn_behavior=True)
    simple, _ = planned(
        costs_of(FIELD), (3, 2), (5, 2), old_navfn_behavior=True, use_quadratic=False
    )

    assert planar.potential[3, 4] == pytest.approx(50 + 50 * 0.7040)
    assert simple.potential[3, 4] == 100


def test_wave_begins_in_the_four_cells_around_the_robot():
    costs = costs_of(FIELD)
    planner = SearchPlanner()

    planner.make_plan(spec_of(costs), costs, Pose2D(3.75, 2.75), Pose2D(6.5, 2.5))

    # A quarter of a cell right of and above the centre of cell (3, 2).
    assert planner.potential[2, 3] == pytest.approx(100 * 0.25 * 0.25)
    assert planner.potential[2, 4] == pytest.approx(100 * 0.75 * 0.25)
    assert planner.potential[3, 3] == pytest.approx(100 * 0.25 * 0.75)
    assert planner.potential[3, 4] == pytest.approx(100 * 0.75 * 0.75)


def test_a_star_leaves_alone_what_lies_the_wrong_way():
    wide = np.zeros((30, 30), dtype=np.uint8)
    dijkstra, _ = planned(wide.copy(), (15, 15), (25, 15))
    a_star, _ = planned(wide.copy(), (15, 15), (25, 15), use_dijkstra=False)

    assert dijkstra.potential[15, 8] < 1e10
    assert a_star.potential[15, 8] == np.float32(1e10)


@pytest.mark.parametrize("params", SEARCHES)
def test_every_search_goes_round_a_wall_from_start_to_goal(params):
    costs = costs_of(WALL)

    plan = plan_of(costs, (2, 2), (8, 2), offset_m=0.6, **params)

    np.testing.assert_allclose(plan[0, :2], 2.5 if params["use_grid_path"] else 2.6, atol=1e-6)
    assert plan[-1].tolist() == [8.6, 2.6, 0.7]
    cells = np.floor(plan[:, :2]).astype(int)
    assert (costs[cells[:, 1], cells[:, 0]] != LETHAL).all()
    assert cells[:, 1].min() == 1  # the only gap


@pytest.mark.parametrize("params", SEARCHES)
def test_no_search_goes_through_a_wall(params):
    with pytest.raises(NoPath, match=r"\(1\.60, 1\.60\) to \(7\.60, 1\.60\)"):
        plan_of(costs_of(WALL_ACROSS), (1, 1), (7, 1), offset_m=0.6, **params)


def test_obstacles_within_two_cells_of_the_goal_may_be_cut():
    # As upstream, which gives every cell there a potential.
    costs = costs_of(WALL)
    plan = plan_of(costs, (2, 2), (6, 2), use_grid_path=True)
    assert LETHAL in costs[plan[:, 1].astype(int), plan[:, 0].astype(int)]
    around = plan_of(costs, (2, 2), (6, 2), use_grid_path=True, old_navfn_behavior=True)
    assert LETHAL not in costs[around[:-2, 1].astype(int), around[:-2, 0].astype(int)]


def test_grid_path_goes_over_centres_of_cells():
    plan = plan_of(costs_of(CORRIDOR), (1, 1), (5, 1), use_grid_path=True)
    assert plan[:, 0].tolist() == [1.5, 2.5, 3.5, 4.5, 5.5, 5.5]
    assert plan[:, 1].tolist() == [1.5] * 6


def test_old_navfn_behaviour_goes_over_lower_left_corners_and_ends_with_the_goal_twice():
    plan = plan_of(costs_of(CORRIDOR), (1, 1), (5, 1), old_navfn_behavior=True)
    assert plan[:, 0].tolist() == [1, 2, 3, 4, 5, 5.5, 5.5]
    assert plan[:-2, 1].tolist() == [1] * 5


def test_gradient_path_takes_half_cells():
    plan = plan_of(np.zeros((9, 20), dtype=np.uint8), (3, 4), (15, 4))
    steps = np.diff(plan[1:-1, :2], axis=0)
    np.testing.assert_allclose(np.hypot(steps[:, 0], steps[:, 1]), 0.5, atol=1e-5)


def test_lower_left_half_of_a_cell_belongs_to_the_neighbour_for_whole_cells_only():
    start, goal = Pose2D(1.5, 1.5), Pose2D(5.5, 1.3)  # y 0.8 in cells: in the wall
    for params in ({"use_dijkstra": False}, {"use_grid_path": True}):
        costs = costs_of(CORRIDOR)
        with pytest.raises(NoPath):
            SearchPlanner(SearchPlannerParams(**params)).make_plan(
                spec_of(costs), costs, start, goal
            )


def test_outline_and_cleared_start_are_written_into_the_costmap():
    costs = costs_of(FIELD)
    costs[2, 2] = INSCRIBED
    plan_of(costs, (2, 2), (6, 2))
    assert picture(costs) == drawn("""
        #########
        #.......#
        #.......#
        #.......#
        #########
    """)


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


@pytest.mark.parametrize("use_dijkstra", [True, False])
def test_unknown_cells_are_crossed_only_where_allowed(use_dijkstra):
    costs = costs_of(CORRIDOR)
    costs[1, 3] = UNKNOWN
    params = {"use_dijkstra": use_dijkstra, "use_grid_path": True}
    assert len(plan_of(costs.copy(), (1, 1), (5, 1), **params)) == 6
    with pytest.raises(NoPath):
        plan_of(costs, (1, 1), (5, 1), allow_unknown=False, **params)


def test_start_and_goal_off_the_map():
    with pytest.raises(StartOutsideMap, match=r"\(-0\.50, 1\.50\)"):
        plan_of(costs_of(CORRIDOR), (-1, 1), (5, 1))
    with pytest.raises(GoalOutsideMap, match=r"\(9\.50, 1\.50\)"):
        plan_of(costs_of(CORRIDOR), (1, 1), (9, 1))


def test_headings_follow_the_path_and_end_with_the_goals():
    ahead = plan_of(costs_of(CORRIDOR), (1, 1), (5, 1), use_grid_path=True)
    assert ahead[:-1, 2].tolist() == [0.0] * 5
    assert ahead[-1, 2] == 0.7
    astern = plan_of(
        costs_of(CORRIDOR),
        (1, 1),
        (5, 1),
        use_grid_path=True,
        orientation_mode=OrientationMode.BACKWARD,
    )
    np.testing.assert_allclose(np.abs(astern[:-2, 2]), np.pi)
    turning = plan_of(
        costs_of(CORRIDOR),
        (1, 1),
        (5, 1),
        use_grid_path=True,
        orientation_mode=OrientationMode.INTERPOLATE,
    )
    np.testing.assert_allclose(turning[:, 2], np.linspace(0.3, 0.7, 6))
