"""What a node waits for, and how it says so."""

from __future__ import annotations

import pytest

pytest.importorskip("rospy")

from ros.fake_ros import FakeRos  # noqa: E402

from quad_nav.ros.common import readiness  # noqa: E402
from quad_nav.ros.common.readiness import Need, wait_for  # noqa: E402


def test_each_missing_need_has_a_line_of_its_own(monkeypatch):
    monkeypatch.setattr(readiness, "WARN_EVERY_S", 0.0)
    names = ("/odom0", "/goal0\x1b[2J")
    needs = [Need(iter([False, True]).__next__, f"{name}: none".__str__) for name in names]
    with FakeRos("/sequencer") as ros:
        assert wait_for(needs, 10.0) == []
    (line,) = ros.log.lines
    assert line.endswith("still waiting after 0 s:\n  /odom0: none\n  /goal0\\x1b[2J: none")
