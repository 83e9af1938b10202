from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from costmap_maps import drawn, picture

from quad_nav.costmap.cost_grid import Bounds, Window
from quad_nav.costmap.inflation import InflationLayerParams
from quad_nav.costmap.layer import Layer, LayerParams
from quad_nav.costmap.layered import CostmapParams, LayeredCostmap
from quad_nav.costmap.observation import SourceParams
from quad_nav.costmap.obstacle import ObstacleLayerParams
from quad_nav.costmap.static import StaticLayerParams, StaticMap
from quad_nav.geometry import Pose2D, Pose3D, Scan
from quad_nav.grid import GridSpec

LASER = SourceParams(
    name="laser",
    clearing=True,
    obstacle_range_m=10.0,
    raytrace_range_m=10.0,
    expected_update_period_s=1.0,
)
OBSTACLES = ("obstacle_layer", ObstacleLayerParams(sources=(LASER,)))
INFLATION = ("inflation_layer", InflationLayerParams(inflation_radius_m=1.0))
SMALL = CostmapParams(
    width_m=6.0, height_m=3.0, resolution_m=1.0, robot_radius_m=0.1, layers=(OBSTACLES, INFLATION)
)
ROBOT = Pose2D(0.5, 1.5)


def see(costmap, range_m, at_s=0.0, x_m=0.5):
    scan = Scan(at_s, 0.0, 1.0, 0.1, 20.0, np.array([range_m], dtype=np.float32))
    costmap.layers["obstacle_layer"].add_scan("laser", scan, Pose3D(x_m, 1.5, 0.3), at_s)


def test_obstacles_are_marked_then_inflated():
    costmap = LayeredCostmap(replace(SMALL, robot_radius_m=1.1))
    see(costmap, 4.0)
    assert costmap.update(0.0, ROBOT) == Window(0, 6, 0, 3)
    assert picture(costmap.costs) == drawn("""....i.
                                             ...i#i
                                             ....i.""")


def test_second_update_is_no_wider_than_what_changed():
    costmap = LayeredCostmap(replace(SMALL, width_m=20.0))
    see(costmap, 2.0)
    assert costmap.update(0.0, ROBOT) == Window(0, 20, 0, 3)
    # Touched: x from 0.4 (footprint) to 2.5 (hit), and 1 m of inflation radius around.
    assert costmap.update(0.5, ROBOT) == Window(0, 4, 0, 3)


def test_costmap_takes_size_and_place_of_the_map_and_keeps_them():
    occupancy = np.array([[0, 100], [0, 0], [-1, 0]], dtype=np.int8)
    static_map = StaticMap(occupancy, GridSpec(2, 3, 0.5, 7.0, 8.0))
    params = replace(SMALL, layers=(("static_layer", StaticLayerParams()), INFLATION))
    costmap = LayeredCostmap(params)
    assert not costmap.is_current(0.0)
    costmap.set_map(static_map)
    assert costmap.spec == static_map.spec
    assert costmap.is_current(0.0)
    costmap.update(0.0, Pose2D(7.5, 8.5))
    assert picture(costmap.costs[2:]) == "?."
    assert costmap.costs[0, 1] == 254
    costmap.reconfigure(replace(params, width_m=50.0))
    assert costmap.spec == static_map.spec


def test_reconfigure_size_and_radius():
    costmap = LayeredCostmap(SMALL)
    costmap.reconfigure(replace(SMALL, width_m=4.0, resolution_m=0.5, robot_radius_m=1.0))
    assert costmap.spec == GridSpec(8, 6, 0.5)
    assert costmap.layers["obstacle_layer"].grid.costs.shape == (6, 8)
    assert costmap.layers["inflation_layer"].radius_cells == 2
    assert costmap.layers["inflation_layer"].cost_table[0, 1] == 253
    assert costmap.circumscribed_radius_m == pytest.approx(1.0141421, abs=1e-7)


def test_reconfigure_padding_keeps_a_footprint_that_was_set():
    costmap = LayeredCostmap(replace(SMALL, footprint_padding_m=0.0))
    costmap.set_footprint([(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)])
    assert costmap.inscribed_radius_m == 1.0
    costmap.reconfigure(replace(SMALL, footprint_padding_m=0.5))
    assert costmap.inscribed_radius_m == 1.5
    np.testing.assert_array_equal(costmap.layers["obstacle_layer"]._footprint, costmap.footprint)


@dataclass(frozen=True)
class CornerParams(LayerParams):
    cost: int = 100

    def make_layer(self, spec, rolling_window, default_cost):
        return CornerLayer(self)


class CornerLayer(Layer):
    """Gives the two lower left cells a cost."""

    def update_bounds(self, robot, now_s, bounds):
        return bounds.union(Bounds(0.0, 0.0, 1.5, 0.5))

    def update_costs(self, master, window):
        master.costs[window.slices] = self.params.cost


def test_a_layer_of_ones_own():
    costmap = LayeredCostmap(replace(SMALL, layers=(("corner", CornerParams(cost=77)),)))
    assert costmap.update(0.0, ROBOT) == Window(0, 2, 0, 1)
    assert costmap.costs[0].tolist() == [77, 77, 0, 0, 0, 0]
    assert not costmap.costs[1:].any()
