"""Implausible scans, and those that only look odd."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from quad_nav.costmap.scan_validator import SensorValidator
from quad_nav.geometry import Pose3D, Scan, quaternion_from_yaw

BEAMS = 100
WALL = np.linspace(2.0, 6.0, BEAMS, dtype=np.float32)


def scan(stamp_s, ranges_m=WALL, field_rad=2 * math.pi):
    return Scan(stamp_s, 0.0, field_rad / BEAMS, 0.02, 60.0, np.array(ranges_m, dtype=np.float32))


def at(x_m, yaw_rad=0.0):
    return Pose3D(x_m, 1.0, 1.0, quaternion_from_yaw(yaw_rad))


class Judge(SensorValidator):
    """A validator of a sensor that may be silent for a time."""

    def __init__(self, timeout_s):
        super().__init__()
        self._timeout_s = timeout_s

    def rejection_reason(self, scan, pose, now_s):
        return super().rejection_reason(scan, pose, now_s, self._timeout_s)


def validator(timeout_s=0.5):
    return Judge(timeout_s)


def after_a_scan(ranges_m=WALL, **keywords):
    judge = validator()
    assert judge.rejection_reason(scan(1.0, ranges_m, **keywords), at(0.0), 1.0) == ""
    return judge


def some(value, count):
    """The wall, with the first ``count`` beams replaced."""
    ranges_m = WALL.copy()
    ranges_m[:count] = value
    return ranges_m


def test_a_scan_as_old_as_the_sensor_may_be_silent_is_rejected():
    assert validator().rejection_reason(scan(1.0), at(0.0), 1.49) == ""
    assert validator().rejection_reason(scan(1.0), at(0.0), 1.5) == (
        "it is 0.50 s old, expected less than 0.50 s"
    )
    assert validator(0.0).rejection_reason(scan(1.0), at(0.0), 99.0) == ""


@pytest.mark.parametrize("value", [math.nan, 0.0, 0.019, -math.inf])
def test_a_scan_without_a_valid_beam_is_rejected_even_the_first(value):
    reason = validator().rejection_reason(scan(1.0, np.full(BEAMS, value)), at(0.0), 1.0)
    assert reason == "none of its 100 beams is valid"


@pytest.mark.parametrize("value", [math.nan, 0.0, math.inf])
def test_a_quarter_of_the_beams_may_lose_their_return(value):
    assert after_a_scan().rejection_reason(scan(1.1, some(value, 25)), at(0.03), 1.1) == ""
    assert after_a_scan().rejection_reason(scan(1.1, some(value, 26)), at(0.03), 1.1) == (
        "26 of 100 beams lost their return at once"
    )


def test_the_same_scan_from_elsewhere_is_rejected():
    judge = after_a_scan()
    assert judge.rejection_reason(scan(1.1), at(0.04), 1.1) == ""
    assert judge.rejection_reason(scan(1.2), at(0.08), 1.2) == (
        "it is identical to a scan taken 0.08 m and 0.00 rad from here"
    )
    assert judge.rejection_reason(scan(1.3), at(0.08, 0.1), 1.3).endswith(
        "0.08 m and 0.10 rad from here"
    )
    assert judge.rejection_reason(scan(1.4, WALL + 0.001), at(0.08), 1.4) == ""


def test_a_standing_robot_may_repeat_its_scan_also_after_a_correction_of_its_pose():
    judge = after_a_scan()
    for tick in range(1, 100):
        assert judge.rejection_reason(scan(1.0 + tick), at(0.0), 1.0 + tick) == ""
    for tick in range(100, 110):
        assert judge.rejection_reason(scan(1.0 + tick), at(0.3), 1.0 + tick) == ""


@pytest.mark.parametrize(
    "field_rad, turn_rad, lost, is_accepted",
    [(math.pi, 0.8, 50, True), (math.pi, 0.7, 50, False), (2 * math.pi, 0.8, 30, False)],
)
def test_a_turn_takes_returns_out_of_a_field_of_view_that_is_not_full(
    field_rad, turn_rad, lost, is_accepted
):
    """With half a circle a turn of 0.8 rad may lose 25 + 25.4 beams."""
    turned = scan(1.1, some(math.inf, lost), field_rad)
    reason = after_a_scan(field_rad=field_rad).rejection_reason(turned, at(0.0, turn_rad), 1.1)
    assert (reason == "") is is_accepted


def test_a_single_beam_may_turn_away():
    # Its field of view is 0 rad: a division by it ended the navigator.
    beam, lost = Scan(1.0, 0.0, 0.0, 0.02, 60.0, WALL[:1]), np.array([math.inf], np.float32)
    judge = validator()
    assert judge.rejection_reason(beam, at(0.0), 1.0) == ""
    assert judge.rejection_reason(replace(beam, ranges_m=lost), at(0.0, 0.1), 1.0) == ""
