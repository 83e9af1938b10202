"""Poses and velocities of all robots, from `/quad/states` or else from odometry."""

from __future__ import annotations

import collections
import struct
import time
from typing import Deque, Dict, List, Optional, Tuple

import numpy as np
import rospy
from nav_msgs.msg import Odometry
from numpy.typing import NDArray

from quad_nav.geometry import Pose3D, yaws_from_quaternions
from quad_nav.ros.common.conversions import odometry_from_message, time_message
from quad_nav.ros.common.diagnostics import ThrottledWarnings
from quad_nav.ros.common.packed_messages import (
    STATES_TOPIC,
    Floats,
    States,
    StatesMessage,
    StatesReader,
)
from quad_nav.ros.common.rospy_repairs import set_time
from quad_nav.topics.validation import odometry_problem, valid_states
from quad_web.ros.frames import Frames
from quad_web.ros.intake import Newest, Topic
from quad_web.view.items import UNKNOWN_BODY, body_row
from quad_web.view.rows import SAMPLE_PERIOD_S
from quad_web.view.state import MAX_SAMPLES

MAP = "map"
MISSING_AFTER_S = 1.5
"""A robot that no bulk message has carried for so long, in wall time, is heard from odometry."""
_HISTORY = 80  # messages: two seconds at real time
_STAMP = struct.Struct("<4x2I")
_SAME_S = 1e-6
_BEHIND_S = 1.0  # the clock may be ahead of the newest poses; it is further ahead after a restart


class Bodies:
    """The newest poses of all robots.

    Attributes:
        rows: float64[n, 13], see `view.items.poses_item`; NaN for robots not heard of.
        stamp_s: Time of the newest row.
        wall_s: `time.time()` at which it arrived.
        heard_s: float64[n], wall time, monotonic, of each robot's last message; -inf before it.
    """

    def __init__(self, robots: int, frames: Frames) -> None:
        """Start without poses."""
        self.rows = np.tile(np.array(UNKNOWN_BODY), (robots, 1))
        self.stamp_s, self.wall_s = 0.0, 0.0
        self.heard_s = np.full(robots, -np.inf)
        self._frames = frames
        self._in_bulk_s = np.full(robots, -np.inf)
        self._messages: Deque[Tuple[float, StatesMessage]] = collections.deque(maxlen=_HISTORY)
        self._sampled: Deque[StatesMessage] = collections.deque(maxlen=MAX_SAMPLES)
        self._sampled_s = -np.inf  # stamp of the last of them
        self._is_new = False
        self._odometry: Dict[int, Newest] = {}
        self._reader, self._warnings = StatesReader(), ThrottledWarnings()
        self._located: Tuple[float, Optional[States]] = (-1.0, None)  # the last that `at` has read

    def start(self) -> None:
        """Expect messages from now on: a client has come."""
        self._in_bulk_s[:] = time.monotonic()
        self._messages.clear()
        self._sampled.clear()

    def topics(self) -> Dict[str, Topic]:
        """Return the topics to subscribe to at present."""
        missing = time.monotonic() - self._in_bulk_s > MISSING_AFTER_S
        robots: List[int] = np.flatnonzero(missing).tolist()
        self._odometry = {i: self._odometry.get(i) or Newest(f"/odom{i}", Odometry) for i in robots}
        return {
            STATES_TOPIC: Topic(StatesMessage, self._on_states),
            **{f"/odom{i}": newest.topic for i, newest in self._odometry.items()},
        }

    def _on_states(self, message: StatesMessage) -> None:
        if len(message.data) < _STAMP.size:
            return
        seconds, nanoseconds = _STAMP.unpack_from(message.data)
        stamp_s = seconds + nanoseconds / 1e9
        self._messages.append((stamp_s, message))
        if not 0.0 <= stamp_s - self._sampled_s < SAMPLE_PERIOD_S - _SAME_S:
            self._sampled_s = stamp_s
            self._sampled.append(message)
        self.wall_s, self._is_new = time.time(), True

    def refresh(self) -> bool:
        """Read what has arrived since the last call; return whether there is anything new."""
        is_new, self._is_new = self._is_new, False
        if is_new and self._messages:
            states = self._read(self._messages[-1][1])
            is_new = states is not None and self._take(states)
        for robot, newest in self._odometry.items():
            is_new = self._take_odometry(robot, newest) or is_new
        if is_new and not 0.0 <= rospy.get_time() - self.stamp_s < _BEHIND_S:
            set_time(time_message(self.stamp_s))
        return is_new

    def _read(self, message: StatesMessage) -> Optional[States]:
        try:
            states = self._reader.read(message)
            if states.frame.lstrip("/") != MAP:
                raise ValueError(f"states in frame '{states.frame}', expected '{MAP}'")
        except ValueError as error:
            self._warnings.warn(f"web: {STATES_TOPIC}: message dropped: {error}", STATES_TOPIC)
            return None
        states = states.of((states.robots >= 0) & (states.robots < len(self.rows)))
        return states.of(valid_states(states.poses, states.twists)[0])

    def _take(self, states: States) -> bool:
        if not len(states.robots):
            return False
        self.rows[states.robots] = _rows(states)
        self.heard_s[states.robots] = self._in_bulk_s[states.robots] = time.monotonic()
        self.stamp_s = states.stamp_s
        return True

    def samples(self) -> List[Tuple[float, Floats]]:
        """Return times and rows since the last call, `SAMPLE_PERIOD_S` apart.

        Robots whose states are not in bulk are where they are now.
        """
        found = []
        for _ in range(len(self._sampled)):
            states = self._read(self._sampled.popleft())
            if states is not None:
                rows = self.rows.copy()
                rows[states.robots] = _rows(states)
                found.append((states.stamp_s, rows))
        return found or [(self.stamp_s, self.rows.copy())]

    def _take_odometry(self, robot: int, newest: Newest) -> bool:
        topic = f"/odom{robot}"
        try:
            message = newest.take()
            if message is None:
                return False
            odom_from_base, twist = odometry_from_message(message)
            problem = odometry_problem(message.header.frame_id, odom_from_base, twist)
            if problem:
                raise ValueError(problem)
        except ValueError as error:
            self._warnings.warn(f"web: {topic}: message dropped: {error}", topic)
            return False
        map_from_odom = self._frames.find(MAP, message.header.frame_id)
        if map_from_odom is None:
            return False
        self.rows[robot] = body_row(map_from_odom.compose(odom_from_base), twist)
        self.heard_s[robot] = time.monotonic()
        self.stamp_s, self.wall_s = message.header.stamp.to_sec(), time.time()
        return True

    def at(self, robot: int, stamp_s: float) -> Optional[Pose3D]:
        """Return a robot's pose in `map` at a time, or the nearest that is known; None if none."""
        messages = list(self._messages)
        if messages and robot not in self._odometry:
            nearest_s, message = min(messages, key=lambda timed: abs(timed[0] - stamp_s))
            if abs(self._located[0] - nearest_s) > _SAME_S:
                self._located = nearest_s, self._read(message)
            states = self._located[1]
            rows = [] if states is None else states.poses[states.robots == robot].tolist()
        else:
            rows = self.rows[robot : robot + 1, :7].tolist()
        if not rows or not np.isfinite(rows[0]).all():
            return None
        x_m, y_m, z_m, *quaternion = rows[0]
        return Pose3D(x_m, y_m, z_m, tuple(quaternion))

    @property
    def positions(self) -> NDArray[np.float64]:
        """float64[n, 2], in `map`; NaN for robots not heard of."""
        return self.rows[:, :2]

    def ages_s(self) -> NDArray[np.float64]:
        """Return the wall time since each robot's last pose, float64[n]; inf before the first."""
        return np.asarray(time.monotonic() - self.heard_s)


def _rows(states: States) -> Floats:
    """Return the rows of states in `map`."""
    rows = np.empty((len(states.robots), 13))
    rows[:, :7] = states.poses
    yaw_rad = yaws_from_quaternions(states.poses[:, 3:])
    cos, sin = np.cos(yaw_rad), np.sin(yaw_rad)
    vx_mps, vy_mps = states.twists[:, 0], states.twists[:, 1]
    rows[:, 7], rows[:, 8] = cos * vx_mps - sin * vy_mps, sin * vx_mps + cos * vy_mps
    rows[:, 9:] = states.twists[:, 2:]
    return rows
