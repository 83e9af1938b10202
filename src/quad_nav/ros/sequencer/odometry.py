"""Validate a robot's odometry, place it in `map` and notice when it stops."""

from __future__ import annotations

from typing import Dict, Iterable, List, NamedTuple, Optional, Sequence, Tuple

import rospy
from nav_msgs.msg import Odometry

from quad_nav.geometry import Pose2D, Pose3D
from quad_nav.mission.odometry_filter import JUMP_RECOVERY_S, OdometryFilter, OdometrySample
from quad_nav.ros.common.conversions import odometry_from_message
from quad_nav.ros.common.diagnostics import ThrottledWarnings
from quad_nav.ros.common.transforms import Transforms, TransformUnavailable
from quad_nav.topics.validation import odometry_problem, pose_problem, stamp_problem

ODOMETRY_SILENT_S = 3.0


class LocatedPose(NamedTuple):
    """Pose of the robot in `map` at a time; no path leads to one that is `relocated`."""

    stamp_s: float
    pose: Pose3D
    planar: Pose2D
    relocated: bool


class OdometryIntake:
    """Turn the odometry messages of one robot into poses.

    Attributes:
        is_silent: Whether valid odometry has timed out.
        silent_s: Time since the last valid odometry.
    """

    def __init__(self, name: str, topic: str, transforms: Transforms) -> None:
        """Name the robot and its topic, for the log."""
        self._name, self._topic, self._transforms = name, topic, transforms
        self._warnings = ThrottledWarnings()
        self._filter = OdometryFilter()
        self._latest: Dict[str, Optional[Pose3D]] = {}  # poses of frames in the last step
        self._start_s = self._odometry_s = 0.0
        self.is_silent, self.silent_s = False, 0.0

    def begin(self, now_s: float) -> None:
        """Forget earlier odometry; messages with older stamps are ignored."""
        self._filter = OdometryFilter()
        self._start_s = self._odometry_s = now_s
        self.is_silent, self.silent_s = False, 0.0

    @property
    def is_jumping(self) -> bool:
        """True while odometry has jumped, so that the pose is not known."""
        return self._filter.is_jumping

    def map_from(self, frame: str, stamp_s: Optional[float] = None) -> Pose3D:
        """Return the pose of a frame in `map` at a time if tf knows it, else the latest.

        Raises:
            TransformUnavailable: If tf does not know it.
        """
        if frame == "map":
            return Pose3D(0.0, 0.0, 0.0)
        if stamp_s is None:
            return self._transforms.lookup("map", frame)
        return self._transforms.lookup_near("map", frame, stamp_s)

    def take(self, messages: Iterable[Odometry], now_s: float) -> List[LocatedPose]:
        """Return the poses of the valid messages, oldest first, and log why others are dropped."""
        valid = self._valid(messages, now_s)
        located = []
        for (message, stamp_s, odom_from_base), origin in zip(valid, self._origins(valid)):
            if origin is not None and self._is_continuous(message, stamp_s):
                pose = origin.compose(odom_from_base)
                relocated = self._filter.has_relocated
                located.append(LocatedPose(stamp_s, pose, pose.to_2d(), relocated))
        if located:
            self._odometry_s = now_s
        self._watch(now_s)
        return located

    def _valid(
        self, messages: Iterable[Odometry], now_s: float
    ) -> List[Tuple[Odometry, float, Pose3D]]:
        """Return the valid messages with their stamps and poses."""
        valid = []
        for message in messages:
            stamp_s = message.header.stamp.to_sec()
            if stamp_s >= self._start_s:
                odom_from_base = self._checked(message, stamp_s, now_s)
                if odom_from_base is not None:
                    valid.append((message, stamp_s, odom_from_base))
        return valid

    def _checked(self, message: Odometry, stamp_s: float, now_s: float) -> Optional[Pose3D]:
        odom_from_base, velocity = odometry_from_message(message)
        problem = odometry_problem(message.header.frame_id, odom_from_base, velocity)
        problem = problem or stamp_problem(stamp_s, now_s)
        if not problem:
            return odom_from_base
        self._warnings.warn(
            f"{self._name}: {self._topic}: message dropped: {problem}", kind="invalid"
        )
        return None

    def _origins(self, valid: Sequence[Tuple[Odometry, float, Pose3D]]) -> List[Optional[Pose3D]]:
        """Return the pose of each message's frame in `map`; None if it is unknown.

        A frame whose latest pose is that of the step before has not moved: one lookup will do.
        """
        frames = [(message.header.frame_id, stamp_s) for message, stamp_s, _ in valid]
        before = self._latest
        self._latest = {frame: self._origin(frame) for frame in dict(frames)}
        return [
            self._latest[frame]
            if self._latest[frame] == before.get(frame)
            else self._origin(frame, stamp_s)
            for frame, stamp_s in frames
        ]

    def _origin(self, frame: str, stamp_s: Optional[float] = None) -> Optional[Pose3D]:
        try:
            map_from_odom = self.map_from(frame, stamp_s)
        except TransformUnavailable as error:
            problem = str(error)
        else:
            problem = pose_problem(map_from_odom)
            if not problem:
                return map_from_odom
        self._warnings.warn(
            f"{self._name}: pose in map unknown, odometry in {frame!r} dropped: {problem}",
            kind="frame",
        )
        return None

    def _is_continuous(self, message: Odometry, stamp_s: float) -> bool:
        place = message.pose.pose.position
        if self._filter.accepts(OdometrySample(stamp_s, message.header.frame_id, place.x, place.y)):
            if self._filter.has_relocated:
                rospy.logwarn("%s: odometry continues at another position", self._name)
            return True
        self._warnings.warn(
            f"{self._name}: {self._topic}: message dropped: position ({place.x:.2f}, {place.y:.2f})"
            f" m in {message.header.frame_id!r} is a jump; it counts if it lasts"
            f" {JUMP_RECOVERY_S:g} s",
            kind="jump",
        )
        return False

    def _watch(self, now_s: float) -> None:
        self.silent_s = now_s - self._odometry_s
        was_silent, self.is_silent = self.is_silent, self.silent_s > ODOMETRY_SILENT_S
        if self.is_silent and not was_silent:
            rospy.logwarn(
                "%s: no valid message on %s for %.0f s; waiting for odometry",
                self._name,
                self._topic,
                ODOMETRY_SILENT_S,
            )
