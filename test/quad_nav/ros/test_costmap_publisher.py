"""Topics of a costmap: which message a subscriber gets, and when."""

from __future__ import annotations

import threading

import pytest

rospy = pytest.importorskip("rospy")

from ros.fake_ros import FakePublisher, FakeRos  # noqa: E402

from quad_nav.costmap.cost_grid import Window  # noqa: E402
from quad_nav.costmap.layered import CostmapParams, LayeredCostmap  # noqa: E402
from quad_nav.costmap.voxel import VoxelLayerParams  # noqa: E402
from quad_nav.geometry import Pose2D  # noqa: E402
from quad_nav.ros.navigator.costmap_publisher import CostmapPublisher  # noqa: E402
from quad_nav.topics.publishing import own_node  # noqa: E402

HERE = Pose2D(1.0, 0.5)
CHANGED = Window(3, 5, 0, 2)


@pytest.fixture
def ros():
    with FakeRos("/move_base0") as fake:
        yield fake


def publisher_of(**params):
    params = {"width_m": 2.0, "height_m": 1.0, "resolution_m": 0.1, "layers": (), **params}
    costmap = LayeredCostmap(CostmapParams(publish_frequency_hz=1.0, **params))
    return CostmapPublisher("local_costmap", costmap, threading.RLock(), own_node)


def sent(name):
    return FakePublisher.all[rospy.resolve_name(f"~local_costmap/{name}")]


@pytest.mark.parametrize(
    "subscribers, on_time, is_full", [(1, True, False), (2, True, True), (2, False, False)]
)
def test_the_full_grid_of_a_new_subscriber_is_no_news_to_it(ros, subscribers, on_time, is_full):
    """As upstream, even if others have not got it; else only if there are no others."""
    publisher, given = publisher_of(publish_on_time=on_time), []
    sent("costmap").get_num_connections = lambda: subscribers
    publisher._send_full(given.append)
    assert len(given[0].data) == 200
    publisher.publish(1.5, HERE, CHANGED)
    assert (sent("costmap").last is not None) is is_full
    if not is_full:
        update = sent("costmap_updates").last
        assert (update.x, update.y, update.width, update.height) == (3, 0, 2, 2)


def test_what_changes_while_nobody_listens_is_in_the_first_update(ros):
    publisher = publisher_of()
    sent("costmap").get_num_connections = lambda: 0
    publisher.publish(1.5, HERE, Window(8, 9, 4, 5))
    sent("costmap").get_num_connections = lambda: 1
    publisher._send_full(lambda message: None)
    publisher.publish(2.5, HERE, CHANGED)
    update = sent("costmap_updates").last
    assert (update.x, update.y, update.width, update.height) == (3, 0, 6, 5)


def test_without_an_update_there_is_no_footprint(ros):
    publisher = publisher_of()
    publisher.publish(1.5, None, None)
    assert sent("footprint").last is None and sent("costmap").last is None
    publisher.publish(2.5, HERE, CHANGED)
    assert len(sent("footprint").last.polygon.points) == 16


def test_voxels_have_the_type_of_costmap_2d(ros):
    """The package is not there on Debian; the checksum is that of its message."""
    layer = VoxelLayerParams(publish_voxel_map=True, z_voxels=3, z_resolution_m=0.5)
    publisher_of(layers=(("voxels", layer),)).publish(1.5, HERE, CHANGED)
    grid = sent("voxels/voxel_grid").last
    assert (grid._type, grid._md5sum) == (
        "costmap_2d/VoxelGrid",
        "48a040827e1322073d78ece5a497029c",
    )
    assert (grid.size_x, grid.size_y, grid.size_z) == (20, 10, 3)
    assert list(grid.data) == 200 * [0xFFFF]
    assert (grid.resolutions.x, grid.resolutions.z) == (0.1, 0.5)
    assert sent("voxels/clearing_endpoints").last is None  # no sensor, no ray
