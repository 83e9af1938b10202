"""What an empty parameter tree means, against the original."""
from __future__ import annotations

import json
from pathlib import Path

from quad_nav.costmap.inflation import InflationLayer
from quad_nav.costmap.layered import CostmapParams, LayeredCostmap
from quad_nav.costmap.obstacle import ObstacleLayer

DEFAULTS = json.loads((Path(__file__).parent / "data" / "defaults.json").read_text())
RECORDED = DEFAULTS["costmap_defaults"]


def test_costmap():
    costmap, info = LayeredCostmap(CostmapParams()), RECORDED["info"]
    spec = costmap.spec
    assert [spec.size_x, spec.size_y, spec.resolution_m, spec.origin_x_m, spec.origin_y_m] == [
        info[name] for name in ("size_x", "size_y", "resolution", "origin_x", "origin_y")]
    assert costmap.inscribed_radius_m == info["inscribed"]
    assert costmap.circumscribed_radius_m == info["circumscribed"]
    assert costmap.params.rolling_window == info["rolling"]
    assert list(costmap.layers) == info["layers"]
    assert (costmap.costs == info["default_value"]).all()
    assert costmap.is_current(0.0) == info["current"]


def test_parameters():
    params, recorded = CostmapParams(), RECORDED["dynamic_parameters"]
    assert (params.transform_tolerance_s, params.publish_frequency_hz) == (
        recorded["transform_tolerance"], recorded["publish_frequency"])
    assert (params.width_m, params.height_m) == (recorded["width"], recorded["height"])
    assert (params.robot_radius_m, params.footprint_padding_m) == (
        recorded["robot_radius"], recorded["footprint_padding"])
    assert (params.footprint, recorded["footprint"]) == (None, "[]")


def test_layers():
    obstacles, inflation = LayeredCostmap(CostmapParams()).layers.values()
    recorded = RECORDED["layers"]
    assert isinstance(obstacles, ObstacleLayer)
    assert obstacles.grid.default_cost == recorded["default_value"]
    assert obstacles.params.footprint_clearing_enabled == recorded["footprint_clearing_enabled"]
    assert obstacles.params.max_obstacle_height_m == recorded["max_obstacle_height"]
    assert obstacles.params.combination_method == recorded["combination_method"]
    assert obstacles.params.enabled == recorded["enabled"]
    assert list(obstacles.params.sources) == recorded["sources"]
    assert isinstance(inflation, InflationLayer)
    recorded = recorded["inflation"]
    assert inflation.params.inflation_radius_m == recorded["inflation_radius"]
    assert inflation.params.cost_scaling_factor == recorded["cost_scaling_factor"]
    assert inflation.params.inflate_unknown == recorded["inflate_unknown"]
    assert inflation.params.enabled == recorded["enabled"]
    assert inflation.radius_cells == recorded["cell_inflation_radius"]
