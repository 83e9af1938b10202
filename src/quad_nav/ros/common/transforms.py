"""Look up transforms of tf2 as `Pose3D`, or raise with the reason."""

from __future__ import annotations

from typing import List, Optional, Sequence, Tuple

import rospy
import tf2_ros

from quad_nav.errors import NavigationError
from quad_nav.geometry import Pose3D
from quad_nav.ros.common.conversions import pose_from_transform


class TransformUnavailable(NavigationError):
    """No transform between two frames at a time.

    Attributes:
        later: Whether the transform may still arrive.
    """

    def __init__(self, message: str, later: bool = False) -> None:
        """Store the reason."""
        super().__init__(message)
        self.later = later


class Transforms:
    """Transform tree received so far."""

    def __init__(self) -> None:
        """Subscribe to `/tf` and `/tf_static`."""
        self._buffer = tf2_ros.Buffer()
        self._listener = tf2_ros.TransformListener(self._buffer)

    def lookup(self, to_frame: str, from_frame: str, stamp_s: Optional[float] = None) -> Pose3D:
        """Return the pose of `from_frame` in `to_frame`.

        Args:
            to_frame: Target frame.
            from_frame: Source frame.
            stamp_s: Time of the transform; None for the latest.

        Raises:
            TransformUnavailable: If a frame is unknown, the frames are not connected, or the time
                is outside of the received ones.
        """
        return self._lookup(to_frame, from_frame, stamp_s)[0]

    def lookup_near(self, to_frame: str, from_frame: str, stamp_s: float) -> Pose3D:
        """Return the pose of `from_frame` in `to_frame` at a time, else the latest one.

        For frames that move slowly, such as `odom` in `map`: their transform may come later than
        the message that needs it.

        Raises:
            TransformUnavailable: If a frame is unknown, or the frames are not connected.
        """
        try:
            return self.lookup(to_frame, from_frame, stamp_s)
        except TransformUnavailable as error:
            if not error.later:
                raise
        return self.lookup(to_frame, from_frame)

    def locate(
        self, to_frame: str, base_frame: str, now_s: float, tolerance_s: float
    ) -> Optional[Pose3D]:
        """Return the robot's latest pose; None if unknown or older than the tolerance."""
        try:
            pose, stamp_s = self._lookup(to_frame, base_frame, None)
        except TransformUnavailable:
            return None
        return pose if now_s - stamp_s <= tolerance_s else None

    def locate_in(
        self, wanted: Sequence[Tuple[str, str, float]], now_s: float
    ) -> List[Optional[Pose3D]]:
        """Call `locate` once for each distinct (to_frame, base_frame, tolerance_s)."""
        found = {one: self.locate(one[0], one[1], now_s, one[2]) for one in dict.fromkeys(wanted)}
        return [found[one] for one in wanted]

    def _lookup(
        self, to_frame: str, from_frame: str, stamp_s: Optional[float]
    ) -> Tuple[Pose3D, float]:
        if not to_frame or not from_frame:
            raise TransformUnavailable(
                f"empty frame id, expected one such as '{to_frame or 'map'}'"
            )
        stamp = rospy.Time(0) if stamp_s is None else rospy.Time.from_sec(stamp_s)
        to_frame, from_frame = to_frame.lstrip("/"), from_frame.lstrip("/")
        try:
            message = self._buffer.lookup_transform_core(to_frame, from_frame, stamp)
        except tf2_ros.ExtrapolationException as error:
            raise TransformUnavailable(str(error), later=True) from error
        except (tf2_ros.TransformException, ValueError) as error:
            raise TransformUnavailable(str(error)) from error
        return pose_from_transform(message), message.header.stamp.to_sec()
