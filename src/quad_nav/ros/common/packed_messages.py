"""Pose messages of many robots, serialised from arrays and read into arrays.

rospy makes an object for each vector of a message. At 40 Hz for 50 robots these objects cost more
than what they carry. The classes of this module copy arrays into bytes that are laid out once. The
bytes are those of rospy's own serialiser.
"""

from __future__ import annotations

import io
import re
import struct
from typing import Any, Callable, List, NamedTuple, Optional, Sequence, Tuple

import genpy
import numpy as np
import rospy
from geometry_msgs.msg import PoseArray, TransformStamped
from nav_msgs.msg import Odometry, Path
from numpy.typing import NDArray
from sensor_msgs.msg import MultiDOFJointState
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

from quad_nav.geometry import Pose3D
from quad_nav.ros.common.conversions import time_message
from quad_nav.ros.common.rospy_repairs import serialised

STATES_TOPIC = "/quad/states"
_COUNT = struct.Struct("<I")
_STAMP = struct.Struct("<2I")
_HEAD = struct.Struct("<4I")  # seq, seconds, nanoseconds, length of the frame's name
_POSE, _TWIST = 7, 6
_COVARIANCE = 36
_ROBOT = re.compile(rb"quad(0|[1-9]\d{0,3})")
_OTHER = -1

Floats = NDArray[np.float64]


class States(NamedTuple):
    """States of robots at one time.

    Attributes:
        stamp_s: Time of the states.
        frame: Frame of the poses.
        robots: int64[n], numbers of the robots; -1 for a name that is not `quad{i}`.
        poses: float64[n, 7], position in m and quaternion (x, y, z, w) in `frame`.
        twists: float64[n, 6], velocity (x, y, z) in m/s and angular velocity (x, y, z) in rad/s,
            in the robot's own frame.
    """

    stamp_s: float
    frame: str
    robots: NDArray[np.int64]
    poses: Floats
    twists: Floats

    def of(self, rows: Any) -> States:
        """Return the states of some rows, given as a mask or as indices."""
        return self._replace(
            robots=self.robots[rows], poses=self.poses[rows], twists=self.twists[rows]
        )


class StatesMessage(MultiDOFJointState):
    """A `MultiDOFJointState` in its serialised form.

    `states_message` makes it, `StatesReader` reads it. `joint_names` are `quad{i}`, `transforms`
    the poses, `twist` the velocities; there are no wrenches.
    """

    def serialize(self, buff: Any) -> None:
        """Write the bytes."""
        buff.write(self.data)

    def deserialize(self, data: bytes) -> StatesMessage:
        """Keep the bytes."""
        self.data = bytes(data)
        return self


def states_message(states: States) -> StatesMessage:
    """Serialise states."""
    stamp, frame = time_message(states.stamp_s), states.frame.encode()
    count = _COUNT.pack(len(states.robots))
    texts = [b"quad%d" % number for number in states.robots.tolist()]
    names = [_COUNT.pack(len(text)) + text for text in texts]
    message = StatesMessage()
    message.data = b"".join(
        (
            _HEAD.pack(0, stamp.secs, stamp.nsecs, len(frame)),
            frame,
            count,
            *names,
            count,
            np.ascontiguousarray(states.poses, "<f8").tobytes(),
            count,
            np.ascontiguousarray(states.twists, "<f8").tobytes(),
            _COUNT.pack(0),
        )
    )
    return message


class StatesReader:
    """Read messages whose names are mostly those of the message before."""

    def __init__(self) -> None:
        self._names, self._robots = b"", np.zeros(0, np.int64)

    def read(self, message: StatesMessage) -> States:
        """Return the states of a message.

        Raises:
            ValueError: If the bytes are not such a message, or not as many poses and twists as
                names.
        """
        data = message.data
        try:
            _, seconds, nanoseconds, length = _HEAD.unpack_from(data)
            start = _HEAD.size + length
            frame = data[_HEAD.size : start].decode()
            robots, end = self._read_names(data, start)
            poses, end = _rows(data, end, _POSE)
            twists, _ = _rows(data, end, _TWIST)
        except (struct.error, UnicodeDecodeError) as error:
            raise ValueError(f"it cannot be read: {error}") from error
        if not len(robots) == len(poses) == len(twists):
            raise ValueError(
                f"{len(robots)} names, {len(poses)} transforms and {len(twists)} twists, expected"
                " as many of each"
            )
        return States(seconds + nanoseconds / 1e9, frame, robots, poses, twists)

    def _read_names(self, data: bytes, start: int) -> Tuple[NDArray[np.int64], int]:
        """Return the numbers of the names, and where they end."""
        if self._names and data.startswith(self._names, start):
            return self._robots, start + len(self._names)
        (count,) = _COUNT.unpack_from(data, start)
        robots: List[int] = []
        end = start + _COUNT.size
        for _ in range(count):
            (length,) = _COUNT.unpack_from(data, end)
            found = _ROBOT.fullmatch(data, end + _COUNT.size, end + _COUNT.size + length)
            robots.append(int(found[1]) if found else _OTHER)
            end += _COUNT.size + length
        self._names, self._robots = data[start:end], np.array(robots, np.int64)
        return self._robots, end


def _rows(data: bytes, start: int, width: int) -> Tuple[Floats, int]:
    """Return an array float64[n, width] that follows its length, and where it ends."""
    (count,) = _COUNT.unpack_from(data, start)
    start += _COUNT.size
    end = start + 8 * width * count
    if end > len(data):
        raise struct.error(f"{count} rows in {len(data) - start} bytes")
    rows = np.frombuffer(data, "<f8", width * count, start).reshape(count, width)
    return rows.copy(), end  # the bytes are not aligned


class TransformsMessage(TFMessage):
    """A `TFMessage` in its serialised form, which `TransformReader` reads."""

    def deserialize(self, data: bytes) -> TransformsMessage:
        """Keep the bytes."""
        self.data = bytes(data)
        return self


class TransformReader:
    """Read some transforms of messages whose frames are mostly those of the message before."""

    def __init__(self, is_wanted: Callable[[str], bool]) -> None:
        """Read the transforms of child frames that ``is_wanted``."""
        self._is_wanted = is_wanted
        self._length = 0
        self._names: List[Tuple[int, int, bytes]] = []  # start, end and bytes of each pair of names
        self._wanted: List[Tuple[int, int]] = []  # start and end of each wanted transform

    def read(self, message: TransformsMessage) -> List[TransformStamped]:
        """Return the wanted transforms of a message.

        Raises:
            ValueError: If the bytes are not such a message.
        """
        data = message.data
        is_known = 0 < len(data) == self._length and all(
            [data[start:end] == names for start, end, names in self._names]
        )
        try:
            if not is_known:
                self.forget()
                self._find(data)
            return [TransformStamped().deserialize(data[start:end]) for start, end in self._wanted]
        except (struct.error, UnicodeDecodeError, genpy.DeserializationError) as error:
            self.forget()
            raise ValueError(f"it cannot be read: {error}") from error

    def forget(self) -> None:
        """Ask again which frames are wanted."""
        self._length, self._names, self._wanted = 0, [], []

    def _find(self, data: bytes) -> None:
        """Find the transforms and their names."""
        (count,) = _COUNT.unpack_from(data)
        end = _COUNT.size
        for _ in range(count):
            start, parent = end, end + _HEAD.size - _COUNT.size
            child = parent + _COUNT.size + _COUNT.unpack_from(data, parent)[0]
            pose = child + _COUNT.size + _COUNT.unpack_from(data, child)[0]
            end = pose + 8 * _POSE
            if end > len(data):
                raise struct.error(f"{count} transforms in {len(data)} bytes")
            self._names.append((parent, pose, data[parent:pose]))
            if self._is_wanted(data[child + _COUNT.size : pose].decode(errors="replace")):
                self._wanted.append((start, end))
        self._names.append((0, _COUNT.size, data[: _COUNT.size]))
        self._length = len(data)


class TransformWriter:
    """Serialise the same transforms, given as pairs of parent and child, again and again."""

    def __init__(self, frames: Sequence[Tuple[str, str]]) -> None:
        transforms = [TransformStamped(Header(0, None, one), two, None) for one, two in frames]
        sizes = np.array([len(_bytes(one)) for one in transforms], np.int64)
        ends = _COUNT.size + np.cumsum(sizes)
        self._layout = np.frombuffer(_bytes(TFMessage(transforms)), np.uint8)
        self._stamps = _places(ends - sizes + _COUNT.size, _STAMP.size)
        self._poses = _places(ends - 8 * _POSE, 8 * _POSE)

    def message(self, stamp: rospy.Time, poses: Floats) -> rospy.AnyMsg:
        """Return a `TFMessage` with `parent_from_child`, float64[n, 7] as in `States`."""
        data = self._layout.copy()
        data[self._stamps] = np.frombuffer(_STAMP.pack(stamp.secs, stamp.nsecs), np.uint8)
        rows = np.ascontiguousarray(poses, "<f8")
        data[self._poses] = rows.view(np.uint8).reshape(len(rows), 8 * _POSE)
        return serialised(data.tobytes())


def pose_array_message(poses: Floats, now_s: float, frame: str = "map") -> rospy.AnyMsg:
    """Return a `PoseArray` with poses (x_m, y_m, yaw_rad) in a frame, float64[n, 3]."""
    rows = np.zeros((len(poses), _POSE), "<f8")
    rows[:, :2] = poses[:, :2]
    rows[:, 5], rows[:, 6] = np.sin(0.5 * poses[:, 2]), np.cos(0.5 * poses[:, 2])
    empty = _bytes(PoseArray(Header(0, time_message(now_s), frame), []))
    return serialised(empty[: -_COUNT.size] + _COUNT.pack(len(rows)) + rows.tobytes())


class OdometryWriter:
    """Serialise the odometry of one robot, without covariances of the velocity."""

    def __init__(self, frame: str, child: str) -> None:
        self._layout = bytearray(_bytes(Odometry(Header(0, None, frame), child, None, None)))
        self._twist = len(self._layout) - 8 * (_TWIST + _COVARIANCE)
        self._pose = self._twist - 8 * (_POSE + _COVARIANCE)
        self._seq = 0

    def message(
        self, stamp: rospy.Time, pose: Floats, twist: Floats, covariance: Optional[Floats] = None
    ) -> rospy.AnyMsg:
        """Return the next message, with pose float64[7] and twist float64[6] as in `States`.

        ``covariance`` is that of the pose, float64[36]; without it, it is 0.
        """
        self._seq += 1
        struct.pack_into("<3I", self._layout, 0, self._seq, stamp.secs, stamp.nsecs)
        struct.pack_into("<7d", self._layout, self._pose, *pose.tolist())
        struct.pack_into("<6d", self._layout, self._twist, *twist.tolist())
        if covariance is not None:
            place = self._pose + 8 * _POSE
            self._layout[place : place + 8 * _COVARIANCE] = covariance.astype("<f8").tobytes()
        return serialised(bytes(self._layout))


class PathMessage(Path):
    """A path whose bytes are made when they are sent: of many paths mostly none is."""

    def __init__(self, frame: str, stamp_s: float, poses: Sequence[Tuple[float, Pose3D]]) -> None:
        """Store a path in ``frame``: poses with their times."""
        super().__init__()
        self.header.frame_id, self.header.stamp = frame, time_message(stamp_s)
        self._timed_poses = poses

    def serialize(self, buff: Any) -> None:
        """Write header and poses."""
        frame, timed = self.header.frame_id.encode(), self._timed_poses
        stamp = self.header.stamp
        stamps_ns = np.rint(np.array([stamp_s for stamp_s, _ in timed]) * 1e9).astype(np.int64)
        rows = np.zeros(len(timed), _stamped_pose(len(frame)))
        rows["secs"], rows["nsecs"] = np.divmod(stamps_ns, 10**9)
        rows["length"], rows["frame"] = len(frame), frame
        rows["pose"] = np.array([(p.x_m, p.y_m, p.z_m, *p.quaternion) for _, p in timed]).reshape(
            -1, _POSE
        )
        head = _HEAD.pack(self.header.seq, stamp.secs, stamp.nsecs, len(frame))
        buff.write(head + frame + _COUNT.pack(len(timed)) + rows.tobytes())


def read_path(data: bytes) -> Tuple[str, Floats]:
    """Return the frame of a `nav_msgs/Path` and its points float64[n, 2], x and y.

    Raises:
        ValueError: If the bytes are not such a message.
    """
    try:
        *_, length = _HEAD.unpack_from(data)
        start = _HEAD.size + length
        frame = data[_HEAD.size : start].decode()
        (count,) = _COUNT.unpack_from(data, start)
        if not count:
            return frame, np.zeros((0, 2))
        *_, length = _HEAD.unpack_from(data, start + _COUNT.size)
        layout = _stamped_pose(length)
        if len(data) - start - _COUNT.size == count * layout.itemsize:  # all names are as long
            rows = np.frombuffer(data, layout, count, start + _COUNT.size)
            return frame, rows["pose"][:, :2].copy()
        poses = Path().deserialize(data).poses
    except (struct.error, UnicodeDecodeError, genpy.DeserializationError) as error:
        raise ValueError(f"it cannot be read: {error}") from error
    return frame, np.array([(one.pose.position.x, one.pose.position.y) for one in poses])


def _stamped_pose(frame_bytes: int) -> np.dtype:
    """Return the layout of a `PoseStamped` whose frame has some length."""
    header = [("seq", "<u4"), ("secs", "<u4"), ("nsecs", "<u4"), ("length", "<u4")]
    return np.dtype([*header, ("frame", f"S{frame_bytes}"), ("pose", "<f8", (_POSE,))])


def pose_row(pose: Pose3D) -> Floats:
    """Return position and quaternion (x, y, z, w), float64[7]."""
    return np.array((pose.x_m, pose.y_m, pose.z_m, *pose.quaternion))


def _bytes(message: genpy.Message) -> bytes:
    buffer = io.BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


def _places(starts: NDArray[np.int64], size: int) -> NDArray[np.int64]:
    """Return the indices int64[n, size] of the bytes of fields of one size."""
    return starts[:, None] + np.arange(size)
