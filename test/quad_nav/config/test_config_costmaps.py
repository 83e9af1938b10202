"""Costmaps in both styles: with a plugins list, and as before ROS Hydro."""

from __future__ import annotations

import numpy as np
import pytest

from quad_nav.config import load
from quad_nav.costmap.inflation import InflationLayerParams
from quad_nav.costmap.observation import SourceParams
from quad_nav.costmap.obstacle import ObstacleLayerParams
from quad_nav.costmap.static import StaticLayerParams
from quad_nav.costmap.voxel import VoxelLayerParams
from quad_nav.errors import InputError

OBSTACLE = {"name": "obstacles", "type": "costmap_2d::ObstacleLayer"}
INFLATION = {"name": "inflater", "type": "costmap_2d::InflationLayer"}
STATIC = {"name": "map", "type": "costmap_2d::StaticLayer"}


def local_costmap(tree, **above):
    return load({"local_costmap": tree, **above}, "").local_costmap


def layers(tree):
    return dict(local_costmap(tree).layers)


def test_nothing_set_gives_an_obstacle_and_an_inflation_layer():
    costmap = local_costmap({})
    assert costmap.layers == (
        ("obstacle_layer", ObstacleLayerParams()),
        ("inflation_layer", InflationLayerParams()),
    )
    assert (costmap.robot_radius_m, costmap.width_m, costmap.resolution_m) == (0.46, 10.0, 0.05)


def test_sizes_out_of_range_are_all_reported():
    with pytest.raises(InputError) as caught:
        load(
            {
                "global_costmap": {"width": 501, "height": 500, "resolution": 0.05},
                "local_costmap": {"width": 3, "height": 12, "resolution": 4.0},
            },
            "/nav",
        )
    assert caught.value.problems == [
        "/nav/global_costmap: 501 x 500 m with cells of 0.05 m is not supported: 10020 x 10000"
        " cells of 38 bytes each take 3.8076 GB of memory; expected 1 GB at most (a smaller width"
        " and height, a larger resolution, or fewer layers)",
        "/nav/local_costmap: 3 x 12 m with cells of 4 m is not supported; expected at least 1 cell",
    ]
    assert local_costmap({"width": 50, "height": 50, "resolution": 0.01}).spec.shape == (
        5000,
        5000,
    )
    assert local_costmap({"width": 4, "height": 4, "resolution": 4.0}).spec.shape == (1, 1)


def test_static_map_puts_a_static_layer_first_and_moves_its_parameters():
    costmap = local_costmap(
        {
            "static_map": True,
            "map_topic": "/floor",
            "lethal_cost_threshold": 65,
            "track_unknown_space": True,
        }
    )
    assert [name for name, _ in costmap.layers] == [
        "static_layer",
        "obstacle_layer",
        "inflation_layer",
    ]
    static = costmap.layers[0][1]
    assert static == StaticLayerParams(map_topic="/floor", lethal_cost_threshold=65)
    assert costmap.track_unknown_space
    assert costmap.layers[1][1].track_unknown_space is True


def test_old_style_sources_move_into_the_obstacle_layer():
    tree = {
        "observation_sources": "front  rear",
        "max_obstacle_height": 0.25,
        "front": {"data_type": "LaserScan", "topic": "scan0", "clearing": True},
        "rear": {"data_type": "PointCloud2", "marking": False, "obstacle_range": 1.5},
    }
    configuration = load({"local_costmap": tree}, "")
    obstacles = dict(configuration.local_costmap.layers)["obstacle_layer"]
    front, rear = obstacles.sources
    assert obstacles.max_obstacle_height_m == 0.25
    assert (front.name, front.topic) == ("front", "scan0")
    assert front.clearing and front.marking
    assert (front.obstacle_range_m, front.raytrace_range_m) == (None, None)  # the layer's
    assert (rear.topic, rear.data_type, rear.marking) == ("rear", "PointCloud2", False)
    assert (rear.obstacle_range_m, rear.raytrace_range_m) == (1.5, None)
    left = configuration.to_tree()["local_costmap"]
    assert not {"front", "rear", "observation_sources", "max_obstacle_height"} & set(left)
    assert left["obstacle_layer"]["front"]["topic"] == "scan0"


def test_plugins_give_order_names_and_namespaces():
    costmap = local_costmap(
        {
            "plugins": [INFLATION, OBSTACLE],
            "inflater": {"inflation_radius": 0.3},
            "obstacles": {
                "observation_sources": "scan",
                "scan": {"data_type": "LaserScan"},
                "obstacle_range": 4.0,
                "combination_method": 99,
            },
        }
    )
    assert [name for name, _ in costmap.layers] == ["inflater", "obstacles"]
    inflater, obstacles = (layer for _, layer in costmap.layers)
    assert inflater.inflation_radius_m == 0.3
    assert (obstacles.obstacle_range_m, obstacles.combination_method) == (4.0, 99)


def test_parameters_of_the_costmap_override_the_layers_even_with_plugins():
    tree = {
        "plugins": [OBSTACLE, INFLATION],
        "inflation_radius": 0.8,
        "raytrace_range": 7.0,
        "inflater": {"inflation_radius": 0.3, "cost_scaling_factor": 3.0},
    }
    inflater = layers(tree)["inflater"]
    assert (inflater.inflation_radius_m, inflater.cost_scaling_factor) == (0.8, 3.0)
    assert layers(tree)["obstacles"].raytrace_range_m == 7.0


def test_own_namespaces_count_without_plugins_too():
    tree = {"inflation_layer": {"inflation_radius": 0.3}, "obstacle_layer": {"enabled": False}}
    assert layers(tree)["inflation_layer"].inflation_radius_m == 0.3
    assert not layers(tree)["obstacle_layer"].enabled


def test_map_type_voxel_makes_a_voxel_layer_of_the_costmaps_parameters():
    tree = {
        "map_type": "voxel",
        "z_voxels": 8,
        "z_resolution": 0.25,
        "mark_threshold": 1,
        "publish_voxel_map": True,
        "observation_sources": "scan",
        "scan": {"data_type": "LaserScan"},
        "obstacle_layer": {"unknown_threshold": 4},
    }
    configuration = load({"local_costmap": tree}, "")
    layer = dict(configuration.local_costmap.layers)["obstacle_layer"]
    assert layer == VoxelLayerParams(
        z_voxels=8,
        z_resolution_m=0.25,
        mark_threshold=1,
        publish_voxel_map=True,
        unknown_threshold=4,
        observation_sources="scan",
        sources=(SourceParams("scan", "scan", data_type="LaserScan"),),
    )
    assert [str(remark) for remark in configuration.remarks if "local" in remark.place] == []
    assert configuration.to_tree()["local_costmap"]["obstacle_layer"]["z_voxels"] == 8


def test_voxel_layer_among_plugins():
    voxels = {"name": "space", "type": "costmap_2d::VoxelLayer"}
    tree = {
        "plugins": [voxels],
        "origin_z": 0.5,
        "space": {"origin_z": 1.5, "z_voxels": 20, "max_obstacle_height": 1.0},
    }
    configuration = load({"local_costmap": tree}, "")
    layer = dict(configuration.local_costmap.layers)["space"]
    assert (layer.origin_z_m, layer.z_voxels, layer.max_obstacle_height_m) == (0.5, 16, 1.0)
    told = [str(remark) for remark in configuration.remarks]
    assert (
        "/local_costmap/space/origin_z: ignored by move_base: local_costmap/origin_z overrides it"
    ) in told
    assert (
        "/local_costmap/space/z_voxels: 20 clamped to 16, the largest that move_base allows" in told
    )
    with pytest.raises(InputError, match="^/local_costmap/z_voxels: 0 is out of range; expected a"):
        load({"local_costmap": {"map_type": "voxel", "z_voxels": 0}}, "")


def test_an_obstacle_layer_reads_no_voxels():
    tree = {"obstacle_layer": {"z_voxels": 8}}
    told = [str(remark) for remark in load({"local_costmap": tree}, "").remarks]
    assert (
        "/local_costmap/obstacle_layer/z_voxels: ignored by move_base: only a"
        " costmap_2d::VoxelLayer reads it"
    ) in told


def test_unsupported_layers_are_skipped_with_a_remark():
    depth = {"name": "depth", "type": "costmap_2d::FetchDepthLayer"}
    configuration = load({"local_costmap": {"plugins": [depth, INFLATION], "depth": {"x": 1}}}, "")
    assert [name for name, _ in configuration.local_costmap.layers] == ["inflater"]
    unsupported = [remark for remark in configuration.remarks if remark.kind == "unsupported"]
    assert [remark.place for remark in unsupported] == ["/local_costmap/plugins/depth"]


def test_a_layer_may_be_named_as_an_old_switch():
    tree = {"static_map": True, "plugins": [{**STATIC, "name": "static_map"}]}
    configuration = load({"global_costmap": tree}, "")
    assert configuration.global_costmap.layers == (("static_map", StaticLayerParams()),)
    assert configuration.to_tree()["global_costmap"]["static_map"] == {"enabled": True}


@pytest.mark.parametrize(
    "footprint", [[[0.3, 0.2], [0.3, -0.2], [-0.25, 0]], "[[0.3,0.2], [0.3,-0.2], [-0.25,0]]"]
)
def test_footprint_is_a_list_or_a_string_of_float32(footprint):
    configuration = load({"local_costmap": {"footprint": footprint, "robot_radius": 0.4}}, "")
    expected = (
        (np.float32(0.3), np.float32(0.2)),
        (np.float32(0.3), np.float32(-0.2)),
        (np.float32(-0.25), np.float32(0.0)),
    )
    assert configuration.local_costmap.footprint == expected


def test_list_footprint_becomes_a_string():
    tree = load({"local_costmap": {"footprint": [[0.3, 0.2], [0.3, -0.2], [-1, 0]]}}, "").to_tree()
    assert tree["local_costmap"]["footprint"] == "[[0.3,0.2],[0.3,-0.2],[-1,0]]"


def test_footprint_and_ranges_are_inherited():
    tree = {"observation_sources": "scan", "scan": {"data_type": "LaserScan"}}
    costmap = local_costmap(tree, robot_radius=0.2, obstacle_range=1.25)
    assert costmap.robot_radius_m == 0.2
    assert dict(costmap.layers)["obstacle_layer"].obstacle_range_m == 1.25


def test_faults_of_inherited_values_name_their_origin():
    with pytest.raises(InputError) as caught:
        load({"obstacle_range": "far"}, "/nav")
    assert caught.value.problems == [
        "/nav/obstacle_range: 'far' is not a number; expected a number of metres, 0 or more"
    ]
