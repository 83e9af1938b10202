"""NavFn on maps small enough to be worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest
from costmap_maps import costs_of

from quad_nav.errors import NoPath
from quad_nav.geometry import Pose2D
from quad_nav.grid import FREE, LETHAL, GridSpec
from quad_nav.plan.navfn import Navfn, NavfnParams, path_from, potential_from
from quad_nav.plan.wavefront_kernel import (
    NOT_REACHED,
    WaveParams,
    arrival_at,
    crossings,
    propagate,
    push,
    start_at_cell,
)

CORRIDOR = """
    #######
    .......
    #######
"""
# Up and down through four rows: the cycle limit of a 9 x 9 map is 18 fronts.


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


def test_potential_of_a_diagonal_neighbour_is_that_of_a_planar_wave():
    nav_costs = np.full((7, 7), 50, dtype=np.uint8)
    nav_costs[[0, -1], :] = nav_costs[:, [0, -1]] = 254

    potential = potential_from(nav_costs, source=(3, 3), target=(1, 1), stop_at_target=False)

    assert potential[4, 4] == pytest.approx(50 + 50 * 0.7040)
    np.testing.assert_array_equal(potential, potential.T)
    np.testing.assert_array_equal(potential, potential[::-1])


def test_long_path_is_cut_at_the_robot_end():
    costs = np.full((40, 3), LETHAL, dtype=np.uint8)
    costs[:, 1] = FREE

    plan = plan_of(costs, start=(1, 1), goal=(1, 30))

    assert len(plan) == 4 * 3 + 1
    assert plan[0].tolist() == [1, 19, 0]
    assert plan[-1].tolist() == [1.5, 30.5, 0.7]


@pytest.mark.parametrize(
    "end, wanted, kept",
    [
        (0, (True, True, False, True), [1, 2, 4]),  # cell 3 is not wanted
        (0, (True, True, True, True), [1, 2, 3, 4]),
        (3, (True, True, True, True), [1, 2]),  # five places
        (5, (True, True, True, True), []),
    ],
)
def test_full_bucket_drops_cells(end, wanted, kept):
    buckets, states = np.full(6, 99, dtype=np.uint32), np.arange(10, 17, dtype=np.uint8)
    cells = tuple(np.uint64(cell) for cell in (1, 2, 3, 4))
    before = tuple(states[1:5])

    after = push(buckets, np.uint64(end), np.uint64(1), states, cells, before, wanted, True)

    assert after == end + len(kept)
    assert buckets[end:after].tolist() == kept
    assert np.flatnonzero(states == LETHAL).tolist() == kept
    assert (states == LETHAL)[kept].all()
    others = [cell for cell in range(7) if cell not in kept]
    assert states[others].tolist() == [10 + cell for cell in others]


def plain_wave(costs, params, source, target, size_x, max_fronts) -> np.ndarray:
    """Spread a wave cell by cell, as upstream does: with a set of the cells in buckets."""
    potential = np.full(costs.size, NOT_REACHED, dtype=np.float32)
    y, x = np.divmod(np.arange(costs.size), size_x)
    closed = (x % (size_x - 1) == 0) | (y % (costs.size // size_x - 1) == 0)
    closed |= ~np.isfinite(params.crossing[costs])
    front = [n for n in start_at_cell(potential, source, size_x) if not closed[n]]
    ahead, later, pending = [], [], set(front)
    away = params.neutral * np.hypot(x - target % size_x, y - target // size_x)
    away = (away if params.heuristic else 0.0 * away).astype(np.float32)
    threshold = np.float32(params.obstacle + away[source])
    for _ in range(max_fronts):
        pending.difference_update(front)
        for cell in front:
            cost = params.price[costs[cell]]
            here = arrival_at(potential, size_x, cell, cost, params.planar)
            if here >= potential[cell]:
                continue
            potential[cell] = here
            priority = np.float32(here + away[cell])
            for near in (cell - 1, cell + 1, cell - size_x, cell + size_x):
                reached_for = np.float32(priority + params.crossing[costs[near]])
                if not closed[near] and near not in pending and potential[near] > reached_for:
                    pending.add(near)
                    (ahead if priority < threshold else later).append(near)
        front, ahead = ahead, []
        if not front:
            threshold, front, later = np.float32(threshold + 2 * params.neutral), later, []
        if not front or potential[target] < NOT_REACHED:
            break
    return potential


@pytest.mark.parametrize("planar, heuristic", [(True, False), (False, False), (True, True)])
def test_wave_is_that_of_the_plain_one(planar, heuristic):
    rng = np.random.default_rng(4)
    own = np.arange(256, dtype=np.uint8)
    params = WaveParams(
        own.astype(np.float32), crossings(own, LETHAL), LETHAL, 50, planar, True, heuristic
    )
    arrived = 0
    for _ in range(30):
        size_y, size_x = rng.integers(5, 50), int(rng.integers(5, 50))
        costs = rng.choice(np.array([50, 60, 200, 254], dtype=np.uint8), (size_y, size_x))
        costs = costs.ravel() if rng.random() < 0.5 else np.minimum(costs, 200).ravel()
        source, target = (int(rng.integers(1, size_y - 1)) * size_x + size_x // 2 for _ in "12")
        potential = np.full(costs.size, NOT_REACHED, dtype=np.float32)
        front = start_at_cell(potential, source, size_x)
        states = np.full(costs.size, LETHAL, dtype=np.uint8)
        max_fronts = int(rng.choice([20, 2 * costs.size]))
        arguments = (params, source, target, size_x, max_fronts)

        arrived += propagate(costs, potential, states, front, *arguments)[0]

        expected = plain_wave(costs, *arguments)
        assert potential.tolist() == expected.tolist()
    assert 5 < arrived < 30


def test_second_plan_is_that_of_a_new_planner():
    rng = np.random.default_rng(3)
    planner, reached = Navfn(), 0
    for _ in range(40):
        costs = rng.choice(np.array([0, 90, LETHAL], dtype=np.uint8), (30, 40), p=[0.6, 0.2, 0.2])
        poses = [Pose2D(*rng.uniform(1.0, (39.0, 29.0)), 0.7) for _ in range(2)]
        found = []
        for each in (planner, Navfn()):
            try:
                found.append(each.make_plan(spec_of(costs), costs, *poses).tolist())
                reached += 1
            except NoPath as error:
                found.append(str(error))
            found.append(each.potential.tolist())
        assert found[:2] == found[2:]
    assert 20 < reached < 80


def test_potential_of_a_goal_in_an_obstacle_is_that_of_the_whole_wave():
    costs = costs_of(CORRIDOR)
    planner = Navfn()
    with pytest.raises(NoPath, match=r"to \(3.50, 0.50\)"):
        planner.make_plan(spec_of(costs), costs, Pose2D(1.5, 1.5), Pose2D(3.5, 0.5))
    costs[:] = LETHAL  # the potential is that of the time of the plan

    assert planner.potential[1].tolist() == [1e10, 0, 50, 100, 150, 200, 1e10]


def test_beside_unreached_cells_a_neighbour_is_lower_if_it_is_below_the_whole_number():
    potential = np.full((5, 6), NOT_REACHED, dtype=np.float32)
    potential[2, 2], potential[1, 1] = 100.9, 100.2  # not below 100
    potential[1, 3], potential[3, 1] = 99.5, 99.1  # below 100, and not below 99
    potential[1, 4] = 10.0
    path, arrived = path_from(potential, (2, 2), (4, 1))
    assert path.tolist() == [[2.0, 2.0], [3.0, 1.0], [4.0, 1.0]] and arrived
