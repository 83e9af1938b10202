"""The node that passes the goals and poses of RViz on to one quadcopter of a fleet."""

from __future__ import annotations

import pytest

rospy = pytest.importorskip("rospy")

from geometry_msgs.msg import (  # noqa: E402
    PointStamped,
    PoseStamped,
    PoseWithCovariance,
    PoseWithCovarianceStamped,
)
from ros.fake_ros import FakePublisher, FakeRos, deliver  # noqa: E402
from std_msgs.msg import Header  # noqa: E402

from quad_nav.geometry import Pose3D  # noqa: E402
from quad_nav.ros.common import rviz_nodes  # noqa: E402
from quad_nav.ros.common.conversions import pose_message  # noqa: E402
from quad_nav.ros.common.transforms import TransformUnavailable  # noqa: E402

PLACES = {"map": Pose3D(0, 0, 0), "base_link0": Pose3D(0, 0, 1), "base_link1": Pose3D(4, 0, 1)}


class FakeTransforms:
    def lookup(self, _to, frame):
        if frame not in PLACES:
            raise TransformUnavailable(f"no {frame}")
        return PLACES[frame]

    def close(self):
        pass


@pytest.fixture
def ros(monkeypatch):
    monkeypatch.setattr(rviz_nodes, "Transforms", FakeTransforms)
    monkeypatch.setattr(rviz_nodes, "PATIENCE_S", 0.05)
    with FakeRos("/goal_router") as fake:
        yield fake


def last_on(topic):
    return FakePublisher.all[topic].last


def pose_at(x_m):
    pose = PoseWithCovariance(pose_message(Pose3D(x_m, 0, 0)), [0.25] + [0.0] * 35)
    return PoseWithCovarianceStamped(Header(frame_id="map"), pose)


def click(x_m):
    message = PointStamped(Header(frame_id="map"), None)
    message.point.x = x_m
    deliver("/clicked_point", message)


def test_a_pose_goes_to_the_nearest_or_to_the_selected_one_as_it_is(ros):
    rviz_nodes.GoalRouterNode(2)
    deliver("/initialpose", pose_at(3.0))
    found = last_on("/initialpose1")
    assert (found.pose.pose.position.x, found.pose.covariance[0]) == (3.0, 0.25)
    click(0.2)
    deliver("/initialpose", pose_at(3.5))
    assert last_on("/initialpose0").pose.pose.position.x == 3.5
    assert last_on("/initialpose1").pose.pose.position.x == 3.0
    deliver("/move_base_simple/goal", PoseStamped(Header(frame_id="map"), pose_at(4.0).pose.pose))
    assert last_on("/move_base_simple/goal0").pose.position.x == 4.0
    assert any("quad0: pose (3.50, 0.00) m: selected" in line for line in ros.log.lines)


def test_a_pose_goes_to_the_one_that_does_not_know_its_place(ros):
    rviz_nodes.GoalRouterNode(3)
    deliver("/initialpose", pose_at(0.1))
    assert last_on("/initialpose2").pose.pose.position.x == 0.1
    rviz_nodes.GoalRouterNode(4)
    deliver("/initialpose", pose_at(0.2))
    assert any("pose dropped: several quadcopters have no" in line for line in ros.log.lines)
    deliver("/initialpose", pose_at(float("nan")))
    assert any("pose dropped: position (nan, 0) m" in line for line in ros.log.lines)
