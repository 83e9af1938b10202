"""States and intentions of peers: in one message for many robots, or else from their own topics."""

from __future__ import annotations

import io
import math

import numpy as np
import pytest

rospy = pytest.importorskip("rospy")

from ros.fake_ros import FakePublisher, FakeRos, FakeWall, deliver, subscribed  # noqa: E402
from tf2_msgs.msg import TFMessage  # noqa: E402

from quad_nav.geometry import Pose2D, Pose3D, quaternion_from_yaw  # noqa: E402
from quad_nav.peers.peer import Intention, idle_priority, priority_of  # noqa: E402
from quad_nav.ros.common import conversions, state_topics  # noqa: E402
from quad_nav.ros.common.packed_messages import (  # noqa: E402
    STATES_TOPIC,
    States,
    StatesReader,
    pose_row,
    states_message,
)
from quad_nav.ros.common.transforms import Transforms  # noqa: E402
from quad_nav.ros.navigator.intention_topics import (  # noqa: E402
    INTENTIONS_TOPIC,
    host_publisher,
    intentions_from_message,
    intentions_message,
)
from quad_nav.ros.navigator.peer_topics import PeerTopics  # noqa: E402
from quad_nav.topics.publishing import in_fleet, own_node  # noqa: E402

ROBOTS = 4
NO_PATH = Intention(idle_priority(2))
PATH = Intention(priority_of(12.5, 3), np.array([[1.0, 2.0], [1.5, 2.25], [2.0, 2.5]]))


@pytest.fixture
def ros():
    with FakeRos("/fleet0") as fake:
        yield fake


@pytest.fixture
def wall(monkeypatch):
    """Wall time of the choice between topics; its worker threads are joined at each check."""
    wall = FakeWall()
    monkeypatch.setattr(state_topics, "time", wall)
    return wall


def joined(topics):
    topics.check()
    worker = getattr(topics, "_own", topics)._worker
    if worker.ident is not None:
        worker.join()


def host(own=(0, 1), frame="map"):
    return PeerTopics({k: in_fleet(k) for k in own}, ROBOTS, Transforms(), frame)


def states(numbers, x_m=0.0, yaw_rad=0.0, frame="map", v_mps=1.0, stamp_s=None):
    poses = [pose_row(Pose3D(x_m + k, 2.0 * k, 1.0, quaternion_from_yaw(yaw_rad))) for k in numbers]
    twists = np.zeros((len(numbers), 6))
    twists[:, 0] = v_mps
    stamp_s = rospy.get_time() if stamp_s is None else stamp_s
    return States(stamp_s, frame, np.array(numbers), np.array(poses).reshape(-1, 7), twists)


def odometry(k, x_m):
    stamp = rospy.Time.from_sec(rospy.get_time())
    frames = (f"odom{k}", f"base_link{k}")
    message = conversions.odometry_message(
        Pose3D(x_m, 0.0, 1.0), (0.5, 0.0, 0.0), (0.0, 0.0, 0.0), frames, stamp
    )
    tf = conversions.transform_message(Pose3D(10.0, 0.0, 0.0), "map", frames[0], stamp)
    deliver("/tf", TFMessage([tf]))
    return message


def odometry_topics():
    return sorted(name for name in subscribed() if name.startswith("/odom"))


def last_on(topic):
    return FakePublisher.all[topic].last


def test_states_of_all_robots_in_one_message(ros):
    peers = host()
    deliver(STATES_TOPIC, states_message(states(range(ROBOTS), yaw_rad=math.pi / 2)))
    peers.refresh(1.0)
    assert odometry_topics() == []
    found = peers.near(0, None, 0.0)
    assert [peer.name for peer in found] == ["quad1", "quad2", "quad3"]
    assert [(peer.x_m, peer.y_m) for peer in found] == [(1.0, 2.0), (2.0, 4.0), (3.0, 6.0)]
    for peer in found:
        assert (peer.vx_mps, peer.vy_mps) == pytest.approx((0.0, 1.0))
        assert peer.stamp_s == 1.0
    near = peers.near(0, Pose2D(0.0, 0.0), 5.0)
    assert [peer.name for peer in near] == ["quad1", "quad2"]


def test_states_in_another_frame(ros):
    peers = host(frame="odom0")
    map_from_odom = Pose3D(5.0, 1.0, 0.0, quaternion_from_yaw(math.pi / 2))
    stamp = rospy.Time.from_sec(1.0)
    tf = conversions.transform_message(map_from_odom, "map", "odom0", stamp)
    deliver("/tf", TFMessage([tf]))
    deliver(STATES_TOPIC, states_message(states([3])))
    peers.refresh(1.0)
    (peer,) = peers.near(0, None, 0.0)
    assert (peer.x_m, peer.y_m) == pytest.approx((5.0, 2.0))
    assert (peer.vx_mps, peer.vy_mps) == pytest.approx((0.0, -1.0))


@pytest.mark.parametrize(
    "broken",
    [
        lambda s: s.poses.__setitem__((1, 0), np.nan),
        lambda s: s.poses.__setitem__((1, slice(3, 7)), 0.0),
        lambda s: s.twists.__setitem__((1, 1), 1e300),
    ],
)
def test_an_invalid_state_leaves_the_others(ros, broken):
    peers, message = host(), states([1, 2, 3])
    broken(message)
    deliver(STATES_TOPIC, states_message(message))
    peers.refresh(1.0)
    assert [peer.name for peer in peers.near(0, None, 0.0)] == ["quad1", "quad3"]
    assert any("/quad/states: state dropped: quad2: " in line for line in ros.log.lines)


def test_messages_that_are_dropped(ros):
    peers = host()
    for message in (
        states([2], stamp_s=9.0),
        states([2], frame=""),
        states([2], frame="nowhere"),
        states([ROBOTS, 999]),
        states([]),
    ):
        deliver(STATES_TOPIC, states_message(message))
        peers.refresh(1.0)
        assert peers.near(0, None, 0.0) == []
    deliver(STATES_TOPIC, states_message(states([2])), "/fleet0")  # of this node
    peers.refresh(1.0)
    assert peers.near(0, None, 0.0) == []


def test_the_newest_message_of_each_node_counts(ros):
    peers = host()
    assert peers.near(0, None, 0.0) == []
    for x_m, robots, sender in ((1.0, [2], "/simulator"), (5.0, [3], "/vehicles"), (4.0, [2], "")):
        deliver(STATES_TOPIC, states_message(states(robots, x_m)), sender or "/simulator")
    assert peers.near(0, None, 0.0) == []  # until the next refresh
    peers.refresh(1.0)
    assert [(p.name, p.x_m) for p in peers.near(0, None, 0.0)] == [("quad2", 6.0), ("quad3", 8.0)]


def test_a_robot_that_no_message_carries_is_heard_from_its_odometry(ros, wall):
    peers = host()
    for step in range(8):
        wall.now_s += 0.1
        ros.set_time(1.0 + 0.1 * step)
        deliver(STATES_TOPIC, states_message(states([0, 1, 3])))
        joined(peers._topics)
    assert odometry_topics() == ["/odom2"]
    deliver("/odom2", odometry(2, 7.0))
    peers.refresh(1.7)
    assert [(p.name, p.x_m) for p in peers.near(0, None, 0.0)] == [
        ("quad1", 1.0),
        ("quad2", 17.0),
        ("quad3", 3.0),
    ]
    # It comes into the messages: its odometry does not count any more, and is left after a while.
    for step in range(25):
        wall.now_s += 0.1
        ros.set_time(2.0 + 0.1 * step)
        deliver(STATES_TOPIC, states_message(states([0, 1, 2, 3])))
        joined(peers._topics)
        if odometry_topics():
            deliver("/odom2", odometry(2, 99.0))
        peers.refresh(2.0)
        assert [p.x_m for p in peers.near(0, None, 0.0)] == [1.0, 2.0, 3.0]
    assert odometry_topics() == []


def test_a_standing_clock_is_no_missing_robot(ros, wall):
    peers = host()
    deliver(STATES_TOPIC, states_message(states(range(ROBOTS))))
    peers.refresh(1.0)
    assert len(peers.near(0, None, 0.0)) == 3
    wall.now_s += 60.0
    joined(peers._topics)
    assert odometry_topics() == []
    ros.set_time(2.0)
    wall.now_s += 0.2
    joined(peers._topics)
    assert odometry_topics() == [f"/odom{k}" for k in range(ROBOTS)]


def test_own_robots_that_come_from_odometry_are_published_in_one_message(ros, wall, monkeypatch):
    monkeypatch.setattr(FakePublisher, "get_num_connections", lambda _: 2)
    peers = host()
    wall.now_s += 1.0
    joined(peers._topics)
    for k in range(ROBOTS):
        deliver(f"/odom{k}", odometry(k, 0.25 * k))
    peers.refresh(1.0)
    sent = StatesReader().read(last_on(STATES_TOPIC))
    assert (sent.stamp_s, sent.frame, sent.robots.tolist()) == (1.0, "map", [0, 1])
    assert sent.poses[:, 0].tolist() == [10.0, 10.25]
    assert sent.twists[:, 0].tolist() == [0.5, 0.5]
    assert [peer.x_m for peer in peers.near(0, None, 0.0)] == [10.25, 10.5, 10.75]


def test_peers_that_nobody_has_counted_are_those_that_publish(ros, wall, monkeypatch):
    published = ["/odom2", "/rosout"]
    topics = lambda: [(name, "nav_msgs/Odometry") for name in published]  # noqa: E731
    monkeypatch.setattr(rospy, "get_published_topics", topics)
    peers = PeerTopics({1: own_node}, 0, Transforms(), "map")
    for published[1:], heard in (
        ([], ["/odom2"]),
        (["/odom", "/odom3"], ["/odom", "/odom2", "/odom3"]),
    ):
        wall.now_s += 1.0
        joined(peers._topics)
        assert odometry_topics() == heard
    deliver(STATES_TOPIC, states_message(states([0, 1])))
    deliver("/odom3", odometry(3, 7.0))
    for _ in range(2):
        peers.refresh(1.0)
    assert [peer.name for peer in peers.near(1, None, 0.0)] == ["quad0", "quad3"]
    assert ros.log.lines == [
        "quad1: found quad0, avoiding it",
        "quad1: found quad3, avoiding it",
    ]


def test_a_single_robot_hears_no_peers(ros):
    PeerTopics({0: own_node}, 1, Transforms(), "map")
    assert not {STATES_TOPIC, INTENTIONS_TOPIC} & set(subscribed())


def test_frames_of_other_robots_are_received_when_they_are_looked_up(ros):
    transforms = Transforms(others=(2, 3))
    chains = [
        conversions.transform_message(Pose3D(x_m, 0.0, 0.0), parent, child, rospy.Time(1))
        for k in (1, 2, 3)
        for parent, child, x_m in (
            ("map", f"odom{k}", 10.0 * k),
            (f"odom{k}", f"base_link{k}", 1.0),
            (f"base_link{k}", f"camera{k}", 0.1),
        )
    ]
    deliver("/tf", TFMessage(chains))
    buffer = transforms._buffer
    assert transforms.lookup("map", "base_link1").x_m == 11.0
    assert transforms.lookup("base_link2", "camera2").x_m == 0.1  # which looks up robot 2
    assert transforms.lookup("map", "camera2").x_m == pytest.approx(21.1)
    assert "base_link3" in buffer.all_frames_as_string()  # as the parent of another frame
    assert "odom3" not in buffer.all_frames_as_string()
    assert transforms.lookup("map", "/base_link3").x_m == 31.0


# -- intentions ----------------------------------------------------------------------------


def test_intentions_in_one_message():
    message = intentions_message({2: NO_PATH, 3: PATH}, "map", 5.0)
    buff = io.BytesIO()
    message.serialize(buff)
    received = intentions_from_message(type(message)().deserialize(buff.getvalue()), range(5))
    assert list(received) == [2, 3]
    for robot, sent in ((2, NO_PATH), (3, PATH)):
        assert received[robot].priority == sent.priority
        assert np.array_equal(received[robot].path, sent.path)
    assert list(intentions_from_message(message, {3})) == [3]
    assert intentions_from_message(intentions_message({}, "map", 5.0), range(5)) == {}


def test_intentions_that_are_not_valid(ros):
    sent = {
        1: Intention(priority_of(1.0, 1), np.array([[1.0, np.nan], [2.0, 0.0]])),
        2: Intention(np.nan, PATH.path),
        3: Intention(1.0, PATH.path),
        4: PATH,
    }
    received = intentions_from_message(intentions_message(sent, "map", 5.0), range(5))
    for robot in (1, 2, 3):
        assert received[robot].priority == idle_priority(robot)
        assert len(received[robot].path) == 0
    assert received[4].priority == PATH.priority
    for change in ({"width": 2}, {"point_step": 20}, {"is_bigendian": True}, {"fields": []}):
        message = intentions_message({3: PATH}, "map", 5.0)
        for name, value in change.items():
            setattr(message, name, value)
        with pytest.raises(ValueError):
            intentions_from_message(message, range(5))


def test_intentions_come_from_hosts_or_from_the_robots_own_topics(ros, wall):
    peers = host()
    listener = peers._intentions
    wall.now_s += 1.0
    deliver(STATES_TOPIC, states_message(states(range(ROBOTS), v_mps=0.0)))
    deliver(INTENTIONS_TOPIC, intentions_message({3: PATH, 0: PATH}, "map", 1.0))
    joined(listener._own_topics)
    assert sorted(n for n in subscribed() if n.endswith("/intention")) == ["/move_base2/intention"]
    peers.publish(1, NO_PATH, 1.0)
    peers.refresh(1.0)
    one, two, three = peers.near(0, None, 0.0)
    assert np.array_equal(three.intention.path, PATH.path)
    assert three.intention.priority == PATH.priority
    assert one.intention is NO_PATH
    assert two.is_parked  # it has said nothing and stands
    peers.refresh(3.5)
    assert peers.near(0, None, 0.0)[2].intention.priority == idle_priority(3)


def test_intentions_of_a_host_are_published_together_when_one_changes(ros):
    publisher = host_publisher("map", 0)
    topic = FakePublisher.all[INTENTIONS_TOPIC]
    intentions, times = {2: NO_PATH, 3: PATH}, []
    for step in range(12):
        if step == 7:
            intentions[2] = Intention(NO_PATH.priority, PATH.path)
        topic.last = None
        publisher.publish(intentions, 1.0 + 0.1 * step)
        if topic.last is not None:
            times.append(step)
            assert list(intentions_from_message(topic.last, range(5))) == [2, 3]
    assert times == [0, 3, 6, 7, 10]
    alone = host_publisher("map", 1)
    topic = FakePublisher.all[INTENTIONS_TOPIC]
    alone.publish({2: PATH}, 9.0)
    assert topic.last is None


def test_another_navigator_of_the_same_robot_is_named(ros):
    peers = host(own=(0,))
    message = intentions_message({0: PATH, 2: PATH}, "map", rospy.get_time())
    deliver(INTENTIONS_TOPIC, message, "/fleet0")  # its own
    assert ros.log.lines == []
    deliver(INTENTIONS_TOPIC, message, "/planner")
    (line,) = ros.log.lines
    assert line.startswith("quad0: /planner flies quad0 too, and neither avoids the other")
    deliver(STATES_TOPIC, states_message(states([0, 2])))
    peers.refresh(1.0)
    (peer,) = peers.near(0, None, 0.0)
    assert len(peer.intention.path) == 3
