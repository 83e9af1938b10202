"""Faults of amcl: the robot has no place, a message is refused, or an argument."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

rospy = pytest.importorskip("rospy")
pytest.importorskip("quad.msg", reason="needs `make workspace`")

from geometry_msgs.msg import PoseWithCovarianceStamped  # noqa: E402
from ros.fake_ros import FakeRos, deliver  # noqa: E402
from test_slam import Ways  # noqa: E402

from quad_localization.map_files import CELL_M  # noqa: E402
from quad_localization.ros import composed, node  # noqa: E402
from quad_nav.config import load  # noqa: E402
from quad_nav.files.document import read_yaml  # noqa: E402
from quad_nav.files.shipped import shipped  # noqa: E402
from quad_nav.ros.common.conversions import pose_message  # noqa: E402
from quad_nav.ros.common.nav_messages import map_message  # noqa: E402
from quad_nav.ros.composed.transforms import ComposedTransforms  # noqa: E402
from quad_nav.scenario.scene_map import scene_map  # noqa: E402
from quad_nav.sim.lidar import base_from_lidar  # noqa: E402
from quad_nav.sim.odometry import OdometryErrors, pose_in  # noqa: E402
from quad_nav.sim.scene_file import load_scene  # noqa: E402

STEP_S, NEAR_M = 0.1, 0.1


class Flight:
    """A robot that is moved through the arena."""

    def __init__(self, ros):
        self.ros, self.now_s, self.scene = ros, 10.0, load_scene(shipped("scenes", "arena.yaml"))
        start = self.scene.starts[0]
        pose = (start.x_m, start.y_m, start.yaw_rad)
        self.ways = Ways(self.scene, [pose], OdometryErrors(per_m=0.05, per_rad=0.05))
        frames = {"odom_frame_id": "odom0", "base_frame_id": "base_link0", "use_map_topic": True}
        begin = {"initial_pose_x": start.x_m, "initial_pose_y": start.y_m, "seed": 1}
        params = read_yaml(shipped("localization", "amcl.yaml"))
        rospy.set_param("/amcl0", {**params, **frames, **begin})
        self.transforms = ComposedTransforms(localizes=False)
        self.amcl = composed.ComposedAmcl(self.transforms, {0: load({})}, [0])

    def send_map(self, origin_m=None):
        drawn = scene_map(self.scene, CELL_M)
        if origin_m is not None:
            drawn = replace(drawn, spec=replace(drawn.spec, origin_x_m=origin_m))
        deliver("/map", map_message(drawn, rospy.Time.from_sec(self.now_s)))

    def fly(self, seconds, has_lidar=True, ranges_m=None):
        for _ in range(round(seconds / STEP_S)):
            self.now_s += STEP_S
            self.ros.set_time(self.now_s)
            if not self.amcl.is_lost(0):  # else it hovers
                self.ways.move(0, 0.0, 0.05, 0.02)
            states = self.ways.states()
            self.transforms.update(self.now_s, states)
            if has_lidar:
                odom_from_base = pose_in(states.frames.map_from_odom(0), states[0].map_from_base)
                scan = replace(self.ways.scan(0), stamp_s=self.now_s)
                scan = scan if ranges_m is None else replace(scan, ranges_m=ranges_m)
                lidar = odom_from_base.compose(base_from_lidar)
                self.amcl.add_scan(0, scan, odom_from_base, lidar)

    def give(self, x_m, frame="map", variance=0.01):
        message = PoseWithCovarianceStamped()
        message.header.frame_id = frame
        message.pose.pose = pose_message(replace(self.ways.true(0), x_m=x_m).to_3d())
        message.pose.covariance = (variance * np.eye(6)).ravel().tolist()
        deliver("/initialpose0", message)

    def assert_right(self):
        assert not self.amcl.is_lost(0)
        found = self.amcl.map_from_odom(0).compose(self.ways.odom(0))
        assert found.distance_to(self.ways.true(0)) < NEAR_M


@pytest.fixture
def flight(monkeypatch):
    monkeypatch.setattr(composed, "publish_health", lambda _: None)
    with FakeRos("/simulator") as ros:
        yield Flight(ros)


def has_logged(flight, text):
    return any(text in line for line in flight.ros.log.lines)


def test_no_map_and_a_map_that_comes_late(flight):
    flight.fly(1.0)
    assert flight.amcl.is_lost(0) and has_logged(flight, "amcl0: no map yet")
    flight.send_map(math.nan)
    assert flight.amcl.is_lost(0) and has_logged(flight, "map dropped: origin (nan")
    flight.send_map()
    flight.fly(1.0)
    flight.assert_right()


def test_a_lidar_that_fails_for_three_seconds(flight):
    flight.send_map()
    flight.fly(2.0)
    flight.assert_right()
    flight.fly(3.0, has_lidar=False)
    assert flight.amcl.is_lost(0)
    flight.fly(1.0)
    flight.assert_right()


@pytest.mark.parametrize(
    "given, line",
    [
        ({"x_m": 5.0, "frame": "odom0"}, "frame 'odom0', expected 'map'"),
        ({"x_m": math.nan}, "position (nan"),
        ({"x_m": 5.0, "variance": math.nan}, "the covariance is not positive semidefinite"),
    ],
)
def test_a_pose_that_is_not_valid(flight, given, line):
    flight.send_map()
    flight.fly(1.0)
    flight.give(**given)
    flight.fly(1.0)
    flight.assert_right()
    assert has_logged(flight, f"initial pose dropped: {line}")


def test_ranges_of_nan_leave_the_place_to_odometry(flight):
    flight.send_map()
    flight.fly(1.0)
    flight.fly(1.0, ranges_m=np.full(512, np.nan, np.float32))
    flight.fly(1.0)
    flight.assert_right()


def test_amcl_refuses_a_bag_and_not_what_roslaunch_adds(monkeypatch, capsys):
    arguments = ["amcl", "--run-from-bag", "flight.bag", "__name:=amcl0", "_seed:=1"]
    monkeypatch.setattr("sys.argv", arguments)
    assert node.main() == 2
    assert "amcl: --run-from-bag flight.bag: expected no argument" in capsys.readouterr().err
