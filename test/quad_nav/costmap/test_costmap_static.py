from __future__ import annotations

import math

import numpy as np
import pytest
from costmap_maps import costs_of, drawn, picture

from quad_nav.costmap.cost_grid import NOWHERE, Bounds, CostGrid, Window
from quad_nav.costmap.static import StaticLayer, StaticLayerParams, StaticMap
from quad_nav.geometry import Pose2D, Pose3D, quaternion_from_yaw
from quad_nav.grid import UNKNOWN, GridSpec

ROBOT = Pose2D(0.0, 0.0)
OCCUPANCY = {".": 0, "#": 100, "?": -1}


def occupancy_of(text):
    return np.array(
        [[OCCUPANCY[sign] for sign in row] for row in text.split()[::-1]], dtype=np.int8
    )


def map_of(text, origin=(0.0, 0.0)):
    occupancy = occupancy_of(text)
    return StaticMap(occupancy, GridSpec(occupancy.shape[1], occupancy.shape[0], 1.0, *origin))


def layer_of(static_map, rolling_window=False, **params):
    layer = StaticLayer(StaticLayerParams(**params), static_map.spec, rolling_window, 0)
    layer.set_map(static_map)
    return layer


@pytest.mark.parametrize(
    "params, expected",
    [
        ({}, [255, 0, 0, 0, 254]),
        ({"track_unknown_space": False}, [0, 0, 0, 0, 254]),
        ({"lethal_cost_threshold": 65}, [255, 0, 0, 254, 254]),
        ({"trinary_costmap": False}, [255, 0, 127, 165, 254]),
        ({"trinary_costmap": False, "lethal_cost_threshold": 80}, [255, 0, 158, 206, 254]),
        ({"unknown_cost_value": 50}, [254, 0, 255, 0, 254]),
    ],
)
def test_costs_of_occupancies(params, expected):
    layer = layer_of(map_of("."), **params)
    assert layer.costs_of(np.array([-1, 0, 50, 65, 100], dtype=np.int8)).tolist() == expected


def test_map_is_copied_into_the_window():
    layer = layer_of(map_of("##?\n.#."))
    master = CostGrid(GridSpec(3, 2, 1.0))
    master.costs[...] = costs_of("...\n###")
    layer.update_costs(master, Window(0, 2, 0, 2))
    assert picture(master.costs) == drawn("##.\n.##")


def test_use_maximum_keeps_higher_costs():
    layer = layer_of(map_of("##?\n.#."), use_maximum=True)
    master = CostGrid(GridSpec(3, 2, 1.0))
    master.costs[...] = costs_of("..#\n###")
    layer.update_costs(master, Window(0, 3, 0, 2))
    assert picture(master.costs) == drawn("###\n###")


def test_bounds_are_asked_for_once():
    layer = layer_of(map_of("...\n...", origin=(10.0, 20.0)))
    # From the centre of the first cell to half a cell beyond the map, as upstream.
    assert layer.update_bounds(ROBOT, 0.0, NOWHERE) == Bounds(10.5, 20.5, 13.5, 22.5)
    assert layer.update_bounds(ROBOT, 1.0, NOWHERE) == NOWHERE


def test_updates_replace_a_rectangle_and_only_that_is_asked_for():
    layer = layer_of(map_of("....\n....\n...."))
    layer.update_bounds(ROBOT, 0.0, NOWHERE)
    layer.update_map(occupancy_of("#?\n##"), 1, 0)
    assert picture(layer.grid.costs) == drawn("....\n.#?.\n.##.")
    assert layer.update_bounds(ROBOT, 1.0, NOWHERE) == Bounds(1.5, 0.5, 3.5, 2.5)
    layer.update_map(occupancy_of("##\n##"), 3, 2)
    assert picture(layer.grid.costs) == drawn("...#\n.#?.\n.##.")


@pytest.mark.parametrize(
    "restore, costs, bounds", [(True, "###.", (0.5, 4.5)), (False, "??#?", (2.5, 3.5))]
)
def test_reset_restores_the_map_with_its_updates(restore, costs, bounds):
    given = map_of("##..")
    layer = layer_of(given, restore_static_map=restore)
    layer.update_map(occupancy_of("#"), 2, 0)
    assert picture(layer.grid.costs) == "###."
    layer.update_bounds(ROBOT, 0.0, NOWHERE)
    layer.grid.costs[0, [0, 1, 3]] = UNKNOWN  # as a recovery clears it
    layer.reset(1.0)
    assert picture(layer.grid.costs) == costs
    found = layer.update_bounds(ROBOT, 1.0, NOWHERE)
    assert (found.min_x_m, found.max_x_m) == bounds
    assert given.occupancy.tolist() == [[100, 100, 0, 0]]  # other robots have it too


def test_first_map_only():
    layer = layer_of(map_of("#..."), first_map_only=True)
    layer.set_map(map_of("...#"))
    assert picture(layer.grid.costs) == "#..."


def test_without_a_map_it_is_not_current_and_writes_nothing():
    layer = StaticLayer(StaticLayerParams(), GridSpec(2, 1, 1.0), False, 0)
    assert not layer.is_current(0.0)
    assert layer.update_bounds(ROBOT, 0.0, NOWHERE) == NOWHERE
    master = CostGrid(GridSpec(2, 1, 1.0))
    master.costs[...] = 254
    layer.update_costs(master, Window(0, 2, 0, 1))
    assert picture(master.costs) == "##"


def test_rolling_window_looks_cells_up_by_position():
    layer = layer_of(map_of("#..\n.#.\n..#"), rolling_window=True)
    master = CostGrid(GridSpec(3, 3, 1.0, 1.0, 1.0))
    layer.update_costs(master, Window(0, 3, 0, 3))
    assert picture(master.costs) == drawn("...\n...\n#..")


def test_rolling_window_in_a_turned_frame():
    layer = layer_of(map_of("#..\n...\n..."), rolling_window=True)
    layer.map_from_global = Pose3D(
        3.0, 0.0, 0.0, quaternion_from_yaw(math.pi / 2)
    )  # global x is the map's y
    master = CostGrid(GridSpec(3, 3, 1.0))
    layer.update_costs(master, Window(0, 3, 0, 3))
    assert picture(master.costs) == drawn("..#\n...\n...")
    bounds = layer.update_bounds(ROBOT, 0.0, NOWHERE)
    assert (bounds.min_x_m, bounds.max_x_m) == pytest.approx((0.5, 3.5))
    assert (bounds.min_y_m, bounds.max_y_m) == pytest.approx((-0.5, 2.5))
