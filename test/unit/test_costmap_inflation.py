"""Costs by hand: 1 m cells, inscribed radius 1 m, and a factor of ln 2, half per metre."""

from __future__ import annotations

import math

import numpy as np
from costmap_maps import costs_of, drawn, picture

from quad_nav.costmap.cost_grid import EVERYWHERE, Bounds, CostGrid, Window
from quad_nav.costmap.inflation import InflationLayer, InflationLayerParams
from quad_nav.geometry import Pose2D
from quad_nav.grid import GridSpec

ROBOT = Pose2D(0.0, 0.0)
HALF_PER_METRE = InflationLayerParams(inflation_radius_m=3.0, cost_scaling_factor=math.log(2.0))


def inflated(text, params=HALF_PER_METRE, inscribed_m=1.0, window=None):
    costs = costs_of(text)
    height, width = costs.shape
    master = CostGrid(GridSpec(width, height, 1.0))
    master.costs[...] = costs
    layer = InflationLayer(params, 1.0, inscribed_m)
    layer.update_costs(master, window or Window(0, width, 0, height))
    return master.costs


def test_costs_around_a_single_obstacle():
    costs = inflated("""....
                        ....
                        ....
                        #...""")
    # 252 / 2^(d - 1) at d = 1.414, 2, 2.236, 2.828, 3; cut, not rounded. (3, 1) is too far.
    assert costs[0].tolist() == [254, 253, 126, 63]
    assert costs[1].tolist() == [253, 189, 106, 0]
    assert costs[2].tolist() == [126, 106, 70, 0]
    assert costs[3].tolist() == [63, 0, 0, 0]


def test_the_nearer_of_two_obstacles_counts():
    assert inflated("#.....#")[0].tolist() == [254, 253, 126, 63, 126, 253, 254]


def test_higher_costs_stay():
    costs = costs_of("#....")
    costs[0, 2] = 200
    master = CostGrid(GridSpec(5, 1, 1.0))
    master.costs[...] = costs
    InflationLayer(HALF_PER_METRE, 1.0, 1.0).update_costs(master, Window(0, 5, 0, 1))
    assert master.costs[0].tolist() == [254, 253, 200, 63, 0]


def test_unknown_cells_take_inscribed_costs_only():
    assert picture(inflated("#????")) == drawn("#i???")


def test_unknown_cells_take_all_costs_when_asked():
    params = InflationLayerParams(
        inflation_radius_m=3.0, cost_scaling_factor=math.log(2.0), inflate_unknown=True
    )
    assert inflated("#????", params)[0].tolist() == [254, 253, 126, 63, 255]


def test_obstacles_reach_into_a_window_from_one_radius_around_it():
    # The window is column 4 only. The obstacle in column 1 is 3 cells away and counts,
    # and also changes cells outside the window; the one in column 9 is too far.
    costs = inflated(".#.......#", window=Window(4, 5, 0, 1))
    assert costs[0].tolist() == [253, 254, 253, 126, 63, 0, 0, 0, 0, 254]


def test_no_radius_no_change():
    params = InflationLayerParams(inflation_radius_m=0.0)
    assert picture(inflated("..#..", params)) == drawn("..#..")


def test_a_radius_below_one_cell_is_one_cell():
    params = InflationLayerParams(inflation_radius_m=0.1)
    assert picture(inflated("..#..", params)) == drawn(".i#i.")


def test_first_update_is_everywhere_and_later_ones_hold_the_last():
    layer = InflationLayer(HALF_PER_METRE, 1.0, 1.0)
    assert layer.update_bounds(ROBOT, 0.0, Bounds(1.0, 1.0, 2.0, 2.0)) == EVERYWHERE
    assert layer.update_bounds(ROBOT, 1.0, Bounds(4.0, 4.0, 5.0, 6.0)) == Bounds(
        -2.0, -2.0, 8.0, 9.0
    )
    assert layer.update_bounds(ROBOT, 2.0, Bounds(4.0, 4.0, 5.0, 5.0)) == Bounds(1.0, 1.0, 8.0, 9.0)


def test_new_parameters_or_footprint_redo_everything():
    layer = InflationLayer(HALF_PER_METRE, 1.0, 1.0)
    small = Bounds(1.0, 1.0, 2.0, 2.0)
    layer.update_bounds(ROBOT, 0.0, small)
    layer.reconfigure(HALF_PER_METRE)
    assert layer.update_bounds(ROBOT, 1.0, small) != EVERYWHERE
    layer.reconfigure(InflationLayerParams(inflation_radius_m=2.0))
    assert layer.update_bounds(ROBOT, 2.0, small) == EVERYWHERE
    layer.set_footprint(np.zeros((0, 2)), 2.0)
    assert layer.cost_table[0, 2] == 253
    assert layer.update_bounds(ROBOT, 3.0, small) == EVERYWHERE
