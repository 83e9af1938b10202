"""Recordings of robots that find their places hold where they believe themselves, and are."""

from __future__ import annotations

import numpy as np
import pytest
from recorded_flight import flown, setup

from quad_nav.geometry import Pose2D
from quad_nav.mission.localization_errors import error_figures, error_note, pose_errors
from quad_nav.recording.bag_file import read_messages
from quad_nav.recording.bag_trace import read_trace
from quad_nav.recording.recorder import Recorder
from quad_nav.sim.localization import Localization

COVARIANCE = np.diag([0.01, 0.04, 0.09])


class Shifted(Localization):
    """Believes every robot to be 0.03 m east and 0.04 m north of where it is."""

    name = "amcl"

    def __init__(self, _scene=None, _robots=0):
        self.seen = set()

    def add_scan(self, robot, scan, odom_from_base, odom_from_lidar):
        self.seen.add(robot)

    def map_from_odom(self, robot):
        return Pose2D(0.03, 0.04)

    def is_lost(self, robot):
        return False

    def estimate(self, robot):
        return (Pose2D(1.0, 2.0, 0.5), COVARIANCE) if robot in self.seen else None


@pytest.fixture(scope="module")
def traces(tmp_path_factory):
    folder = tmp_path_factory.mktemp("flight")
    path = folder / "flight.bag"
    trace = flown(setup(folder, localization=Shifted), [Recorder(path)]).trace
    return trace, read_trace(path), path


def test_a_recording_tells_what_the_robots_believed_and_where_they_were(traces):
    seen, read, _ = traces
    for trace in (seen, read):
        for robot in trace.robots:
            assert robot.is_localized
            assert robot.errors[:, 0] == pytest.approx(0.05)
            assert robot.errors[:, 1] == pytest.approx(0.0, abs=1e-9)
            assert (robot.covariances[1:] == COVARIANCE).all()
    for one, other in zip(seen.robots, read.robots):
        assert np.array_equal(other.positions_m, one.positions_m)
        assert np.array_equal(other.quaternions, one.quaternions)
        assert other.believed == pytest.approx(one.believed)


def test_estimates_are_those_of_the_scans(traces):
    found = list(read_messages(traces[2], lambda topic, _: topic == "/amcl_pose1"))
    scans = list(read_messages(traces[2], lambda topic, _: topic == "/scan1"))
    assert [one.stamp_ns for one in found] == [one.stamp_ns for one in scans]
    assert found[0].content.header.frame_id == "map"
    pose = found[0].content.pose
    assert (pose.pose.position.x, pose.pose.position.y) == (1.0, 2.0)
    assert pose.covariance[[0, 7, 35]].tolist() == [0.01, 0.04, 0.09]


def test_a_flight_of_robots_that_know_their_places_has_no_such_topics(tmp_path):
    path = tmp_path / "flight.bag"
    trace = flown(setup(tmp_path), [Recorder(path)]).trace
    assert not trace.robots[0].is_localized
    read = read_trace(path).robots[0]
    assert (read.is_localized, read.errors.shape) == (False, (0, 2))
    assert not list(read_messages(path, lambda topic, _: topic in ("/quad/truth", "/amcl_pose0")))


def test_figures_by_hand():
    """Offsets of 3, 4 and 5 mm, 20 times; turns across half a turn, the short way."""
    true = np.zeros((60, 3))
    believed = np.repeat([(0.003, 0.0, 0.1), (0.0, 0.004, -0.2), (0.003, 0.004, 0.3)], 20, axis=0)
    errors = pose_errors(believed, true)
    figures = error_figures([errors[:30], errors[30:]])
    assert figures == {
        "position_error_m": {"median": 0.004, "p95": 0.005},
        "yaw_error_rad": {"median": 0.2, "p95": 0.3},
    }
    assert "0.004 m and 0.200 rad from the truth" in error_note(figures)
    turned = pose_errors(np.array([(0.0, 0.0, 3.1)]), np.array([(0.0, 0.0, -3.1)]))
    assert turned[0, 1] == pytest.approx(2.0 * np.pi - 6.2)
