"""Validate a robot's states or odometry, place them in `map` and notice when they stop."""

from __future__ import annotations

from typing import Any, Callable, Dict, Iterable, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np
import rospy
from nav_msgs.msg import Odometry
from numpy.typing import NDArray

from quad_nav.geometry import Pose3D, yaws_from_quaternions
from quad_nav.mission.odometry_filter import JUMP_RECOVERY_S, OdometryFilter, OdometrySample
from quad_nav.ros.common.conversions import odometry_from_message
from quad_nav.ros.common.diagnostics import ThrottledWarnings
from quad_nav.ros.common.packed_messages import STATES_TOPIC
from quad_nav.ros.common.transforms import Transforms, TransformUnavailable
from quad_nav.topics.validation import odometry_problem, pose_problem, stamp_problem

ODOMETRY_SILENT_S = 3.0
TF_PATIENCE_S = 1.0
"""Without a pose in `map` for so long, a warning says why; at the start tf may arrive later."""
TimedPose = Tuple[float, NDArray[np.float64]]
"""Time and pose in `map`, float64[7]: position in m and quaternion (x, y, z, w)."""


class Track(NamedTuple):
    """Poses of the robot in `map`, in the order in which they arrived.

    Attributes:
        stamps_s: float64[n], times.
        poses: float64[n, 4], x, y and z in m and yaw in rad.
        relocated: bool[n], True where no path leads from the pose before.
    """

    stamps_s: NDArray[np.float64]
    poses: NDArray[np.float64]
    relocated: NDArray[np.bool_]

    @property
    def planar(self) -> NDArray[np.float64]:
        """Poses float64[n, 3], x and y in m and yaw in rad."""
        return self.poses[:, [0, 1, 3]]


_NO_POSES = Track(np.empty(0), np.empty((0, 4)), np.empty(0, np.bool_))


class OdometryIntake:
    """Turn the states or the odometry messages of one robot into poses.

    Attributes:
        is_silent: Whether valid odometry has timed out.
        silent_s: Time since the last valid odometry.
    """

    def __init__(self, name: str, topic: str, transforms: Callable[[], Transforms]) -> None:
        """Name the robot and its topic, for the log.

        Args:
            name: Name of the robot.
            topic: Topic of its odometry.
            transforms: Returns the transform tree, which odometry needs.
        """
        self._name, self._topic, self._transforms = name, topic, transforms
        self._warnings = ThrottledWarnings()
        self._filter, self._is_in_bulk = OdometryFilter(), True
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

    def map_from(self, frame: str, stamp: Optional[rospy.Time] = None) -> Pose3D:
        """Return the pose of a frame in `map` at a time if tf knows it, else the latest.

        Raises:
            TransformUnavailable: If tf does not know it.
        """
        if frame == "map":
            return Pose3D(0.0, 0.0, 0.0)
        if stamp is None:
            return self._transforms().lookup("map", frame)
        return self._transforms().lookup_near("map", frame, stamp)

    def take(
        self, states: Sequence[TimedPose], messages: Sequence[Odometry], now_s: float
    ) -> Track:
        """Return the valid poses, oldest first, and log why others are dropped.

        Args:
            states: States, which are valid.
            messages: Odometry messages.
            now_s: Present time.
        """
        tracks = [_NO_POSES]
        if messages:
            tracks.append(self._take_odometry(messages, now_s))
        if states:
            tracks.append(self._take_states(states))
        longest = max(tracks, key=lambda track: len(track.stamps_s))
        track = longest if len(tracks) < 3 else Track(*map(np.concatenate, zip(*tracks)))
        if len(track.stamps_s):
            self._odometry_s = now_s
        self._watch(now_s)
        return track

    def _set_source(self, is_in_bulk: bool) -> None:
        """Start a new filter if the poses come from another topic, in another frame."""
        if is_in_bulk != self._is_in_bulk:
            self._filter, self._is_in_bulk = OdometryFilter(), is_in_bulk

    def _take_states(self, states: Sequence[TimedPose]) -> Track:
        self._set_source(True)
        stamps_s = np.array([stamp_s for stamp_s, _ in states])
        poses = np.array([pose for _, pose in states])
        if stamps_s[0] < self._start_s:
            is_new = stamps_s >= self._start_s
            stamps_s, poses = stamps_s[is_new], poses[is_new]
        accepted, relocated = self._filter.accepts_track(stamps_s, "map", poses[:, :2])
        rows = np.column_stack((poses[:, :3], yaws_from_quaternions(poses[:, 3:])))
        if accepted.all() and not relocated.any():
            return Track(stamps_s, rows, relocated)
        for row in np.flatnonzero(~accepted).tolist():
            self._warn_jump(STATES_TOPIC, "map", *rows[row, :2].tolist())
        self._log_relocations(relocated)
        return Track(stamps_s[accepted], rows[accepted], relocated[accepted])

    def _take_odometry(self, messages: Iterable[Odometry], now_s: float) -> Track:
        self._set_source(False)
        valid = self._valid(messages, now_s)
        located = []
        for (message, stamp_s, odom_from_base), origin in zip(valid, self._origins(valid, now_s)):
            if origin is not None and self._is_continuous(message, stamp_s):
                pose = origin.compose(odom_from_base)
                row = (stamp_s, pose.x_m, pose.y_m, pose.z_m, pose.yaw_rad)
                located.append((*row, self._filter.has_relocated))
        table = np.array(located, np.float64).reshape(-1, 6)
        return Track(table[:, 0], table[:, 1:5], table[:, 5] > 0.0)

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

    def _origins(
        self, valid: Sequence[Tuple[Odometry, float, Pose3D]], now_s: float
    ) -> List[Optional[Pose3D]]:
        """Return the pose of each message's frame in `map`; None if it is unknown.

        A frame whose latest pose is that of the step before has not moved: one lookup will do.
        """
        frames = [(message.header.frame_id, message.header.stamp) for message, _, _ in valid]
        before = self._latest
        self._latest = {frame: self._origin(frame, now_s) for frame in dict(frames)}
        return [
            self._latest[frame]
            if self._latest[frame] == before.get(frame)
            else self._origin(frame, now_s, stamp)
            for frame, stamp in frames
        ]

    def _origin(
        self, frame: str, now_s: float, stamp: Optional[rospy.Time] = None
    ) -> Optional[Pose3D]:
        try:
            map_from_odom = self.map_from(frame, stamp)
        except TransformUnavailable as error:
            problem = str(error)
        else:
            problem = pose_problem(map_from_odom)
            if not problem:
                return map_from_odom
        if now_s - self._odometry_s > TF_PATIENCE_S:
            self._warnings.warn(
                f"{self._name}: pose in map unknown, odometry in {frame!r} dropped: {problem}",
                kind="frame",
            )
        return None

    def _is_continuous(self, message: Odometry, stamp_s: float) -> bool:
        place, frame = message.pose.pose.position, message.header.frame_id
        if self._filter.accepts(OdometrySample(stamp_s, frame, place.x, place.y)):
            self._log_relocations(self._filter.has_relocated)
            return True
        self._warn_jump(self._topic, frame, place.x, place.y)
        return False

    def _log_relocations(self, relocated: Any) -> None:
        if np.any(relocated):
            rospy.logwarn("%s: odometry continues at another position", self._name)

    def _warn_jump(self, topic: str, frame: str, x_m: float, y_m: float) -> None:
        self._warnings.warn(
            f"{self._name}: {topic}: message dropped: position ({x_m:.2f}, {y_m:.2f}) m in"
            f" {frame!r} is a jump; it counts if it lasts {JUMP_RECOVERY_S:g} s",
            kind="jump",
        )

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
