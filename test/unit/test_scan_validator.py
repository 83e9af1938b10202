"""Scans that cannot be true, and those that only look odd."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from quad_nav.costmap.observation import SourceParams
from quad_nav.costmap.scan_validator import ScanValidator
from quad_nav.geometry import Pose3D, Scan, quaternion_from_yaw

BEAMS = 100
WALL = np.linspace(2.0, 6.0, BEAMS, dtype=np.float32)


def scan(stamp_s, ranges_m=WALL, field_rad=2 * math.pi):
    return Scan(stamp_s, 0.0, field_rad / BEAMS, 0.02, 60.0, np.array(ranges_m, dtype=np.float32))


def at(x_m, yaw_rad=0.0):
    return Pose3D(x_m, 1.0, 1.0, quaternion_from_yaw(yaw_rad))


def trust(timeout_s=0.5):
    return ScanValidator(
        [
            SourceParams("scan", expected_update_period_s=timeout_s),
            SourceParams("slower", expected_update_period_s=2.0),
        ]
    )


def having_seen(ranges_m=WALL, **keywords):
    looker = trust()
    assert looker.why_not(scan(1.0, ranges_m, **keywords), at(0.0), 1.0) == ""
    return looker


def some(value, count):
    """The wall, with the first ``count`` beams replaced."""
    ranges_m = WALL.copy()
    ranges_m[:count] = value
    return ranges_m


def test_a_scan_as_old_as_the_sensor_may_be_silent_is_not_believed():
    assert trust().why_not(scan(1.0), at(0.0), 1.49) == ""
    assert trust().why_not(scan(1.0), at(0.0), 1.5) == "it is 0.50 s old"
    assert trust(0.0).why_not(scan(1.0), at(0.0), 2.9) == ""  # the slower one's period counts
    assert ScanValidator([SourceParams("scan")]).why_not(scan(1.0), at(0.0), 99.0) == ""


@pytest.mark.parametrize("value", [math.nan, 0.0, 0.019, -math.inf])
def test_beams_that_say_nothing_are_no_scan_even_the_first(value):
    told = trust().why_not(scan(1.0, np.full(BEAMS, value)), at(0.0), 1.0)
    assert told == "none of its 100 beams says anything"


def test_nothing_around_is_believed_until_something_was():
    nothing = np.full(BEAMS, np.inf)
    assert trust().why_not(scan(1.0, nothing), at(0.0), 1.0) == ""
    assert having_seen().why_not(scan(1.1, nothing), at(0.0), 1.1) == (
        "100 of 100 beams have lost what they met"
    )


@pytest.mark.parametrize("value", [math.nan, 0.0, math.inf])
def test_a_quarter_of_the_beams_may_lose_what_they_met(value):
    assert having_seen().why_not(scan(1.1, some(value, 25)), at(0.03), 1.1) == ""
    assert having_seen().why_not(scan(1.1, some(value, 26)), at(0.03), 1.1) == (
        "26 of 100 beams have lost what they met"
    )


def test_what_was_lost_is_missed_until_it_is_back():
    looker = having_seen()
    for tick in range(1, 50):
        assert looker.why_not(scan(1.0 + tick, some(math.nan, 50)), at(0.1), 1.0 + tick) != ""
    assert looker.why_not(scan(60.0), at(0.0), 60.0) == ""


def test_what_was_far_away_may_be_out_of_range_now():
    assert (
        having_seen(np.full(BEAMS, 31.0)).why_not(scan(1.1, np.full(BEAMS, np.inf)), at(0.1), 1.1)
        == ""
    )


def test_after_a_long_way_everything_may_be_gone():
    assert having_seen().why_not(scan(9.0, np.full(BEAMS, np.inf)), at(2.1), 9.0) == ""


def test_a_turn_takes_things_out_of_a_smaller_field_of_view_and_not_out_of_a_full_one():
    half, lost = math.pi, some(math.inf, 50)  # a turn of 0.8 rad may lose 25 + 25.4 beams
    assert having_seen(field_rad=half).why_not(scan(1.1, lost, half), at(0.0, 0.8), 1.1) == ""
    assert having_seen(field_rad=half).why_not(scan(1.1, lost, half), at(0.0, 0.7), 1.1) != ""
    assert having_seen().why_not(scan(1.1, lost), at(0.0, 0.8), 1.1) != ""


def test_the_same_scan_from_elsewhere_is_a_repetition():
    looker = having_seen()
    assert looker.why_not(scan(1.1), at(0.04), 1.1) == ""
    assert looker.why_not(scan(1.2), at(0.08), 1.2) == (
        "it is the very one that was taken 0.08 m and 0.00 rad from here"
    )
    assert looker.why_not(scan(1.3), at(0.08, 0.1), 1.3).endswith("0.08 m and 0.10 rad from here")
    assert looker.why_not(scan(1.4, WALL + 0.001), at(0.08), 1.4) == ""


def test_a_robot_that_stands_may_see_the_same_for_ever_also_after_its_place_was_corrected():
    looker = having_seen()
    for tick in range(1, 100):
        assert looker.why_not(scan(1.0 + tick), at(0.0), 1.0 + tick) == ""
    for tick in range(100, 110):
        assert looker.why_not(scan(1.0 + tick), at(0.3), 1.0 + tick) == ""


def test_where_nothing_is_seen_everything_looks_the_same():
    nothing = np.full(BEAMS, np.inf)
    looker = having_seen(nothing)
    assert looker.why_not(scan(2.0, nothing), at(0.2), 2.0) == ""


def test_another_number_of_beams_is_no_loss_and_a_restart_forgets():
    looker = having_seen()
    fewer = replace(scan(1.1), ranges_m=WALL[:20])
    assert looker.why_not(fewer, at(0.0), 1.1) == ""
    looker = having_seen()
    looker.restart()
    assert looker.why_not(scan(0.1, np.full(BEAMS, np.inf)), at(0.0), 0.1) == ""
