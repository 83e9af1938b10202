"""Messages that are serialised from arrays are those of rospy's own serialiser."""

from __future__ import annotations

import io

import numpy as np
import pytest

rospy = pytest.importorskip("rospy")

from geometry_msgs.msg import PoseArray, Twist, Vector3  # noqa: E402
from nav_msgs.msg import Odometry, Path  # noqa: E402
from sensor_msgs.msg import MultiDOFJointState  # noqa: E402
from tf2_msgs.msg import TFMessage  # noqa: E402

from quad_nav.geometry import Pose3D, Twist2D  # noqa: E402
from quad_nav.ros.common import conversions  # noqa: E402
from quad_nav.ros.common.nav_messages import pose_stamped  # noqa: E402
from quad_nav.ros.common.packed_messages import (  # noqa: E402
    OdometryWriter,
    PathMessage,
    States,
    StatesMessage,
    StatesReader,
    TransformReader,
    TransformsMessage,
    TransformWriter,
    pose_array_message,
    states_message,
)
from quad_nav.topics.validation import pose_problem, twist_problem, valid_states  # noqa: E402

STAMP = rospy.Time(12, 345_678_901)
ODD = [np.nan, np.inf, -np.inf, 0.0, 1.0, 1e6, 1.1e6, -1e30, 0.95, 1.2]


def serialised(message) -> bytes:
    buff = io.BytesIO()
    message.serialize(buff)
    return buff.getvalue()


def rows(count: int, seed: int = 1):
    draw = np.random.default_rng(seed)
    return draw.normal(size=(count, 7)), draw.normal(size=(count, 6))


def pose(row) -> Pose3D:
    return Pose3D(*row[:3].tolist(), tuple(row[3:].tolist()))


def standard(robots, poses, twists, frame="map") -> MultiDOFJointState:
    message = MultiDOFJointState(joint_names=[f"quad{number}" for number in robots])
    message.header.stamp, message.header.frame_id = STAMP, frame
    message.transforms = [conversions.transform(pose(row)) for row in poses]
    message.twist = [Twist(Vector3(*row[:3]), Vector3(*row[3:])) for row in twists]
    return message


def read(message) -> States:
    return StatesReader().read(StatesMessage().deserialize(serialised(message)))


def test_states_are_those_of_rospy():
    poses, twists = rows(12)
    states = States(STAMP.to_sec(), "map", np.arange(12) * 9, poses, twists)
    message = standard(range(0, 108, 9), poses, twists)
    assert serialised(states_message(states)) == serialised(message)
    back = read(message)
    assert (back.stamp_s, back.frame) == (STAMP.to_sec(), "map")
    assert back.robots.tolist() == states.robots.tolist()
    assert np.array_equal(back.poses, poses) and np.array_equal(back.twists, twists)
    some = back.of(back.robots > 50)
    assert some.robots.tolist() == [54, 63, 72, 81, 90, 99]
    assert np.array_equal(some.poses, poses[6:])


def test_one_reader_reads_messages_with_changing_names():
    reader = StatesReader()
    for robots in ([0, 1], [0, 1], [0], [7, 3, 12], [], [0, 1]):
        poses, twists = rows(len(robots), len(robots))
        data = serialised(standard(robots, poses, twists))
        states = reader.read(StatesMessage().deserialize(data))
        assert states.robots.tolist() == robots
        assert np.array_equal(states.poses, poses) and np.array_equal(states.twists, twists)


def test_other_names_have_no_number():
    message = standard([0], *rows(1))
    for name in ("quad", "quad00", "Quad0", "quad0 ", "xquad0", "quad-1", "quad99999", "é"):
        message.joint_names = [name]
        assert read(message).robots.tolist() == [-1], name


def test_messages_that_cannot_be_read():
    message = standard([0, 1], *rows(2))
    data = serialised(message)
    for end in range(len(data) - 4):
        with pytest.raises(ValueError, match="cannot be read"):
            StatesReader().read(StatesMessage().deserialize(data[:end]))
    huge = data.replace(b"\x02\0\0\0\x05\0\0\0quad0", b"\xff\xff\xff\xff\x05\0\0\0quad0")
    with pytest.raises(ValueError, match="cannot be read"):
        StatesReader().read(StatesMessage().deserialize(huge))
    message.twist.pop()
    with pytest.raises(ValueError, match="2 names, 2 transforms and 1 twists"):
        read(message)


def test_transforms_are_those_of_rospy():
    frames = [("map", "odom0"), ("odom0", "base_link0"), ("base_link0", "Lidar0"), ("map", "é")]
    writer = TransformWriter(frames)
    for seed in (1, 2):
        poses, expected = rows(len(frames), seed)[0], transforms_of(frames, seed)
        assert serialised(writer.message(STAMP, poses)) == serialised(expected)


def transforms_of(frames, seed):
    poses, _ = rows(len(frames), seed)
    return TFMessage(
        [
            conversions.transform_message(pose(row), parent, child, STAMP)
            for row, (parent, child) in zip(poses, frames)
        ]
    )


def test_wanted_transforms_are_those_of_rospy():
    wanted = {"odom1", "é", "base_link1"}
    reader = TransformReader(wanted.__contains__)
    all_frames = [("map", f"odom{k}") for k in range(12)] + [("odom1", "base_link1"), ("map", "é")]
    same = [*all_frames[:3], ("map", "odom9")]  # other names of the same length
    for seed, frames in enumerate([all_frames, all_frames, same[:3], same, [], all_frames[::-1]]):
        message = transforms_of(frames, seed)
        found = reader.read(TransformsMessage().deserialize(serialised(message)))
        assert found == [one for one in message.transforms if one.child_frame_id in wanted]
    wanted.add("odom2")
    reader.forget()
    assert len(reader.read(TransformsMessage().deserialize(serialised(message)))) == 4


def test_transforms_that_cannot_be_read():
    data = serialised(transforms_of([("map", "odom0"), ("odom0", "base_link0")], 1))
    reader = TransformReader(lambda _: True)
    for end in range(len(data)):
        with pytest.raises(ValueError, match="cannot be read"):
            reader.read(TransformsMessage().deserialize(data[:end]))
    assert len(reader.read(TransformsMessage().deserialize(data))) == 2
    with pytest.raises(ValueError, match="cannot be read"):
        reader.read(TransformsMessage().deserialize(b"\xff\xff\xff\xff" + data[4:]))


def test_odometry_is_that_of_rospy():
    writer = OdometryWriter("odom12", "base_link12")
    for seq in (1, 2):
        poses, twists = rows(1, seq)
        linear, angular = tuple(twists[0, :3].tolist()), tuple(twists[0, 3:].tolist())
        expected: Odometry = conversions.odometry_message(
            pose(poses[0]), linear, angular, ("odom12", "base_link12"), STAMP
        )
        expected.header.seq = seq
        assert serialised(writer.message(STAMP, poses[0], twists[0])) == serialised(expected)


@pytest.mark.parametrize("count", [0, 1, 30])
def test_an_array_of_poses_is_read_by_rospy(count):
    poses = np.random.default_rng(1).normal(size=(count, 3))
    found = PoseArray().deserialize(serialised(pose_array_message(poses, 2.5, "hall")))
    assert (found.header.frame_id, found.header.stamp.to_sec()) == ("hall", 2.5)
    read = [conversions.pose_from_message(one).to_2d() for one in found.poses]
    rows_read = [(one.x_m, one.y_m, one.yaw_rad) for one in read]
    assert np.array(rows_read).reshape(-1, 3) == pytest.approx(poses)


@pytest.mark.parametrize("count", [0, 1, 30])
def test_a_path_is_that_of_rospy(count):
    poses = [(1.7e9 + 0.025 * k, pose(row)) for k, row in enumerate(rows(count)[0])]
    message = PathMessage("map", STAMP.to_sec(), poses)
    message.header.seq = 7
    expected = Path(
        poses=[pose_stamped(one, "map", conversions.time_message(at_s)) for at_s, one in poses]
    )
    expected.header.seq, expected.header.frame_id, expected.header.stamp = 7, "map", STAMP
    found = Path().deserialize(serialised(message))
    assert len(found.poses) == count
    for one, other in zip(found.poses, expected.poses):
        assert abs((one.header.stamp - other.header.stamp).to_nsec()) < 1000  # of a double
        one.header.stamp = other.header.stamp
    assert serialised(found) == serialised(expected)


def test_states_are_valid_as_single_poses_and_twists_are():
    draw = np.random.default_rng(3)
    poses, twists = np.zeros((3000, 7)), np.zeros((3000, 6))
    poses[:, 6] = 1.0
    for table in (poses, twists):
        chosen = draw.random(table.shape) < 0.08
        table[chosen] = draw.choice(ODD, chosen.sum())
    valid, problem = valid_states(poses, twists)
    problems = [
        pose_problem(pose(p)) or twist_problem(Twist2D(t[0], t[1], t[5]))
        for p, t in zip(poses, twists)
    ]
    assert valid.tolist() == [not one for one in problems]
    assert 0 < valid.sum() < len(valid)
    assert problem == next(filter(None, problems))
    assert valid_states(poses[valid], twists[valid])[1] == ""
    assert valid_states(poses[:0], twists[:0])[1] == ""
