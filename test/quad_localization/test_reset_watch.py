"""Resets that a localization hears of, on a clock that comes late or jumps back."""

from __future__ import annotations

import pytest

rospy = pytest.importorskip("rospy")

from ros.fake_ros import FakeRos, deliver  # noqa: E402
from std_msgs.msg import Time  # noqa: E402

from quad_localization.ros.reset_watch import ResetWatch  # noqa: E402
from quad_nav.topics.flight_info import RESET_TOPIC  # noqa: E402


@pytest.fixture
def watch():
    with FakeRos("/amcl0") as ros:
        ros.set_time(10.0)
        watch = ResetWatch()
        watch.begin(10.0)
        yield watch


def hears(reset_s):
    deliver(RESET_TOPIC, Time(rospy.Time.from_sec(reset_s)))


def test_a_reset_counts_once_and_again_for_scans_from_before(watch):
    assert not watch.pop(11.0)
    hears(12.0)
    assert watch.pop(12.0)
    assert not watch.pop(12.1)
    watch.begin(11.9)  # its message has come after that of the reset
    assert watch.pop(12.2)
    assert not watch.pop(12.3)


def test_a_reset_of_before_the_first_scan_does_not_count(watch):
    hears(9.0)
    assert not watch.pop(11.0)


def test_a_reset_waits_for_a_clock_that_comes_late(watch):
    hears(14.0)
    assert not watch.pop(11.0)
    assert watch.pop(13.5)
    assert not watch.pop(14.5)


def test_a_reset_of_a_clock_that_has_jumped_back_does_not_count(watch):
    hears(14.0)
    assert not watch.pop(11.0)
    watch.begin(1.0)
    assert not watch.pop(1.0)
    assert not watch.pop(15.0)
