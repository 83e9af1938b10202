"""Discs on a grid, holding points and the peer layer."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from quad_nav.costmap.cost_grid import NOWHERE, CostGrid
from quad_nav.costmap.cost_grid_kernel import CostmapView, nearest_cell, raise_discs
from quad_nav.costmap.peer_layer import PeerArea, PeerLayer
from quad_nav.geometry import Pose2D
from quad_nav.grid import FREE, LETHAL, GridSpec
from quad_nav.peers.holding_point import find_holding_point, is_reachable

MIN_SEPARATION_M = 0.9


SPEC = GridSpec(40, 40, 0.1)


def costmap(costs):
    return SimpleNamespace(spec=SPEC, costs=costs)


def test_many_discs_raise_the_cells_of_each():
    random = np.random.default_rng(4)
    cells, expected = np.full((2, 60, 50), 3, dtype=np.uint8)
    along = np.linspace(5.0, 60.0, 40)  # overlapping discs that leave the grid, then others
    centres = np.vstack(
        (np.column_stack((along, 0.5 * along)), random.uniform(-5.0, 65.0, (20, 2)))
    )
    raise_discs(CostmapView(cells, 0.0, 0.0, 1.0), centres, 6.3, 7)
    for centre in centres:
        y, x = np.mgrid[0:60, 0:50] + 0.5
        expected[(x - centre[0]) ** 2 + (y - centre[1]) ** 2 <= 6.3**2] = 7
    assert 1000 < (expected == 3).sum() < 2000
    np.testing.assert_array_equal(cells, expected)


def test_the_nearest_cell_is_found_round_a_wall():
    blocked = np.zeros((5, 5), dtype=np.uint8)
    blocked[0:4, 2] = 1
    unwanted = np.zeros((5, 5), dtype=np.uint8)
    unwanted[:, :3] = 1
    assert tuple(nearest_cell(blocked, unwanted, 0, 0)) == (3, 4)
    blocked[4, 2] = 1
    assert tuple(nearest_cell(blocked, unwanted, 0, 0)) == (-1, -1)


def test_a_holding_point_is_beside_the_path():
    costs = np.zeros(SPEC.shape, dtype=np.uint8)
    path = np.array([[0.5, 2.0], [3.5, 2.0]])
    holding_point = find_holding_point(
        costmap(costs), Pose2D(2.5, 2.2), [path], np.array([[0.5, 2.0]]), MIN_SEPARATION_M
    )
    assert holding_point is not None
    assert holding_point.x_m == pytest.approx(2.5, abs=0.11)
    assert holding_point.y_m == pytest.approx(2.0 + MIN_SEPARATION_M, abs=0.11)


def test_in_a_corridor_the_holding_point_is_beyond_its_end():
    costs = np.full(SPEC.shape, LETHAL, dtype=np.uint8)
    costs[19:22, :] = FREE  # the corridor along x ...
    costs[:, 34:38] = FREE  # ... opens into a cross-path
    path = np.array([[0.5, 2.05], [3.8, 2.05]])
    holding_point = find_holding_point(
        costmap(costs), Pose2D(2.0, 2.05), [path], np.array([[0.5, 2.05]]), MIN_SEPARATION_M
    )
    assert (
        holding_point is not None
        and holding_point.x_m > 3.3
        and abs(holding_point.y_m - 2.05) > MIN_SEPARATION_M - 0.1
    )


@pytest.mark.parametrize(
    "gap, other, reached",
    [(True, (0.5, 0.5), True), (False, (0.5, 0.5), False), (True, (2.05, 3.0), False)],
)
def test_reachability_of_a_holding_point(gap, other, reached):
    """Through the only gap of a wall, unless a peer is in it."""
    costs = np.zeros(SPEC.shape, dtype=np.uint8)
    costs[:, 20] = LETHAL
    if gap:
        costs[25:35, 20] = FREE
    assert (
        is_reachable(
            costmap(costs), Pose2D(1.0, 1.0), Pose2D(3.0, 1.0), np.array([other]), MIN_SEPARATION_M
        )
        is reached
    )


def test_the_layer_forgets_where_a_peer_was():
    layer, master = PeerLayer(), CostGrid(SPEC)
    for points in ([[1.05, 1.05]], [[3.05, 3.05]]):
        layer.set_areas([PeerArea(np.array(points), 0.2, 120)])
        bounds = layer.update_bounds(Pose2D(2.0, 2.0), 0.0, NOWHERE)
        window = master.window_of(bounds)
        master.reset(window)
        layer.update_costs(master, window)
    assert master.costs[30, 30] == 120
    assert master.costs[10, 10] == FREE
