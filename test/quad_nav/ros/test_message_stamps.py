"""Stamps of messages: whole nanoseconds from a message to tf2, and from the clock to a message."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

rospy = pytest.importorskip("rospy")

from ros.fake_ros import FakePublisher, FakeRos, deliver  # noqa: E402
from test_peer_topics import host, joined, states, wall  # noqa: E402, F401
from test_stopped_clock import scan_stamped, sensor_with  # noqa: E402
from tf2_msgs.msg import TFMessage  # noqa: E402

from quad_nav.costmap.tracks import Tracks  # noqa: E402
from quad_nav.geometry import Pose3D  # noqa: E402
from quad_nav.ros.common import conversions  # noqa: E402
from quad_nav.ros.common.packed_messages import STATES_TOPIC, states_message  # noqa: E402
from quad_nav.ros.common.rospy_repairs import set_time  # noqa: E402
from quad_nav.ros.common.transforms import Transforms  # noqa: E402
from quad_nav.ros.navigator.obstacle_topics import ObstacleTopics  # noqa: E402
from quad_nav.ros.sequencer.odometry import OdometryIntake  # noqa: E402
from quad_nav.topics.publishing import in_fleet  # noqa: E402

LIDAR = Pose3D(1.0, 2.0, 0.3)
MANY = np.random.default_rng(0).integers(10**9, 10**14, 200).tolist()  # up to 28 hours
SINCE_1970 = [1_800_000_000_123_456_789, 1_800_000_000_999_999_999]
STAMPS_NS = [11_199_999_999, 11_200_000_000, 11_200_000_001, 3_599_999_999_999, *MANY, *SINCE_1970]


@pytest.fixture
def ros():
    with FakeRos("/move_base0") as fake:
        yield fake


def time_of(stamp_ns):
    return rospy.Time(*divmod(stamp_ns, 10**9))


def at(ros, stamp_ns):
    """Let the clock be there."""
    rospy.rostime._set_rostime(time_of(stamp_ns))


def transform(stamp_ns, parent="map", child="Lidar0", pose=LIDAR):
    return conversions.transform_message(pose, parent, child, time_of(stamp_ns))


def scan(stamp_ns):
    message = scan_stamped(1.0)
    message.header.stamp = time_of(stamp_ns)
    return message


def received(sensor):
    """Return the stamps of the scans that reached the costmap."""
    return [one.stamp_s for sink in sensor.intake.sinks for one in _observations(sink)]


def _observations(sink):
    return sink.layer.buffers[sink.source.name].observations


def test_no_scan_is_dropped_whatever_its_stamp(ros):
    """Each has its transform and that of the scan before."""
    transforms, sensor = Transforms(), sensor_with()
    for stamp_ns in sorted(STAMPS_NS):
        at(ros, stamp_ns)
        deliver("/tf", TFMessage([transform(stamp_ns)]))
        deliver("/scan0", scan(stamp_ns))
        sensor.deliver(transforms)
        assert received(sensor) == [time_of(stamp_ns).to_sec()]
    assert not ros.log.lines


@pytest.mark.parametrize("stamp_ns", STAMPS_NS[:4])
def test_a_scan_a_nanosecond_ahead_of_tf_waits_for_it(ros, stamp_ns):
    transforms, sensor = Transforms(), sensor_with()
    at(ros, stamp_ns)
    deliver("/tf", TFMessage([transform(stamp_ns - 10**8), transform(stamp_ns - 1)]))
    deliver("/scan0", scan(stamp_ns))
    sensor.deliver(transforms)
    assert received(sensor) == []
    deliver("/tf", TFMessage([transform(stamp_ns)]))
    sensor.deliver(transforms)
    assert len(received(sensor)) == 1 and not ros.log.lines


def moved_since(stamp_ns, frame):
    """``map`` to a frame: at 10 m at the stamp, which is the first, and at 20 m later."""
    return TFMessage(
        [
            transform(stamp_ns + later_ns, "map", frame, Pose3D(x_m, 0.0, 0.0))
            for later_ns, x_m in ((0, 10.0), (10**9 // 2, 20.0))
        ]
    )


def odometry(stamp_ns, frame="odom2"):
    return conversions.odometry_message(
        Pose3D(0.5, 0.0, 1.0), (0, 0, 0), (0, 0, 0), (frame, "base_link2"), time_of(stamp_ns)
    )


@pytest.mark.parametrize("stamp_ns", STAMPS_NS[:4] + SINCE_1970)
def test_a_peer_is_where_its_frame_was_at_its_stamp(ros, wall, stamp_ns):  # noqa: F811
    at(ros, stamp_ns)
    peers = host()
    wall.now_s += 1.0
    joined(peers._topics._own)
    deliver("/tf", moved_since(stamp_ns, "odom2"))
    deliver("/odom2", odometry(stamp_ns))
    peers.refresh(rospy.get_time())
    (peer,) = peers.near(0, None, 0.0)
    assert (peer.name, peer.x_m) == ("quad2", 10.5)


@pytest.mark.parametrize("stamp_ns", STAMPS_NS[:4] + SINCE_1970)
def test_states_are_where_their_frame_was_at_their_stamp(ros, stamp_ns):
    at(ros, stamp_ns)
    peers = host(frame="odom0")
    deliver("/tf", moved_since(stamp_ns, "odom0"))
    deliver(STATES_TOPIC, states_message(states([2])))
    peers.refresh(rospy.get_time())
    (peer,) = peers.near(0, None, 0.0)
    assert peer.x_m == pytest.approx(2.0 - 10.0)


@pytest.mark.parametrize("stamp_ns", STAMPS_NS[:4] + SINCE_1970)
def test_the_sequencer_finds_a_robot_where_its_frame_was_at_the_stamp(ros, stamp_ns):
    at(ros, stamp_ns)
    transforms = Transforms()
    intake = OdometryIntake("quad2", "/odom2", lambda: transforms)
    intake.begin(time_of(stamp_ns).to_sec())
    deliver("/tf", moved_since(stamp_ns, "odom2"))
    track = intake.take((), [odometry(stamp_ns)], time_of(stamp_ns).to_sec())
    assert track.poses[:, 0].tolist() == [10.5]


@pytest.mark.parametrize("stamp_ns", STAMPS_NS[:4])
def test_tracked_obstacles_have_the_stamp_of_their_scan(ros, stamp_ns):
    stamp_s = time_of(stamp_ns).to_sec()
    states, one = np.array([[1.0, 0.0, 1.0, 0.0]]), np.array([1])
    tracks = Tracks(stamp_s, one, states, np.eye(4)[np.newaxis], np.array([0.3]), np.zeros(1))
    filters = SimpleNamespace(tracks=lambda now_s: tracks)
    topics = ObstacleTopics(filters, "map", in_fleet(0))
    topics.publish(stamp_s)
    (message,) = [
        one.last for name, one in FakePublisher.all.items() if name.endswith("obstacle_tracks")
    ]
    assert message.header.stamp == time_of(stamp_ns)
    assert [(one.number, one.x, one.vx, one.radius) for one in message.obstacles] == [
        (1, 1.0, 1.0, 0.3)
    ]


@pytest.mark.parametrize("stamp_ns", STAMPS_NS[:4])
def test_a_node_that_sets_its_own_clock_has_the_nanoseconds_of_its_messages(ros, stamp_ns):
    set_time(conversions.time_message(time_of(stamp_ns).to_sec()))
    assert rospy.Time.now() == time_of(stamp_ns)


def test_no_node_cuts_a_time_off():
    """``rospy.Time.from_sec`` does, by up to a nanosecond; ``time_message`` rounds."""
    sources = Path(__file__).resolve().parents[3] / "src"
    cut = [path.name for path in sources.rglob("*.py") if "Time.from_sec" in path.read_text()]
    assert cut == []
