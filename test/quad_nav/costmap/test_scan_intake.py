"""One sensor, its validation and the layers that take its messages."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from quad_nav.costmap.layered import CostmapParams, LayeredCostmap
from quad_nav.costmap.observation import SourceParams
from quad_nav.costmap.obstacle import ObstacleLayerParams
from quad_nav.costmap.scan_filter import ScanFilters
from quad_nav.costmap.scan_intake import ScanIntake, SensorPose, sinks_of
from quad_nav.costmap.scan_validator import ScanValidator, ScanValidatorParams
from quad_nav.geometry import Pose3D, Scan

SOURCE = SourceParams("laser", data_type="LaserScan", expected_update_period_s=0.5)
LIDAR = Pose3D(1.0, 2.0, 0.3)
REJECT = ScanValidatorParams()
ACCEPT_ALL = ScanValidatorParams(reject_implausible_scans=False)


DEFAULTS = ScanValidatorParams()


def costmap_of(*sources):
    layer = ObstacleLayerParams(sources=sources)
    return LayeredCostmap(CostmapParams(layers=(("obstacle_layer", layer),)))


def intake_of(*costmaps, params=DEFAULTS):
    return ScanIntake(sinks_of(costmaps), ScanFilters([ScanValidator(params)]), "map")


def at(pose, intake):
    return [SensorPose(pose, pose)] * len(intake.sinks)


def scan(stamp_s=0.0, *ranges_m):
    ranges = np.array(ranges_m or (3.0, 2.0), dtype=np.float32)
    return Scan(stamp_s, 0.0, math.pi / 2, 0.02, 60.0, ranges)


def observations(costmap, source="laser"):
    return costmap.layers["obstacle_layer"].buffers[source].observations


def test_an_accepted_scan_reaches_every_layer():
    costmaps = costmap_of(SOURCE), costmap_of(SOURCE)
    intake = intake_of(*costmaps)
    assert intake.add_scan(scan(), at(LIDAR, intake), 0.0, 0.0) == ""
    for costmap in costmaps:
        (seen,) = observations(costmap)
        np.testing.assert_allclose(seen.points, [(4.0, 2.0, 0.3), (1.0, 4.0, 0.3)], atol=1e-6)
        assert seen.sensor.tolist() == [1.0, 2.0, 0.3]


def test_reset_forgets_earlier_scans():
    intake = intake_of(costmap_of(SOURCE))
    lost = scan(0.1, math.nan, 2.0)
    assert intake.add_scan(scan(0.0), at(LIDAR, intake), 0.0, 0.0) == ""
    assert intake.add_scan(lost, at(LIDAR, intake), 0.1, 0.1) == (
        "1 of 2 beams lost their return at once"
    )
    intake.reset()
    assert intake.add_scan(lost, at(LIDAR, intake), 0.1, 0.1) == ""


@pytest.mark.parametrize("params, silence_s", [(REJECT, 0.4), (ACCEPT_ALL, 0.1)])
def test_silence_counts_from_the_stamp_of_a_late_scan_only_with_validation(params, silence_s):
    costmap = costmap_of(SOURCE)
    intake = intake_of(costmap, params=params)
    intake.add_scan(scan(1.0), at(LIDAR, intake), 1.3, 1.3)
    buffer = costmap.layers["obstacle_layer"].buffers["laser"]
    assert buffer.silence_s(1.4) == pytest.approx(silence_s)


def test_layers_that_see_a_scan_alike_share_its_projection():
    low = replace(SOURCE, max_obstacle_height_m=0.2)
    costmaps = costmap_of(SOURCE), costmap_of(SOURCE), costmap_of(low)
    intake = intake_of(*costmaps)
    intake.add_scan(scan(), at(LIDAR, intake), 0.0, 0.0)
    first, second, third = (observations(costmap)[0] for costmap in costmaps)
    assert first is second
    assert len(first.points) == 2 and len(third.points) == 0


def test_a_late_scan_that_the_first_layer_no_longer_keeps_still_reaches_the_second():
    brief = replace(SOURCE, observation_persistence_s=0.1)
    lasting = replace(SOURCE, observation_persistence_s=1.0)
    costmaps = costmap_of(brief), costmap_of(lasting)
    intake = intake_of(*costmaps, params=ACCEPT_ALL)
    intake.add_scan(scan(1.0), at(LIDAR, intake), 1.3, 1.3)
    assert [len(observations(costmap)) for costmap in costmaps] == [0, 1]


def test_expected_period_is_that_of_the_strictest_source():
    slow = replace(SOURCE, expected_update_period_s=2.0)
    never = replace(SOURCE, expected_update_period_s=0.0)
    assert intake_of(costmap_of(slow), costmap_of(SOURCE)).expected_period_s == 0.5
    assert intake_of(costmap_of(never)).expected_period_s == 0.0
