"""One robot's navigator and its topics: it starts with the first pose."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

rospy = pytest.importorskip("rospy")

from geometry_msgs.msg import Point32, Polygon  # noqa: E402
from nav_msgs.msg import Odometry  # noqa: E402
from ros.fake_ros import FakePublisher, FakeRos, deliver  # noqa: E402
from tf2_msgs.msg import TFMessage  # noqa: E402

from quad_nav import config  # noqa: E402
from quad_nav.geometry import Pose3D, Twist2D  # noqa: E402
from quad_nav.ros.common import conversions  # noqa: E402
from quad_nav.ros.navigator.nodes import Fleet  # noqa: E402
from quad_nav.topics.publishing import own_node  # noqa: E402

ROOT = Path(__file__).resolve().parents[3]
NOT_UPDATED = [
    "quad0: global costmap not updated: robot pose unknown",
    "quad0: local costmap not updated: robot pose unknown",
]


@pytest.fixture
def ros():
    with FakeRos("/move_base0") as fake:
        yield fake


@pytest.fixture
def robot(ros):
    tree = config.load_files(ROOT / "config" / "default", {"i": "0"})
    tree.update(robot=0, robots=1)
    return Fleet({0: config.load(tree)}, lambda _: own_node).robots[0]


def step(ros, robot, now_s):
    ros.set_time(now_s)
    robot.step(now_s)


def transform(parent, child, now_s):
    stamp = rospy.Time.from_sec(now_s)
    return conversions.transform_message(Pose3D(2.0, 2.0, 1.0), parent, child, stamp)


def test_it_waits_for_its_first_pose(ros, robot):
    step(ros, robot, 1.0)
    step(ros, robot, 1.4)
    map_from_odom = transform("map", "odom0", 1.4)
    odom_from_base = transform("odom0", "base_link0", 1.4)
    deliver("/tf", TFMessage([map_from_odom, odom_from_base]))
    step(ros, robot, 1.45)
    window = robot.navigator.local_costmap.spec  # 3 m wide, around (4, 4)
    assert (window.origin_x_m, window.origin_y_m) == pytest.approx((2.5, 2.5))
    assert ros.log.lines == []


def test_it_does_not_wait_longer_than_half_a_second(ros, robot):
    step(ros, robot, 1.0)
    step(ros, robot, 1.5)
    assert ros.log.lines == NOT_UPDATED


def test_it_does_not_wait_after_a_clock_jump(ros, robot):
    step(ros, robot, 1.0)
    robot.restart(0.8)
    step(ros, robot, 0.8)
    assert ros.log.lines == NOT_UPDATED


def test_it_stops_without_odometry_that_has_never_come_or_not_since_a_clock_jump(ros, robot):
    """It has poses from tf, but no velocity: as with odometry that was lost."""

    def located(now_s):
        ros.set_time(now_s)
        pair = [transform("map", "odom0", now_s), transform("odom0", "base_link0", now_s)]
        deliver("/tf", TFMessage(pair))
        robot.step(now_s)
        return robot._located_now()

    assert located(1.0).in_global is not None
    assert located(1.5).in_global is not None
    assert located(1.6).unknown_reason == "no message on /odom for 0.6 s"
    robot.restart(0.8)
    assert located(0.8).in_global is not None
    assert located(1.4).unknown_reason == "no message on /odom for 0.6 s"


def test_dwa_planner_can_hear_odometry_of_another_name(ros):
    tree = config.load_files(ROOT / "config" / "default", {"i": "0"})
    tree.update(robot=0, robots=1, base_local_planner="dwa_local_planner/DWAPlannerROS")
    tree["DWAPlannerROS"] = {"odom_topic": "odometry/filtered"}
    robot = Fleet({0: config.load(tree)}, lambda _: own_node).robots[0]
    message = Odometry()
    message.header.frame_id, message.pose.pose.orientation.w = "odom0", 1.0
    message.twist.twist.linear.x = 0.25
    deliver("/odometry/filtered", message)
    assert robot._velocity == Twist2D(0.25)


ARM = [(0.5, 0.25), (-0.25, 0.25), (-0.25, -0.25), (0.5, -0.25)]


def local_footprint():
    return rospy.resolve_name("~local_costmap/footprint")


def polygon(points):
    return Polygon([Point32(x, y, 0.0) for x, y in points])


def test_a_footprint_from_its_topic_decides_costs_and_commands(ros, robot):
    """Padding, a float32 of 0.01 m, is added; each costmap has a topic of its own."""
    radius_m = robot.costmaps[0].inscribed_radius_m
    deliver(local_footprint(), polygon(ARM))
    step(ros, robot, 1.0)
    local = robot.navigator.local_costmap
    assert local.inscribed_radius_m == pytest.approx(0.26)
    assert local.layers["inflation_layer"]._inscribed_radius_m == local.inscribed_radius_m
    assert robot.navigator.controller.footprint[0] == pytest.approx((0.51, 0.26))
    assert robot.costmaps[0].inscribed_radius_m == radius_m
    tree = config.updated(robot.configuration, "local_costmap", {"footprint_padding": 0.0})
    robot.reconfigure(tree)
    assert local.inscribed_radius_m == 0.25  # another parameter leaves the outline alone
    robot.reconfigure(config.updated(tree, "local_costmap", {"robot_radius": 0.5}))
    assert local.inscribed_radius_m == pytest.approx(0.4904, abs=1e-4)  # 0.5 cos(pi / 16)


@pytest.mark.parametrize(
    "points, reason",
    [
        (ARM[:2], "2 points, expected 3 to 1000"),
        ([*ARM[:3], (math.nan, 0.0)], "coordinates that are not finite or beyond 100 m"),
        ([*ARM[:3], (101.0, 0.0)], "coordinates that are not finite or beyond 100 m"),
    ],
)
def test_a_footprint_that_is_none_is_dropped(ros, robot, points, reason):
    before = robot.navigator.local_costmap.footprint
    deliver(local_footprint(), polygon(points))
    step(ros, robot, 1.0)
    assert robot.navigator.local_costmap.footprint is before
    assert ros.log.lines == [f"quad0: {local_footprint()}: footprint dropped: {reason}"]


def test_topics_of_footprints_can_have_other_names(ros):
    """Upstream looks for them upwards, to the node's level."""
    tree = config.load_files(ROOT / "config" / "default", {"i": "0"})
    tree.update(robot=0, robots=1, footprint_topic="/arm/outline")
    tree["global_costmap"]["published_footprint_topic"] = "placed"
    robot = Fleet({0: config.load(tree)}, lambda _: own_node).robots[0]
    deliver("/arm/outline", polygon(ARM))
    step(ros, robot, 1.0)
    assert {round(costmap.inscribed_radius_m, 6) for costmap in robot.costmaps} == {0.26}
    placed = rospy.resolve_name("~global_costmap/placed")
    assert {placed, local_footprint()} <= set(FakePublisher.all)
