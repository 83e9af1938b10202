"""Costmaps in both styles: with a plugins list, and as before ROS Hydro."""

from __future__ import annotations

import numpy as np
import pytest
import yaml

from quad_nav.config import load
from quad_nav.costmap.inflation import InflationLayerParams
from quad_nav.costmap.observation import SourceParams
from quad_nav.costmap.obstacle import ObstacleLayerParams
from quad_nav.costmap.static import StaticLayerParams
from quad_nav.costmap.voxel import VoxelLayerParams
from quad_nav.errors import InputError

OBSTACLE = {"name": "obstacles", "type": "costmap_2d::ObstacleLayer"}
INFLATION = {"name": "inflater", "type": "costmap_2d::InflationLayer"}


def loaded(text):
    """The configuration of a local costmap, its layers by name, and the remarks."""
    configuration = load({"local_costmap": yaml.safe_load(text)}, "")
    told = [str(remark) for remark in configuration.remarks]
    return configuration, dict(configuration.local_costmap.layers), told


def test_nothing_set_gives_an_obstacle_and_an_inflation_layer():
    costmap = load({}).local_costmap
    assert costmap.layers == (
        ("obstacle_layer", ObstacleLayerParams()),
        ("inflation_layer", InflationLayerParams()),
    )
    assert (costmap.robot_radius_m, costmap.width_m, costmap.resolution_m) == (0.46, 10.0, 0.05)


def test_sizes_out_of_range_are_all_reported():
    sizes = {
        "global_costmap": {"width": 501, "height": 500, "resolution": 0.05},
        "local_costmap": {"width": 3, "height": 12, "resolution": 4.0},
    }
    with pytest.raises(InputError) as caught:
        load(sizes, "/nav")
    assert caught.value.problems == [
        "/nav/global_costmap: 501 x 500 m with cells of 0.05 m is not supported: 10020 x 10000"
        " cells of 38 bytes each take 3.8076 GB of memory; expected 1 GB at most (a smaller width"
        " and height, a larger resolution, or fewer layers)",
        "/nav/local_costmap: 3 x 12 m with cells of 4 m is not supported; expected at least 1 cell",
    ]
    smallest = load({"local_costmap": {"width": 4, "height": 4, "resolution": 4.0}})
    assert smallest.local_costmap.spec.shape == (1, 1)


def test_static_map_puts_a_static_layer_first_and_moves_its_parameters():
    configuration, layers, _ = loaded(
        "{static_map: true, map_topic: /floor, lethal_cost_threshold: 65, track_unknown_space: on}"
    )
    assert list(layers) == ["static_layer", "obstacle_layer", "inflation_layer"]
    static = StaticLayerParams(map_topic="/floor", lethal_cost_threshold=65)
    assert layers["static_layer"] == static
    assert configuration.local_costmap.track_unknown_space
    assert layers["obstacle_layer"].track_unknown_space is True


def test_old_style_sources_move_into_the_obstacle_layer():
    configuration, layers, _ = loaded(
        """
        observation_sources: front  rear
        max_obstacle_height: 0.25
        front: {data_type: LaserScan, topic: scan0, clearing: true}
        rear: {data_type: PointCloud2, marking: false, obstacle_range: 1.5}
        """
    )
    obstacles = layers["obstacle_layer"]
    assert obstacles.max_obstacle_height_m == 0.25
    assert obstacles.sources == (
        SourceParams("front", "scan0", data_type="LaserScan", clearing=True),
        SourceParams("rear", "rear", data_type="PointCloud2", marking=False, obstacle_range_m=1.5),
    )
    left = configuration.to_tree()["local_costmap"]
    assert not {"front", "rear", "observation_sources", "max_obstacle_height"} & set(left)
    assert left["obstacle_layer"]["front"]["topic"] == "scan0"


def test_plugins_give_order_and_names_and_the_costmaps_parameters_override_theirs():
    costmap = {
        "plugins": [INFLATION, OBSTACLE],
        "inflation_radius": 0.8,
        "raytrace_range": 7.0,
        "inflater": {"inflation_radius": 0.3, "cost_scaling_factor": 3.0},
        "obstacles": {"obstacle_range": 4.0, "combination_method": 99},
    }
    (name, inflater), (_, obstacles) = load({"local_costmap": costmap}).local_costmap.layers
    assert name == "inflater"
    assert (inflater.inflation_radius_m, inflater.cost_scaling_factor) == (0.8, 3.0)
    assert (obstacles.obstacle_range_m, obstacles.combination_method) == (4.0, 99)
    assert obstacles.raytrace_range_m == 7.0


def test_own_namespaces_count_without_plugins_too():
    _, layers, _ = loaded(
        "{inflation_layer: {inflation_radius: 0.3}, obstacle_layer: {enabled: false}}"
    )
    assert layers["inflation_layer"].inflation_radius_m == 0.3
    assert not layers["obstacle_layer"].enabled


def test_map_type_voxel_makes_a_voxel_layer_of_the_costmaps_parameters():
    configuration, layers, told = loaded(
        """
        {map_type: voxel, z_voxels: 8, z_resolution: 0.25, mark_threshold: 1,
         publish_voxel_map: true, observation_sources: scan, scan: {data_type: LaserScan},
         obstacle_layer: {unknown_threshold: 4}}
        """
    )
    assert layers["obstacle_layer"] == VoxelLayerParams(
        z_voxels=8,
        z_resolution_m=0.25,
        mark_threshold=1,
        publish_voxel_map=True,
        unknown_threshold=4,
        observation_sources="scan",
        sources=(SourceParams("scan", "scan", data_type="LaserScan"),),
    )
    assert not any("local" in line for line in told)
    assert configuration.to_tree()["local_costmap"]["obstacle_layer"]["z_voxels"] == 8


def test_voxel_layer_among_plugins():
    _, layers, told = loaded(
        """
        plugins: [{name: space, type: "costmap_2d::VoxelLayer"}]
        origin_z: 0.5
        space: {origin_z: 1.5, z_voxels: 20, max_obstacle_height: 1.0}
        """
    )
    layer = layers["space"]
    assert (layer.origin_z_m, layer.z_voxels, layer.max_obstacle_height_m) == (0.5, 16, 1.0)
    place = "/local_costmap/space"
    assert (
        f"{place}/origin_z: ignored by move_base: local_costmap/origin_z overrides it" in told
        and f"{place}/z_voxels: 20 clamped to 16, the largest that move_base allows" in told
    )
    with pytest.raises(InputError, match="^/local_costmap/z_voxels: 0 is out of range; expected a"):
        loaded("{map_type: voxel, z_voxels: 0}")


def test_an_obstacle_layer_reads_no_voxels():
    _, _, told = loaded("obstacle_layer: {z_voxels: 8}")
    assert any("only a costmap_2d::VoxelLayer reads it" in line for line in told)


def test_unsupported_layers_are_skipped_with_a_remark():
    depth = {"name": "depth", "type": "costmap_2d::FetchDepthLayer"}
    configuration = load({"local_costmap": {"plugins": [depth, INFLATION], "depth": {"x": 1}}}, "")
    assert [name for name, _ in configuration.local_costmap.layers] == ["inflater"]
    unsupported = [remark for remark in configuration.remarks if remark.kind == "unsupported"]
    assert [remark.place for remark in unsupported] == ["/local_costmap/plugins/depth"]


def test_a_layer_may_be_named_as_an_old_switch():
    configuration, layers, _ = loaded(
        "{static_map: true, plugins: [{name: static_map, type: 'costmap_2d::StaticLayer'}]}"
    )
    assert layers == {"static_map": StaticLayerParams()}
    assert configuration.to_tree()["local_costmap"]["static_map"] == {"enabled": True}


@pytest.mark.parametrize("quote", ["", "'"])
def test_footprint_is_a_list_or_a_string_of_float32(quote):
    points = "[[0.3,0.2],[0.3,-0.2],[-0.25,0]]"
    configuration, _, _ = loaded(f"{{footprint: {quote}{points}{quote}, robot_radius: 0.4}}")
    expected = np.float32([[0.3, 0.2], [0.3, -0.2], [-0.25, 0.0]])
    assert configuration.local_costmap.footprint == tuple(map(tuple, expected))
    assert configuration.to_tree()["local_costmap"]["footprint"] == points


def test_footprint_and_ranges_are_inherited_and_their_faults_name_the_origin():
    scan = {"observation_sources": "scan", "scan": {"data_type": "LaserScan"}}
    tree = {"local_costmap": scan, "robot_radius": 0.2, "obstacle_range": 1.25}
    costmap = load(tree).local_costmap
    assert costmap.robot_radius_m == 0.2
    assert dict(costmap.layers)["obstacle_layer"].obstacle_range_m == 1.25
    with pytest.raises(InputError) as caught:
        load({"obstacle_range": "far"}, "/nav")
    assert caught.value.problems == [
        "/nav/obstacle_range: 'far' is not a number; expected a number of metres, 0 or more"
    ]
