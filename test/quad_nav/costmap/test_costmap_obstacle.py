"""One layer of 1 m cells; the sensor stands in the middle of a cell."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from costmap_maps import drawn, picture

from quad_nav.costmap.cost_grid import NOWHERE
from quad_nav.costmap.observation import SourceParams
from quad_nav.costmap.obstacle import ObstacleLayerParams
from quad_nav.costmap.projection import transform_points
from quad_nav.geometry import Pose2D, Pose3D, Scan, quaternion_from_euler, quaternion_from_yaw
from quad_nav.grid import GridSpec

SOURCE = SourceParams(
    name="laser", data_type="LaserScan", clearing=True, obstacle_range_m=10.0, raytrace_range_m=10.0
)
SENSOR = Pose3D(0.5, 2.5, 0.3)
ROBOT = Pose2D(0.5, 2.5)


def layer_of(source=SOURCE, size=(6, 5), unknown=True, **params):
    params = ObstacleLayerParams(sources=(source,), track_unknown_space=unknown, **params)
    return params.make_layer(GridSpec(*size, 1.0), rolling_window=False, default_cost=0)


def scan_of(*ranges_m, stamp_s=0.0, angle_min_rad=0.0, increment_rad=math.pi / 4):
    return Scan(
        stamp_s, angle_min_rad, increment_rad, 0.1, 20.0, np.array(ranges_m, dtype=np.float32)
    )


def see(layer, *ranges_m, at_s=0.0, sensor=SENSOR, **scan):
    layer.add_scan("laser", scan_of(*ranges_m, stamp_s=at_s, **scan), sensor, at_s)


def test_a_beam_clears_up_to_the_cell_it_marks():
    layer = layer_of()
    see(layer, 4.0)
    layer.update_bounds(ROBOT, 0.0, NOWHERE)
    assert picture(layer.grid.costs) == drawn("""??????
                                         ??????
                                         ....#?
                                         ??????
                                         ??????""")


def test_a_newer_beam_clears_only_when_the_older_one_has_expired():
    layer = layer_of(replace(SOURCE, observation_persistence_s=1.0))
    see(layer, 2.0, at_s=0.0)
    see(layer, 4.0, at_s=0.5)
    layer.update_bounds(ROBOT, 0.5, NOWHERE)
    assert picture(layer.grid.costs[2:3]) == drawn("..#.#?")
    see(layer, 4.0, at_s=1.0)  # 1.0 s old is not too old
    layer.update_bounds(ROBOT, 1.0, NOWHERE)
    assert picture(layer.grid.costs[2:3]) == drawn("..#.#?")
    see(layer, 4.0, at_s=1.1)
    layer.update_bounds(ROBOT, 1.1, NOWHERE)
    assert picture(layer.grid.costs[2:3]) == drawn("....#?")


def test_a_silent_sensor_is_named_and_stops_clearing():
    layer = layer_of(replace(SOURCE, expected_update_period_s=0.3))
    see(layer, 4.0, at_s=1.0)
    assert layer.is_current(1.3)
    assert layer.stale_sources(1.3) == []
    assert not layer.is_current(1.4)
    ((name, age_s),) = layer.stale_sources(1.4)
    assert (name, age_s) == ("laser", pytest.approx(0.4))
    layer.update_bounds(ROBOT, 1.4, NOWHERE)
    assert picture(layer.grid.costs[2:3]) == drawn("????#?")


def test_points_follow_the_sensor():
    quarter_turn = Pose3D(10.0, 20.0, 1.0, quaternion_from_yaw(math.pi / 2))
    np.testing.assert_allclose(
        transform_points(np.array([[2.0, 1.0, 0.5]]), quarter_turn), [[9.0, 22.0, 1.5]], atol=1e-5
    )
    nose_down = Pose3D(0.0, 0.0, 3.0, quaternion_from_euler(0.0, math.pi / 2, 0.0))
    np.testing.assert_allclose(
        transform_points(np.array([[2.0, 1.0, 0.0]]), nose_down), [[0.0, 1.0, 1.0]], atol=1e-6
    )
