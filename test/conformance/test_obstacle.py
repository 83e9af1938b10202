"""Scans and clouds to master grids, against the original's, cell for cell."""
from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from quad_nav.costmap.inflation import InflationLayerParams
from quad_nav.costmap.layered import CostmapParams, LayeredCostmap
from quad_nav.costmap.observation import SourceParams
from quad_nav.costmap.obstacle import ObstacleLayer, ObstacleLayerParams
from quad_nav.geometry import Pose2D, Pose3D, Scan

DATA = Path(__file__).parent / "data" / "obstacle"
CASES = [entry["case"] for entry in json.loads((DATA / "index.json").read_text())]

COSTMAP_FIELDS = {
    "global_frame": "global_frame", "robot_base_frame": "robot_base_frame",
    "update_frequency": "update_frequency_hz", "publish_frequency": "publish_frequency_hz",
    "width": "width_m", "height": "height_m", "resolution": "resolution_m",
    "origin_x": "origin_x_m", "origin_y": "origin_y_m", "rolling_window": "rolling_window",
    "track_unknown_space": "track_unknown_space", "robot_radius": "robot_radius_m",
    "footprint_padding": "footprint_padding_m", "transform_tolerance": "transform_tolerance_s"}
OBSTACLE_FIELDS = {
    "footprint_clearing_enabled": "footprint_clearing_enabled",
    "max_obstacle_height": "max_obstacle_height_m", "combination_method": "combination_method",
    "obstacle_range": "obstacle_range_m", "raytrace_range": "raytrace_range_m",
    "track_unknown_space": "track_unknown_space"}
SOURCE_FIELDS = {
    "topic": "topic", "sensor_frame": "sensor_frame", "data_type": "data_type",
    "observation_persistence": "observation_persistence_s",
    "expected_update_rate": "expected_update_period_s",
    "min_obstacle_height": "min_obstacle_height_m",
    "max_obstacle_height": "max_obstacle_height_m", "obstacle_range": "obstacle_range_m",
    "raytrace_range": "raytrace_range_m", "marking": "marking", "clearing": "clearing",
    "inf_is_valid": "inf_is_valid"}
INFLATION_FIELDS = {"inflation_radius": "inflation_radius_m",
                    "cost_scaling_factor": "cost_scaling_factor",
                    "inflate_unknown": "inflate_unknown"}


def renamed(tree, fields):
    return {field: tree[name] for name, field in fields.items() if name in tree}


def obstacle_params(tree):
    sources = tuple(SourceParams(name=name, **renamed(tree[name], SOURCE_FIELDS))
                    for name in tree.get("observation_sources", "").split())
    return ObstacleLayerParams(sources=sources, **renamed(tree, OBSTACLE_FIELDS))


def inflation_params(tree):
    return InflationLayerParams(**renamed(tree, INFLATION_FIELDS))


def costmap_params(tree):
    """The recorded parameter tree, old style or with explicit plugins."""
    make = {"costmap_2d::ObstacleLayer": obstacle_params,
            "costmap_2d::InflationLayer": inflation_params}
    if "plugins" in tree:
        layers = tuple((plugin["name"], make[plugin["type"]](tree.get(plugin["name"], {})))
                       for plugin in tree["plugins"])
    else:
        layers = (("obstacle_layer", obstacle_params(tree)),
                  ("inflation_layer", inflation_params(tree)))
    # The original reads the numbers of a footprint as float32.
    points = np.array(json.loads(tree.get("footprint", "[]")), dtype=np.float32).tolist()
    return CostmapParams(layers=layers, footprint=tuple(map(tuple, points)) or None,
                         **renamed(tree, COSTMAP_FIELDS))


class Replay:
    """A costmap driven by a recorded list of events."""

    def __init__(self, case):
        with np.load(DATA / f"{case}.npz") as arrays:
            self.recorded = dict(arrays)
        self.meta = json.loads(str(self.recorded["meta"]))
        self.costmap = LayeredCostmap(costmap_params(self.meta["params"]))
        (self.obstacles,) = [layer for layer in self.costmap.layers.values()
                             if isinstance(layer, ObstacleLayer)]
        self.sources = list(self.obstacles.buffers)

    def run(self):
        for event in self.meta["events"]:
            getattr(self, event["type"])(event)

    def scan(self, event):
        scan = Scan(event["stamp"], event["angle_min"], event["angle_increment"],
                    event["range_min"], event["range_max"],
                    self.recorded[f"ranges_{event['index']:03d}"])
        self.obstacles.add_scan(self.sources[event["source"]], scan, *self.poses(event))
        self.check_observation(event)

    def cloud(self, event):
        self.obstacles.add_cloud(
            self.sources[event["source"]], self.recorded[f"cloud_in_{event['index']:03d}"],
            self.poses(event)[0], event["stamp"], *self.poses(event)[1:])
        self.check_observation(event)

    def poses(self, event):
        x, y, z, *quaternion = event["sensor_in_map"]
        origin = Pose3D(*self.recorded[f"obs_origin_{event['index']:03d}"].tolist())
        return Pose3D(x, y, z, tuple(quaternion)), event["now"], origin

    def check_observation(self, event):
        buffer = self.obstacles.buffers[self.sources[event["source"]]]
        assert len(buffer.observations) == event["n_observations_after"]
        newest = buffer.observations[0]
        assert newest.points.dtype == np.float32
        np.testing.assert_array_equal(
            newest.points, self.recorded[f"obs_cloud_{event['index']:03d}"])

    def reset_layers(self, event):
        self.costmap.reset_layers(event["now"])

    def update(self, event):
        k, recorded = event["index"], self.recorded
        window = self.costmap.update(event["now"], Pose2D(*recorded["robot_pose"][k].tolist()))
        spec = self.costmap.spec
        assert [spec.origin_x_m, spec.origin_y_m] == recorded["origin"][k].tolist()
        assert [window.x0, window.xn, window.y0, window.yn] == recorded["bounds"][k].tolist()
        counts = [len(buffer.observations) for buffer in self.obstacles.buffers.values()]
        assert counts == event["n_observations"]
        np.testing.assert_array_equal(self.obstacles.grid.costs, recorded["layer"][k])
        np.testing.assert_array_equal(self.costmap.costs, recorded["master"][k])
        assert self.costmap.is_current(event["now"]) == bool(recorded["current"][k])


@pytest.mark.parametrize("case", CASES)
def test_events(case):
    replay = Replay(case)
    assert any(event["type"] == "update" for event in replay.meta["events"])
    replay.run()


@pytest.mark.parametrize("case", CASES)
def test_what_follows_from_the_parameters(case):
    replay = Replay(case)
    costmap, effective = replay.costmap, replay.meta["effective"]
    np.testing.assert_array_equal(costmap.footprint, replay.recorded["footprint"])
    assert costmap.inscribed_radius_m == effective["inscribed_radius"]
    assert costmap.circumscribed_radius_m == effective["circumscribed_radius"]
    assert (costmap.spec.size_x, costmap.spec.size_y) == (effective["size_x"],
                                                          effective["size_y"])
    assert list(costmap.layers) == effective["layers"]
    assert replay.obstacles.grid.default_cost == effective["layer"]["default_value"]
