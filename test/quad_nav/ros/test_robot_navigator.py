"""One robot's navigator and its topics: it starts with the first pose."""

from __future__ import annotations

from pathlib import Path

import pytest

rospy = pytest.importorskip("rospy")

from ros.fake_ros import FakeRos, deliver  # noqa: E402
from tf2_msgs.msg import TFMessage  # noqa: E402

from quad_nav import config  # noqa: E402
from quad_nav.geometry import Pose3D  # noqa: E402
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
