"""One layer of 1 m cells; the sensor stands in the middle of a cell."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from costmap_maps import costs_of, drawn, picture

from quad_nav.costmap.cost_grid import NOWHERE, Bounds, CostGrid, Window
from quad_nav.costmap.observation import SourceParams
from quad_nav.costmap.obstacle import ObstacleLayerParams
from quad_nav.costmap.projection import scan_points, transform_points
from quad_nav.geometry import Pose2D, Pose3D, Scan, quaternion_from_euler, quaternion_from_yaw
from quad_nav.grid import UNKNOWN, GridSpec

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


def test_bounds_hold_sensor_hit_and_footprint():
    layer = layer_of()
    layer.set_footprint(np.array([(0.2, 0.4), (-0.2, 0.4), (-0.2, -0.4)]), 0.2)
    see(layer, 4.0)
    bounds = layer.update_bounds(ROBOT, 0.0, NOWHERE)
    assert bounds == Bounds(0.3, 2.1, 4.5, 2.9)


def test_beams_end_at_the_border_of_the_grid():
    layer = layer_of()
    see(layer, 15.0, 15.0, sensor=Pose3D(0.5, 2.25, 0.3))  # the second one leaves at (3.25, 5)
    layer.update_bounds(ROBOT, 0.0, NOWHERE)
    assert picture(layer.grid.costs) == drawn("""???.??
                                                 ?..???
                                                 ......
                                                 ??????
                                                 ??????""")


def test_ranges_limit_marking_and_clearing():
    layer = layer_of(replace(SOURCE, obstacle_range_m=4.0, raytrace_range_m=2.0))
    see(layer, 4.0)
    layer.update_bounds(ROBOT, 0.0, NOWHERE)
    assert picture(layer.grid.costs[2:3]) == drawn("...???")


def test_ranges_of_the_layer_count_when_the_source_has_none():
    layer = layer_of(
        replace(SOURCE, obstacle_range_m=None, raytrace_range_m=None),
        obstacle_range_m=4.5,
        raytrace_range_m=1.0,
    )
    see(layer, 4.0)
    layer.update_bounds(ROBOT, 0.0, NOWHERE)
    assert picture(layer.grid.costs[2:3]) == drawn("..??#?")


def test_what_is_not_tracked_as_unknown_is_free():
    layer = layer_of(unknown=False)
    see(layer, 4.0)
    layer.update_bounds(ROBOT, 0.0, NOWHERE)
    assert picture(layer.grid.costs[1:4]) == drawn("......\n....#.\n......")


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


def test_observations_of_a_silent_sensor_stay():
    layer = layer_of(replace(SOURCE, observation_persistence_s=1.0))
    see(layer, 4.0)
    layer.grid.reset()
    layer.update_bounds(ROBOT, 100.0, NOWHERE)
    assert picture(layer.grid.costs[2:3]) == drawn("....#?")


def test_without_persistence_the_newest_counts():
    layer = layer_of()
    see(layer, 2.0, at_s=0.0)
    see(layer, 4.0, at_s=0.0)
    layer.update_bounds(ROBOT, 0.0, NOWHERE)
    assert picture(layer.grid.costs[2:3]) == drawn("....#?")


def test_heights_of_the_source_hold_for_clearing_too():
    layer = layer_of(replace(SOURCE, max_obstacle_height_m=0.2))
    see(layer, 4.0)
    layer.update_bounds(ROBOT, 0.0, NOWHERE)
    assert (layer.grid.costs == UNKNOWN).all()


def test_height_of_the_layer_holds_for_marking_only():
    layer = layer_of(max_obstacle_height_m=0.2)
    see(layer, 4.0)
    layer.update_bounds(ROBOT, 0.0, NOWHERE)
    assert picture(layer.grid.costs[2:3]) == drawn(".....?")


def test_a_sensor_outside_marks_and_does_not_clear():
    layer = layer_of()
    see(layer, 4.0, sensor=Pose3D(-0.5, 2.5, 0.3))
    layer.update_bounds(ROBOT, 0.0, NOWHERE)
    assert picture(layer.grid.costs[2:3]) == drawn("???#??")


def test_rays_start_at_the_sensor_frame_if_it_is_another():
    layer = layer_of()
    layer.add_scan("laser", scan_of(3.0), SENSOR, 0.0, Pose3D(2.5, 2.5, 0.3))
    layer.update_bounds(ROBOT, 0.0, NOWHERE)
    assert picture(layer.grid.costs[2:3]) == drawn("??.#??")


@pytest.mark.parametrize(
    "method, expected",
    [
        (0, "#..##."),  # overwrites what the layer knows
        (1, "#.####"),  # keeps the higher cost, with unknown the lowest
        (2, "#?##.#"),
    ],
)  # leaves the master alone
def test_combination_with_the_layers_below(method, expected):
    layer = layer_of(combination_method=method)
    layer.grid.costs[...] = costs_of("?..##.")
    master = CostGrid(GridSpec(6, 5, 1.0))
    master.costs[0] = costs_of("#?##.#")[0]
    layer.update_costs(master, Window(0, 6, 0, 1))
    assert picture(master.costs[0:1]) == expected


def test_footprint_is_cleared_in_the_layer():
    layer = layer_of(unknown=False)
    layer.grid.costs[...] = 254
    layer.set_footprint(np.array([(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)]), 1.0)
    robot = Pose2D(2.5, 2.5)
    layer.update_bounds(robot, 0.0, NOWHERE)
    layer.update_costs(CostGrid(GridSpec(6, 5, 1.0)), Window(0, 6, 0, 5))
    assert picture(layer.grid.costs) == drawn("""######
                                         #...##
                                         #...##
                                         #...##
                                         ######""")


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


def test_a_sensor_that_never_spoke_is_silent_since_the_first_update():
    layer = layer_of(replace(SOURCE, expected_update_period_s=0.3))
    layer.update_bounds(ROBOT, 50.0, NOWHERE)
    assert layer.is_current(50.2)
    assert layer.stale_sources(51.0) == [("laser", 1.0)]


def test_cleared_area_is_not_current_until_the_next_update():
    layer = layer_of(unknown=False)
    layer.grid.costs[...] = 254
    assert layer.clear_area(2.5, 2.5, 3.0, keep_inside=True)
    assert not layer.is_current(0.0)
    bounds = layer.update_bounds(ROBOT, 0.0, NOWHERE)
    assert bounds == Bounds(0.0, 0.0, 6.0, 5.0)
    assert layer.is_current(0.0)
    master = CostGrid(GridSpec(6, 5, 1.0))
    layer.update_costs(master, Window(0, 6, 0, 5))
    assert picture(master.costs) == drawn("""......
                                     ..##..
                                     ..##..
                                     ......
                                     ......""")


def test_reset_keeps_observations_and_forgets_the_grid():
    layer = layer_of(replace(SOURCE, observation_persistence_s=5.0))
    see(layer, 4.0)
    layer.grid.costs[0] = 254
    layer.reset(1.0)
    assert (layer.grid.costs == UNKNOWN).all()
    layer.update_bounds(ROBOT, 1.0, NOWHERE)
    assert picture(layer.grid.costs[2:3]) == drawn("....#?")


def test_beams_that_count():
    scan = scan_of(1.0, math.inf, math.nan, 0.05, 20.0, -1.0, -math.inf, 2.0, increment_rad=0.0)
    assert scan_points(scan, inf_is_valid=False).tolist() == [[1.0, 0.0, 0.0], [2.0, 0.0, 0.0]]
    with_inf = scan_points(scan, inf_is_valid=True)
    assert with_inf.dtype == np.float32
    assert with_inf[:, 0].tolist() == [1.0, float(np.float32(20.0) - np.float32(0.0001)), 2.0]


def test_no_beams_no_points():
    assert scan_points(scan_of(), inf_is_valid=True).shape == (0, 3)


def test_points_follow_the_sensor():
    quarter_turn = Pose3D(10.0, 20.0, 1.0, quaternion_from_yaw(math.pi / 2))
    np.testing.assert_allclose(
        transform_points(np.array([[2.0, 1.0, 0.5]]), quarter_turn), [[9.0, 22.0, 1.5]], atol=1e-5
    )
    nose_down = Pose3D(0.0, 0.0, 3.0, quaternion_from_euler(0.0, math.pi / 2, 0.0))
    np.testing.assert_allclose(
        transform_points(np.array([[2.0, 1.0, 0.0]]), nose_down), [[0.0, 1.0, 1.0]], atol=1e-6
    )


def test_points_outside_the_heights_are_dropped():
    points = np.array([[0, 0, 0.1], [1, 0, 0.25], [2, 0, 0.5], [3, 0, np.nan]], dtype=np.float32)
    kept = transform_points(points, Pose3D(0.0, 0.0, 0.0), 0.25, 0.4)
    assert kept.tolist() == [[1.0, 0.0, 0.25]]
