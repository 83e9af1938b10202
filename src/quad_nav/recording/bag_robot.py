"""Collect one robot's messages of a recording."""

from __future__ import annotations

from typing import Any, Dict, List, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.geometry import Pose2D, Pose3D, yaw_from_quaternion
from quad_nav.recording.bag_checks import checked_pose, require_finite
from quad_nav.recording.bag_file import Message
from quad_nav.recording.messages import pose_from, stamp_ns
from quad_nav.recording.trace import RobotTrace, goal_traces
from quad_nav.topics.flight_info import RobotInfo
from quad_nav.topics.mission_events import MissionEvent
from quad_nav.topics.robot_topics import RobotTopic


class BagRobot:
    """Collects messages and builds a ``RobotTrace``; times are the recording's until then.

    Attributes:
        map_from_odom: Last pose of the odometry frame in ``map``.
        odom_frame: Name of the odometry frame; "" if the recording has no transform of it.
    """

    def __init__(self) -> None:
        self.map_from_odom = Pose3D(0.0, 0.0, 0.0)
        self.odom_frame = ""
        self._odom_frames: List[Tuple[float, Pose2D]] = []
        self._said: Dict[str, List[Tuple[float, Any]]] = {}
        self._moves: List[Tuple[float, ...]] = []
        self._commands: List[Tuple[float, float, float, float]] = []
        self._cycles: List[float] = []
        self._plans: List[Tuple[float, NDArray[np.float64]]] = []
        self._recoveries: List[Tuple[float, str]] = []
        self._events: List[MissionEvent] = []

    @property
    def has_odometry(self) -> bool:
        """True if any odometry was added."""
        return bool(self._moves)

    @property
    def first_s(self) -> float:
        """Time of the first odometry."""
        return self._moves[0][0]

    @property
    def last_s(self) -> float:
        """Time of the last odometry."""
        return self._moves[-1][0]

    def set_odom_frame(self, time_s: float, frame: str, map_from_odom: Pose3D) -> None:
        """Place the odometry frame in ``map`` from a time on."""
        if not self.odom_frame or map_from_odom != self.map_from_odom:
            self._odom_frames.append((time_s, map_from_odom.to_2d()))
        self.odom_frame, self.map_from_odom = frame, map_from_odom

    def add_said(self, message: Message, topic: RobotTopic) -> None:
        """Add what the navigator says on a topic; what is unknown here is skipped.

        Raises:
            ValueError: The message is not valid.
        """
        value = topic.read(message.content)
        if value is not None:
            self._said.setdefault(topic.name, []).append((message.stamp_ns / 1e9, value))

    def add_odometry(self, message: Message) -> None:
        """Add a ``nav_msgs/Odometry``.

        Raises:
            ValueError: The pose or the velocity is invalid.
        """
        odometry = message.content
        time_s = _seconds(odometry.header)
        if self._moves and time_s <= self._moves[-1][0]:
            return  # a paused simulation repeats its odometry
        pose = self.map_from_odom.compose(
            checked_pose(pose_from(odometry.pose.pose.position, odometry.pose.pose.orientation))
        )
        twist = odometry.twist.twist
        require_finite((twist.linear.x, twist.linear.y, twist.angular.z))
        self._moves.append(
            (
                time_s,
                pose.x_m,
                pose.y_m,
                pose.z_m,
                *pose.quaternion,
                twist.linear.x,
                twist.linear.y,
                twist.angular.z,
            )
        )

    def add_command(self, message: Message) -> None:
        """Add a velocity command.

        Raises:
            ValueError: The command is not finite.
        """
        twist = message.content
        require_finite((twist.linear.x, twist.linear.y, twist.angular.z))
        self._commands.append(
            (message.stamp_ns / 1e9, twist.linear.x, twist.linear.y, twist.angular.z)
        )

    def add_plan(self, message: Message) -> None:
        """Add a plan; an empty one removes an earlier plan with the same stamp.

        C++ move_base publishes NavFn's plan twice; the second one includes the goal and
        replaces the first.

        Raises:
            ValueError: The plan is not finite.
        """
        time_s, poses = _seconds(message.content.header), message.content.poses
        if self._plans and self._plans[-1][0] == time_s:
            self._plans.pop()
        if poses:
            plan = np.array([_planar(pose.pose) for pose in poses])
            require_finite((float(np.abs(plan).max()),))
            if message.content.header.frame_id.lstrip("/") == self.odom_frame:
                plan = self.map_from_odom.to_2d().transform_poses(plan)
            self._plans.append((time_s, plan))

    def add_cycle(self, message: Message) -> None:
        """Add a control cycle, from the action's feedback."""
        self._cycles.append(_seconds(message.content.feedback.base_position.header))

    def add_recovery(self, message: Message) -> None:
        """Add the start of a recovery behaviour."""
        status = message.content
        self._recoveries.append(
            (_seconds(status.pose_stamped.header), status.recovery_behavior_name)
        )

    def add_event(self, event: MissionEvent) -> None:
        """Add an event of the sequencer."""
        self._events.append(event)

    def trace(self, start_s: float, info: RobotInfo) -> RobotTrace:
        """Build the trace.

        Args:
            start_s: Start of the flight on the recording's clock.
            info: What ``/quad/flight`` says of the robot.
        """
        moves = np.array(self._moves)
        said = {
            name: tuple((time_s - start_s, value) for time_s, value in values)
            for name, values in self._said.items()
        }
        commands = np.array(self._commands).reshape(-1, 4)
        return RobotTrace(
            info.name,
            moves[:, 0] - start_s,
            moves[:, 1:4],
            moves[:, 4:8],
            moves[:, 8:],
            commands[:, 0] - start_s,
            commands[:, 1:],
            np.array(self._cycles) - start_s,
            np.zeros(0),
            tuple((time_s - start_s, plan) for time_s, plan in self._plans),
            said.get("state", ()),
            tuple((time_s - start_s, name) for time_s, name in self._recoveries),
            goal_traces(self._events, start_s),
            info.parameters,
            info.goals,
            tuple((time_s - start_s, pose) for time_s, pose in self._odom_frames),
            said,
        )


def _planar(pose: Any) -> Tuple[float, float, float]:
    q = pose.orientation
    return pose.position.x, pose.position.y, yaw_from_quaternion((q.x, q.y, q.z, q.w))


def _seconds(header: Any) -> float:
    return stamp_ns(header.stamp) / 1e9
