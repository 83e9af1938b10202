"""Upstream bugs of the static and the voxel layer: fixed by default, restored by a switch."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from costmap_maps import drawn, picture
from upstream import UPSTREAM

from quad_nav.config import load, updated
from quad_nav.costmap.cost_grid import NOWHERE, Bounds, CostGrid
from quad_nav.costmap.layered import CostmapParams, LayeredCostmap
from quad_nav.costmap.observation import SourceParams
from quad_nav.costmap.obstacle import ObstacleLayerParams
from quad_nav.costmap.static import StaticLayer, StaticLayerParams, StaticMap
from quad_nav.costmap.voxel import VoxelLayerParams
from quad_nav.geometry import Pose2D, Pose3D, quaternion_from_yaw
from quad_nav.grid import UNKNOWN, GridSpec
from quad_nav.scenario.assembly import apply_configuration, build_navigator

ROBOT = Pose2D(0.5, 2.5)
FREE_MAP = StaticMap(np.zeros((3, 4), np.int8), GridSpec(4, 3, 1.0))
WALL = np.full((1, 2), 100, np.int8)
STATIC_SWITCHES = ("draw_all_map_updates", "restore_static_map", "transform_map_bounds")
VOXEL_SWITCHES = ("clip_voxel_rays", "redraw_emptied_voxels", "notice_silence_at_once")


def static_layer(rolling_window=False, static_map=FREE_MAP, **params):
    layer = StaticLayer(StaticLayerParams(**params), static_map.spec, rolling_window, 0)
    layer.set_map(static_map)
    layer.update_bounds(ROBOT, 0.0, NOWHERE)
    return layer


@pytest.mark.parametrize(
    "switch, bounds",
    [(True, Bounds(0.5, 0.5, 4.5, 3.5)), (False, Bounds(2.5, 2.5, 4.5, 3.5))],
)
def test_several_map_updates_before_one_update_of_the_costmap(switch, bounds):
    layer = static_layer(draw_all_map_updates=switch)
    layer.update_map(WALL, 0, 0)
    layer.update_map(WALL, 2, 2)
    assert picture(layer.grid.costs) == drawn("..##\n....\n##..")
    assert layer.update_bounds(ROBOT, 1.0, NOWHERE) == bounds
    assert layer.update_bounds(ROBOT, 2.0, NOWHERE) == NOWHERE


@pytest.mark.parametrize(
    "switch, bounds",
    [(True, Bounds(0.5, 0.5, 4.5, 3.5)), (False, Bounds(1.5, 1.5, 3.5, 2.5))],
)
def test_a_rolling_window_draws_the_whole_map_after_a_map_update(switch, bounds):
    layer = static_layer(rolling_window=True, draw_all_map_updates=switch)
    layer.update_map(WALL, 1, 1)
    for now_s in (1.0, 2.0):
        assert layer.update_bounds(ROBOT, now_s, NOWHERE) == bounds
    layer.set_map(FREE_MAP)
    assert layer.update_bounds(ROBOT, 3.0, NOWHERE) == Bounds(0.5, 0.5, 4.5, 3.5)


@pytest.mark.parametrize("switch, costs", [(True, "....\n...#\n...."), (False, "#...\n...#\n....")])
def test_a_map_update_beyond_the_right_border(switch, costs):
    layer = static_layer(draw_all_map_updates=switch)
    layer.update_map(WALL, 3, 1)
    layer.update_map(WALL, 0, 3)  # above the map: no place in memory
    layer.update_map(WALL, -2, 0)
    assert picture(layer.grid.costs) == drawn(costs)


@pytest.mark.parametrize("switch", [True, False])
def test_a_turned_map_is_drawn_where_it_is(switch):
    """The map stands on its right border: x of the costmap's frame is its y."""
    wall = StaticMap(np.full((2, 6), 100, np.int8), GridSpec(6, 2, 1.0))
    layer = static_layer(True, wall, transform_map_bounds=switch)
    layer.map_from_global = Pose3D(6.0, 0.0, 0.0, quaternion_from_yaw(math.pi / 2))
    master = CostGrid(GridSpec(6, 6, 1.0))
    window = master.window_of(layer.update_bounds(ROBOT, 1.0, NOWHERE))
    layer.update_costs(master, window)
    rows = ["##....", "##....", "##....", "##....", "##....", "##...."]
    if not switch:  # the map's own place has rows 0 to 2
        rows[:3] = ["......"] * 3
    assert picture(master.costs) == "\n".join(rows)


# -- voxels ------------------------------------------------------------------------------------


def voxel_layer(origin_x_m=0.0, sources=("cloud",), period_s=0.0, **params):
    seen = [
        SourceParams(
            name=name,
            marking=name == "cloud",
            clearing=True,
            obstacle_range_m=20.0,
            raytrace_range_m=20.0,
            min_obstacle_height_m=-9.0,
            max_obstacle_height_m=9.0,
            expected_update_period_s=period_s if name == "cloud" else 0.0,
        )
        for name in sources
    ]
    return VoxelLayerParams(
        sources=tuple(seen),
        z_voxels=3,
        z_resolution_m=1.0,
        max_obstacle_height_m=9.0,
        track_unknown_space=True,
        footprint_clearing_enabled=False,
        **params,
    ).make_layer(GridSpec(6, 5, 1.0, origin_x_m, 0.0), rolling_window=False, default_cost=0)


def see(layer, eye, point, at_s=0.0, source="cloud"):
    """An update with one point; eye and point are (x, z) in the row with y from 2 to 3 m."""
    cloud = np.array([(point[0], 2.5, point[1])], np.float32)
    origin = Pose3D(eye[0], 2.5, eye[1])
    layer.add_cloud(source, cloud, Pose3D(0.0, 0.0, 0.0), at_s, at_s, origin)
    return layer.update_bounds(ROBOT, at_s, NOWHERE)


def row(layer):
    return picture(layer.grid.costs[2:3])


@pytest.mark.parametrize("clip, costs, low", [(True, ".?????", 0.1), (False, "??????", 1e30)])
def test_a_ray_that_ends_outside_by_rounding(clip, costs, low):
    """The ray is cut at 0.1 m, and 0.5 m - 0.4 m is less than that by 3e-17 m."""
    layer = voxel_layer(origin_x_m=0.1, clip_voxel_rays=clip)
    found = see(layer, (0.5, 0.5), (-4.0, 0.5))
    assert row(layer) == costs
    assert found.min_x_m == pytest.approx(low)


@pytest.mark.parametrize("clip, costs", [(True, "...??#"), (False, "?????#")])
def test_a_ray_that_ends_above_the_voxels(clip, costs):
    layer = voxel_layer(clip_voxel_rays=clip)
    see(layer, (0.5, 0.5), (5.5, 0.5))
    layer.grid.costs[2, :5] = UNKNOWN
    # Two cells short it ends at x = 4.3 m, z = 4.3 m; it leaves the voxels at x = 3 m.
    see(layer, (0.5, 0.5), (5.7, 5.7), at_s=1.0)
    assert row(layer) == costs


@pytest.mark.parametrize("clip, x_m", [(True, 5.75), (False, 5.5)])
def test_a_ray_from_the_last_half_cell(clip, x_m):
    """The upper border of rays is at 5.5 m, behind a sensor at 5.75 m that looks ahead.

    Upstream goes backwards to it.
    """
    layer = voxel_layer(clip_voxel_rays=clip)
    found = see(layer, (5.75, 0.5), (9.75, 0.5))
    assert row(layer) == "?????."
    assert (found.min_x_m, found.max_x_m) == (x_m, x_m)


@pytest.mark.parametrize("at_once", [True, False])
@pytest.mark.parametrize("kind", [ObstacleLayerParams, VoxelLayerParams])
def test_a_silent_sensor_is_noticed(kind, at_once):
    source = SourceParams(name="cloud", expected_update_period_s=1.0)
    params = kind(sources=(source,), notice_silence_at_once=at_once)
    layer = params.make_layer(FREE_MAP.spec, False, 0)
    layer.update_bounds(ROBOT, 0.0, NOWHERE)
    assert layer.is_current(1.0)
    assert layer.is_current(1.1) is not at_once
    layer.update_bounds(ROBOT, 1.2, NOWHERE)
    assert not layer.is_current(1.2)
    cloud = np.array([(1.5, 1.5, 0.5)], np.float32)
    layer.add_cloud("cloud", cloud, Pose3D(0.0, 0.0, 0.0), 1.3, 1.3)
    assert layer.is_current(1.3) is at_once
    layer.update_bounds(ROBOT, 1.4, NOWHERE)
    assert layer.is_current(1.4)


def test_a_layer_that_was_disabled_follows_a_rolling_window():
    """A window moves by whole cells, cut towards zero: 1.05 m are one cell, 0.85 m back none."""
    layers = (("voxels", replace(voxel_layer().params, enabled=False)),)
    params = CostmapParams(
        width_m=6.0, height_m=5.0, resolution_m=1.0, rolling_window=True, layers=layers
    )
    costmap = LayeredCostmap(params)
    for x_m in (2.75, 3.8, 2.95):
        costmap.update(0.0, Pose2D(x_m, 2.25))
    costmap.reconfigure_layer("voxels", replace(layers[0][1], enabled=True))
    costmap.update(1.0, Pose2D(2.95, 2.25))
    assert costmap.spec.origin_x_m == 1.0
    assert costmap.layers["voxels"].grid.spec == costmap.spec


@pytest.mark.parametrize("redraw", [True, False])
def test_a_reconfiguration_empties_the_layer(redraw):
    layer = voxel_layer(redraw_emptied_voxels=redraw)
    see(layer, (0.5, 0.5), (5.5, 0.5))
    layer.buffers["cloud"].observations.clear()
    layer.reconfigure(layer.params)
    assert row(layer) == ("....?#" if redraw else "??????")
    layer.reconfigure(replace(layer.params, mark_threshold=1))
    assert row(layer) == "??????" and (layer.voxels == UNKNOWN).all()
    assert layer.is_current(0.0) is not redraw
    expected = Bounds(0.0, 0.0, 6.0, 5.0) if redraw else NOWHERE
    assert layer.update_bounds(ROBOT, 1.0, NOWHERE) == expected
    assert layer.is_current(1.0)


# -- parameters --------------------------------------------------------------------------------

TREE = {
    "local_costmap": {
        "plugins": [
            {"name": "static", "type": "costmap_2d::StaticLayer"},
            {"name": "voxels", "type": "costmap_2d::VoxelLayer"},
        ]
    }
}


def switches_of(navigator):
    layers = navigator.local_costmap.layers
    static, voxels = layers["static"].params, layers["voxels"].params
    return {getattr(static, name) for name in STATIC_SWITCHES} | {
        getattr(voxels, name) for name in VOXEL_SWITCHES
    }


def test_switches_reach_the_layers_also_in_flight():
    assert switches_of(build_navigator(load({**TREE, **UPSTREAM}))) == {False}
    configuration = load(TREE)
    navigator = build_navigator(configuration)
    assert switches_of(navigator) == {True}
    configuration = updated(configuration, "fixes", {"upstream": True})
    apply_configuration(navigator, configuration)
    assert switches_of(navigator) == {False}
    apply_configuration(navigator, updated(configuration, "local_costmap", {"width": 5}))
    assert switches_of(navigator) == {False}
