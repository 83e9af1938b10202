"""NavFn on maps small enough to be worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest
from costmap_maps import costs_of

from quad_nav.errors import GoalOutsideMap, NoPath, StartOutsideMap
from quad_nav.geometry import Pose2D
from quad_nav.grid import FREE, INSCRIBED, LETHAL, UNKNOWN, GridSpec
from quad_nav.plan.navfn import Navfn, NavfnParams, navigation_costs, path_from, potential_from

CORRIDOR = """
    #######
    .......
    #######
"""
# Up and down through four rows: the cycle limit of a 9 x 9 map is 18 fronts.
SERPENTINE = """
    #########
    #.......#
    #.#######
    #.......#
    #######.#
    #.......#
    #.#######
    #.......#
    #########
"""


def spec_of(costs: np.ndarray) -> GridSpec:
    """One metre per cell, origin at zero: cell (x, y) holds the point (x + 0.5, y + 0.5)."""
    return GridSpec(costs.shape[1], costs.shape[0], 1.0)


def plan_of(costs: np.ndarray, start, goal, **params) -> np.ndarray:
    return Navfn(NavfnParams(**params)).make_plan(
        spec_of(costs),
        costs,
        Pose2D(start[0] + 0.5, start[1] + 0.5),
        Pose2D(goal[0] + 0.5, goal[1] + 0.5, 0.7),
    )


def test_navigation_costs_go_from_neutral_to_obstacle():
    costs = np.zeros((3, 8), dtype=np.uint8)
    costs[1] = [0, 0, 100, 252, INSCRIBED, LETHAL, UNKNOWN, 0]

    assert navigation_costs(costs, allow_unknown=True)[1, 1:-1].tolist() == [
        50,
        130,
        251,
        254,
        254,
        253,
    ]
    assert navigation_costs(costs, allow_unknown=False)[1, 6] == 254


def test_outermost_ring_is_an_obstacle():
    nav_costs = navigation_costs(np.zeros((4, 5), dtype=np.uint8), allow_unknown=True)

    assert (nav_costs == 254).sum() == 14
    assert (nav_costs[1:-1, 1:-1] == 50).all()


def test_potential_in_a_corridor_grows_by_the_cost_of_each_cell():
    nav_costs = navigation_costs(costs_of(CORRIDOR), allow_unknown=True)

    potential = potential_from(nav_costs, source=(1, 1), target=(5, 1), stop_at_target=True)

    assert potential[1].tolist() == [1e10, 0, 50, 100, 150, 200, 1e10]


def test_potential_of_a_diagonal_neighbour_is_that_of_a_planar_wave():
    nav_costs = np.full((7, 7), 50, dtype=np.uint8)
    nav_costs[[0, -1], :] = nav_costs[:, [0, -1]] = 254

    potential = potential_from(nav_costs, source=(3, 3), target=(1, 1), stop_at_target=False)

    assert potential[4, 4] == pytest.approx(50 + 50 * 0.7040)
    np.testing.assert_array_equal(potential, potential.T)
    np.testing.assert_array_equal(potential, potential[::-1])


def test_wave_stops_at_the_target():
    nav_costs = navigation_costs(costs_of(CORRIDOR), allow_unknown=True)

    potential = potential_from(nav_costs, source=(1, 1), target=(3, 1), stop_at_target=True)

    assert potential[1, 3] == 100
    assert potential[1, 4] == np.float32(1e10)


def test_descent_goes_from_the_start_to_the_source():
    potential = np.full((3, 7), 1e10, dtype=np.float32)
    potential[1, 1:6] = [0, 50, 100, 150, 200]

    path, arrived = path_from(potential, start=(5, 1), source=(1, 1))

    assert arrived
    assert path.tolist() == [[5, 1], [4, 1], [3, 1], [2, 1], [1, 1]]


def test_plan_leads_from_the_robot_to_the_exact_goal():
    plan = plan_of(costs_of(CORRIDOR), start=(1, 1), goal=(5, 1))

    assert plan[:-1].tolist() == [[1, 1, 0], [2, 1, 0], [3, 1, 0], [4, 1, 0], [5, 1, 0]]
    assert plan[-1].tolist() == [5.5, 1.5, 0.7]


def test_open_ground_is_crossed_in_half_cell_steps():
    plan = plan_of(np.zeros((9, 20), dtype=np.uint8), start=(3, 4), goal=(15, 4))
    steps = np.diff(plan[:-2, :2], axis=0)

    # Both ends lie beside cells that the wave did not reach: whole steps there.
    np.testing.assert_allclose(np.hypot(steps[1:-1, 0], steps[1:-1, 1]), 0.5, atol=1e-5)
    np.testing.assert_allclose(plan[:-1, 1], 4.0, atol=1e-5)


def test_only_the_cell_of_the_start_is_cleared():
    costs = costs_of(CORRIDOR)
    costs[1, 1:3] = INSCRIBED

    with pytest.raises(NoPath):
        plan_of(costs, start=(1, 1), goal=(5, 1))

    assert costs[1].tolist() == [FREE, FREE, INSCRIBED, FREE, FREE, FREE, FREE]


@pytest.mark.parametrize("allow_unknown", [True, False])
def test_unknown_cells_are_crossed_only_where_allowed(allow_unknown):
    costs = costs_of(CORRIDOR)
    costs[1, 3] = UNKNOWN
    if allow_unknown:
        assert len(plan_of(costs, (1, 1), (5, 1), allow_unknown=True)) == 6
    else:
        with pytest.raises(NoPath):
            plan_of(costs, (1, 1), (5, 1), allow_unknown=False)


def test_start_off_the_map():
    with pytest.raises(StartOutsideMap, match=r"\(-0\.50, 1\.50\)"):
        plan_of(costs_of(CORRIDOR), start=(-1, 1), goal=(5, 1))


def test_goal_off_the_map():
    with pytest.raises(GoalOutsideMap, match=r"\(9\.50, 1\.50\)"):
        plan_of(costs_of(CORRIDOR), start=(1, 1), goal=(9, 1))


def test_within_the_tolerance_the_nearest_reached_point_stands_for_the_goal():
    costs = costs_of(CORRIDOR)

    plan = plan_of(costs, start=(1, 1), goal=(7, 1), default_tolerance_m=2.0)

    assert plan[-1].tolist() == [5.5, 1.5, 0.7]


def test_no_path_beyond_the_tolerance():
    with pytest.raises(NoPath):
        plan_of(costs_of(CORRIDOR), start=(1, 1), goal=(7, 1), default_tolerance_m=1.0)


def test_wave_gives_up_after_its_cycles_though_a_way_exists():
    assert len(plan_of(costs_of(SERPENTINE), start=(1, 1), goal=(7, 3))) > 0
    with pytest.raises(NoPath):
        plan_of(costs_of(SERPENTINE), start=(7, 1), goal=(1, 7))


def test_long_path_is_cut_at_the_robot_end():
    costs = np.full((40, 3), LETHAL, dtype=np.uint8)
    costs[:, 1] = FREE

    plan = plan_of(costs, start=(1, 1), goal=(1, 30))

    assert len(plan) == 4 * 3 + 1
    assert plan[0].tolist() == [1, 19, 0]
    assert plan[-1].tolist() == [1.5, 30.5, 0.7]


def test_potential_stays_readable():
    planner = Navfn()
    assert planner.potential is None

    planner.make_plan(GridSpec(7, 3, 1.0), costs_of(CORRIDOR), Pose2D(1.5, 1.5), Pose2D(3.5, 1.5))

    assert planner.potential.dtype == np.float32
    assert planner.potential[1, :4].tolist() == [1e10, 0, 50, 100]
