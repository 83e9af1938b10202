"""Map topics of static layers."""

from __future__ import annotations

import math
import threading

import pytest

rospy = pytest.importorskip("rospy")

from nav_msgs.msg import OccupancyGrid  # noqa: E402
from ros.fake_ros import FakeRos  # noqa: E402

from quad_nav.costmap.layered import CostmapParams, LayeredCostmap  # noqa: E402
from quad_nav.costmap.static import StaticLayerParams  # noqa: E402
from quad_nav.geometry import Pose2D  # noqa: E402
from quad_nav.ros.navigator import static_maps  # noqa: E402
from quad_nav.topics.publishing import own_node  # noqa: E402


@pytest.mark.parametrize("yaw_rad, is_told", [(0.0, False), (0.3, True)])
def test_a_rotated_origin_is_ignored_and_told(monkeypatch, yaw_rad, is_told):
    told = []
    monkeypatch.setattr(rospy, "logwarn", lambda _, text: told.append(text))
    costmap = LayeredCostmap(CostmapParams(layers=(("static", StaticLayerParams()),)))
    message = OccupancyGrid(data=[100, 0])
    message.header.frame_id = "map"
    message.info.width, message.info.height, message.info.resolution = 2, 1, 0.5
    orientation = message.info.origin.orientation
    orientation.z, orientation.w = math.sin(yaw_rad / 2), math.cos(yaw_rad / 2)
    with FakeRos("/move_base0"):
        (listener,) = static_maps.connect([costmap], threading.RLock(), own_node)
        listener._on_map(message)
    costmap.update(0.0, Pose2D(0.0, 0.0))
    assert costmap.costs.tolist() == [[254, 0]]
    assert ["origin is rotated" in line for line in told] == [True] * is_told
