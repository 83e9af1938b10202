"""tf2 as the core wants it: ``Pose3D`` between frames, or a reason why not."""

from __future__ import annotations

from typing import List, Optional, Sequence, Tuple

import rospy
import tf2_ros

from quad_nav.errors import NavigationError
from quad_nav.geometry import Pose3D
from quad_nav.ros.common.convert import pose_from_transform


class TransformUnavailable(NavigationError):
    """No transform between two frames at a time. ``later`` says that it may still come."""

    def __init__(self, message: str, later: bool = False):
        super().__init__(message)
        self.later = later


class Transforms:
    """The transform tree heard so far."""

    def __init__(self) -> None:
        self._buffer = tf2_ros.Buffer()
        self._listener = tf2_ros.TransformListener(self._buffer)

    def lookup(self, to_frame: str, from_frame: str, stamp_s: Optional[float] = None) -> Pose3D:
        """``to_from_from`` at a time, or the latest.

        Raises:
            TransformUnavailable: unknown frame, no connection, or outside the times heard.
        """
        return self._lookup(to_frame, from_frame, stamp_s)[0]

    def locate(
        self, to_frame: str, base_frame: str, now_s: float, tolerance_s: float
    ) -> Optional[Pose3D]:
        """The robot's latest pose, None when unknown or older than the tolerance."""
        try:
            pose, stamp_s = self._lookup(to_frame, base_frame, None)
        except TransformUnavailable:
            return None
        return pose if now_s - stamp_s <= tolerance_s else None

    def locate_in(
        self, wanted: Sequence[Tuple[str, str, float]], now_s: float
    ) -> List[Optional[Pose3D]]:
        """``locate`` for several (to_frame, base_frame, tolerance_s); the same ones once."""
        found = {one: self.locate(one[0], one[1], now_s, one[2]) for one in dict.fromkeys(wanted)}
        return [found[one] for one in wanted]

    def _lookup(self, to_frame: str, from_frame: str, stamp_s: Optional[float]):
        if not to_frame or not from_frame:
            raise TransformUnavailable(f"empty frame id; expected one like '{to_frame or 'map'}'")
        stamp = rospy.Time(0) if stamp_s is None else rospy.Time.from_sec(stamp_s)
        to_frame, from_frame = to_frame.lstrip("/"), from_frame.lstrip("/")
        try:
            message = self._buffer.lookup_transform_core(to_frame, from_frame, stamp)
        except tf2_ros.ExtrapolationException as error:
            raise TransformUnavailable(str(error), later=True) from error
        except (tf2_ros.TransformException, ValueError) as error:
            raise TransformUnavailable(str(error)) from error
        return pose_from_transform(message), message.header.stamp.to_sec()
