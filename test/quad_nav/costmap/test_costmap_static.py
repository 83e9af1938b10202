from __future__ import annotations

import numpy as np
import pytest
from costmap_maps import picture

from quad_nav.costmap.cost_grid import NOWHERE
from quad_nav.costmap.static import StaticLayer, StaticLayerParams, StaticMap
from quad_nav.geometry import Pose2D
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
