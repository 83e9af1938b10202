"""Receive transforms, and look them up in tf2 as `Pose3D`, or raise with the reason."""

from __future__ import annotations

import re
import threading
from typing import Iterable, List, NamedTuple, Optional, Sequence, Tuple

import rospy
import tf2_ros
from geometry_msgs.msg import TransformStamped
from tf2_msgs.msg import TFMessage

from quad_nav.errors import NavigationError, excerpt
from quad_nav.geometry import Pose3D
from quad_nav.ros.common.conversions import pose_from_transform
from quad_nav.ros.common.diagnostics import ThrottledWarnings
from quad_nav.ros.common.packed_messages import TransformReader, TransformsMessage
from quad_nav.topics.transform_filter import TransformFilter
from quad_nav.topics.validation import MAX_STAMP_S, frame_problem

MAX_HELD = 1000  # transforms that wait for the clock to start
_ROBOT_FRAME = re.compile(r"/?(?:odom|base_link|Lidar)(\d{1,4})")


class TransformUnavailable(NavigationError):
    """No transform between two frames at a time.

    Attributes:
        later: Whether the transform may still arrive.
    """

    def __init__(self, message: str, later: bool = False) -> None:
        super().__init__(excerpt(message, 500))
        self.later = later


class LocatedPose(NamedTuple):
    """A pose in a frame, and the time of the transform that it is from."""

    pose: Pose3D
    stamp_s: float


class Transforms:
    """Transform tree received so far.

    It takes the place of `tf2_ros.TransformListener`, which hands every transform to tf2.
    """

    def __init__(self, others: Iterable[int] = ()) -> None:
        """Subscribe to `/tf` and `/tf_static`.

        Args:
            others: Numbers of robots whose frames on `/tf` are left out until they are looked up:
                `odom{j}`, `base_link{j}` and `Lidar{j}`.
        """
        self._left_out = set(others)
        self._reader = TransformReader(lambda frame: _robot_of(frame) not in self._left_out)
        self._newest: Optional[TransformsMessage] = None
        self._buffer = tf2_ros.Buffer()
        self._filter = TransformFilter(self._buffer.clear)
        self._warnings = ThrottledWarnings()
        self._lock = threading.Lock()
        self._now_s = 0.0
        self._held: List[TransformStamped] = []
        self._subscribers = [
            rospy.Subscriber("/tf", TransformsMessage, self._on_transforms),
            rospy.Subscriber("/tf_static", TFMessage, self._on_static_transforms),
        ]

    def close(self) -> None:
        """Receive no further transforms."""
        for subscriber in self._subscribers:
            subscriber.unregister()

    def _on_transforms(self, message: TransformsMessage) -> None:
        with self._lock:
            self._newest = message
            self._read(message)

    def _read(self, message: TransformsMessage) -> None:
        try:
            transforms = self._reader.read(message)
        except ValueError as error:
            self._warnings.warn(f"/tf: message dropped: {error}")
            return
        if not self._update_time():
            self._held += transforms[: MAX_HELD - len(self._held)]
            return
        for transform in transforms:
            self._store(transform, is_static=False)

    def _include(self, frame: str) -> None:
        """Receive the frames of a robot that were left out, if this is one of them."""
        robot = _robot_of(frame)
        if robot not in self._left_out:
            return
        with self._lock:
            self._left_out.discard(robot)
            self._reader.forget()
            if self._newest is not None:
                self._read(self._newest)

    def _on_static_transforms(self, message: TFMessage) -> None:
        with self._lock:
            self._update_time()
            for transform in message.transforms:
                self._store(transform, is_static=True)

    def _update_time(self) -> bool:
        """Note the time, and store what waited for it; return False while there is none."""
        before_s, self._now_s = self._now_s, rospy.get_time()
        if self._now_s < before_s:
            self._warnings.warn(
                f"tf: the clock jumped back by {before_s - self._now_s:.2f} s; discarding all"
                " transforms"
            )
            self._filter.clear()
        if self._now_s > 0.0 and self._held:
            held, self._held = self._held, []
            for transform in held:
                self._store(transform, is_static=False)
        return self._now_s > 0.0

    def _store(self, message: TransformStamped, is_static: bool) -> None:
        header = message.header
        stamp_ns = 0 if is_static else header.stamp.secs * 10**9 + header.stamp.nsecs
        try:
            is_new = self._filter.accept(
                header.frame_id,
                message.child_frame_id,
                pose_from_transform(message),
                stamp_ns,
                self._now_s,
                is_static,
            )
        except ValueError as error:
            topic = "/tf_static" if is_static else "/tf"
            self._warnings.warn(f"{topic}: transform dropped: {error}")
            return
        if is_static:
            header.stamp = rospy.Time()  # tf2 does not use it, but aborts if it is out of range
            self._buffer.set_transform_static(message, "")
        elif is_new:
            self._buffer.set_transform(message, "")

    def lookup(self, to_frame: str, from_frame: str, stamp: Optional[rospy.Time] = None) -> Pose3D:
        """Return the pose of `from_frame` in `to_frame`.

        Args:
            to_frame: Target frame.
            from_frame: Source frame.
            stamp: Time of the transform, as the message has it: through seconds it may become a
                nanosecond earlier than the first transform. None for the latest.

        Raises:
            TransformUnavailable: If a frame is unknown, the frames are not connected, or the time
                is outside of the received ones.
        """
        return self._lookup(to_frame, from_frame, stamp)[0]

    def lookup_near(self, to_frame: str, from_frame: str, stamp: rospy.Time) -> Pose3D:
        """Return the pose of `from_frame` in `to_frame` at a time, else the latest one.

        For frames that move slowly, such as `odom` in `map`: their transform may come later than
        the message that needs it.

        Raises:
            TransformUnavailable: If a frame is unknown, or the frames are not connected.
        """
        try:
            return self.lookup(to_frame, from_frame, stamp)
        except TransformUnavailable as error:
            if not error.later:
                raise
        return self.lookup(to_frame, from_frame)

    def locate(
        self, to_frame: str, base_frame: str, now_s: float, tolerance_s: float
    ) -> Optional[LocatedPose]:
        """Return the robot's latest pose; None if unknown or older than the tolerance."""
        try:
            pose, stamp_s = self._lookup(to_frame, base_frame, None)
        except TransformUnavailable:
            return None
        return LocatedPose(pose, min(stamp_s, now_s)) if now_s - stamp_s <= tolerance_s else None

    def locate_in(
        self, wanted: Sequence[Tuple[str, str, float]], now_s: float
    ) -> List[Optional[LocatedPose]]:
        """Call `locate` once for each distinct (to_frame, base_frame, tolerance_s)."""
        found = {one: self.locate(one[0], one[1], now_s, one[2]) for one in dict.fromkeys(wanted)}
        return [found[one] for one in wanted]

    def _lookup(
        self, to_frame: str, from_frame: str, stamp: Optional[rospy.Time]
    ) -> Tuple[Pose3D, float]:
        if self._held:
            with self._lock:
                self._update_time()
        to_frame, from_frame = to_frame.lstrip("/"), from_frame.lstrip("/")
        for frame in (to_frame, from_frame) if self._left_out else ():
            self._include(frame)
        problem = frame_problem(to_frame) or frame_problem(from_frame)
        if problem:
            raise TransformUnavailable(f"{problem}, such as '{to_frame or 'map'}'")
        stamp = stamp or rospy.Time()
        if not 0.0 <= stamp.to_sec() <= MAX_STAMP_S:
            raise TransformUnavailable(
                f"stamp {stamp.to_sec():.2f} s, expected 0 to {MAX_STAMP_S:.0f} s", later=False
            )
        try:
            message = self._buffer.lookup_transform_core(to_frame, from_frame, stamp)
        except tf2_ros.ExtrapolationException as error:
            raise TransformUnavailable(str(error), later=True) from error
        except (tf2_ros.TransformException, ValueError) as error:
            raise TransformUnavailable(str(error)) from error
        return pose_from_transform(message), message.header.stamp.to_sec()


def _robot_of(frame: str) -> Optional[int]:
    """Return the number of the robot that has a frame by its name; None for another frame."""
    found = _ROBOT_FRAME.fullmatch(frame)
    return int(found[1]) if found else None
