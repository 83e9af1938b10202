"""Collect one robot's messages of a recording."""

from __future__ import annotations

from collections import defaultdict
from typing import Any, DefaultDict, List, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.geometry import Pose3D, Twist2D, yaw_from_quaternion, yaws_from_quaternions
from quad_nav.recording.bag_file import Message
from quad_nav.recording.messages import pose_from, stamp_ns
from quad_nav.recording.trace import RobotTrace, goal_traces
from quad_nav.topics.estimates import planar_covariance
from quad_nav.topics.flight_info import RobotInfo
from quad_nav.topics.mission_events import MissionEvent
from quad_nav.topics.robot_topics import RobotTopic
from quad_nav.topics.validation import path_problem, pose_problem, twist_problem


def require(problem: str) -> None:
    """Refuse a message that has a problem.

    Raises:
        ValueError: The problem is not empty.
    """
    if problem:
        raise ValueError(problem)


class BagRobot:
    """Collects messages and builds a ``RobotTrace``; times are the recording's until then.

    Its methods raise ValueError for messages that are not valid.

    Attributes:
        map_from_odom: Last pose of the odometry frame in ``map``.
        odom_frame: Name of the odometry frame; "" if the recording has no transform of it.
        moves: Rows of time, position, quaternion and velocity (vx, vy, vyaw), as it believes.
        events: Events of the sequencer.
    """

    def __init__(self) -> None:
        self.map_from_odom = Pose3D(0.0, 0.0, 0.0)
        self.odom_frame = ""
        self.moves: List[Tuple[float, ...]] = []
        self.events: List[MissionEvent] = []
        self._commands: List[Tuple[float, float, float, float]] = []
        self._cycles: List[float] = []
        self._truth: List[Tuple[float, ...]] = []  # rows of time, position and quaternion
        self._estimates: List[Tuple[float, NDArray[np.float64]]] = []  # times and covariances
        # (time, value) pairs by what they are, also the topics of ``ROBOT_TOPICS``.
        self._pairs: DefaultDict[str, List[Tuple[float, Any]]] = defaultdict(list)

    def set_odom_frame(self, time_s: float, frame: str, map_from_odom: Pose3D) -> None:
        """Place the odometry frame in ``map`` from a time on."""
        require(pose_problem(map_from_odom))
        if not self.odom_frame or map_from_odom != self.map_from_odom:
            self._pairs["odom_frames"].append((time_s, map_from_odom.to_2d()))
        self.odom_frame, self.map_from_odom = frame, map_from_odom

    def add_said(self, message: Message, topic: RobotTopic) -> None:
        """Add what the navigator says on a topic; what is unknown here is skipped."""
        value = topic.read(message.content)
        if value is not None:
            self._pairs[topic.name].append((message.stamp_ns / 1e9, value))

    def add_odometry(self, message: Message) -> None:
        """Add a ``nav_msgs/Odometry``."""
        odometry = message.content
        time_s = _seconds(odometry.header)
        if self.moves and time_s <= self.moves[-1][0]:
            return  # a paused simulation repeats its odometry
        pose = pose_from(odometry.pose.pose.position, odometry.pose.pose.orientation)
        require(pose_problem(pose))
        pose = self.map_from_odom.compose(pose)
        place = (pose.x_m, pose.y_m, pose.z_m, *pose.quaternion)
        self.moves.append((time_s, *place, *_planar(odometry.twist.twist)))

    def add_truth(self, time_s: float, pose: Pose3D) -> None:
        """Add where the robot is."""
        require(pose_problem(pose))
        if not self._truth or time_s > self._truth[-1][0]:
            self._truth.append((time_s, pose.x_m, pose.y_m, pose.z_m, *pose.quaternion))

    def add_estimate(self, message: Message) -> None:
        """Add how sure the robot is of its place."""
        time_s = _seconds(message.content.header)
        if not self._estimates or time_s > self._estimates[-1][0]:
            covariance = planar_covariance(message.content.pose.covariance)
            self._estimates.append((time_s, covariance))

    def add_command(self, message: Message) -> None:
        """Add a velocity command."""
        self._commands.append((message.stamp_ns / 1e9, *_planar(message.content)))

    def add_plan(self, message: Message) -> None:
        """Add a plan; an empty one removes an earlier plan with the same stamp.

        C++ move_base publishes NavFn's plan twice; the second one includes the goal and
        replaces the first.
        """
        time_s, poses, plans = _seconds(message.content.header), message.content.poses, "plans"
        if self._pairs[plans] and self._pairs[plans][-1][0] == time_s:
            self._pairs[plans].pop()
        if poses:
            plan = np.array([_place(pose.pose) for pose in poses])
            require(path_problem(plan))
            if message.content.header.frame_id.lstrip("/") == self.odom_frame:
                plan = self.map_from_odom.to_2d().transform_poses(plan)
            self._pairs[plans].append((time_s, plan))

    def add_cycle(self, message: Message) -> None:
        """Add a control cycle, from the action's feedback."""
        self._cycles.append(_seconds(message.content.feedback.base_position.header))

    def add_recovery(self, message: Message) -> None:
        """Add the start of a recovery behaviour."""
        status = message.content
        start = _seconds(status.pose_stamped.header), status.recovery_behavior_name
        self._pairs["recoveries"].append(start)

    def trace(self, start_s: float, info: RobotInfo) -> RobotTrace:
        """Build the trace.

        Args:
            start_s: Start of the flight on the recording's clock.
            info: What ``/quad/flight`` says of the robot.
        """
        moves, believed = self._placed()
        commands = np.array(self._commands).reshape(-1, 4)
        pairs = {
            name: tuple((time_s - start_s, value) for time_s, value in values)
            for name, values in self._pairs.items()
        }
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
            goals=goal_traces(self.events, start_s),
            parameters=info.parameters,
            mission=info.goals,
            **{name: pairs.pop(name, ()) for name in ("plans", "recoveries", "odom_frames")},
            states=pairs.get("state", ()),
            said=pairs,
            believed=believed,
            covariances=self._covariances(moves[:, 0]),
        )

    def _placed(self) -> Tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return ``moves`` with the true poses, and the believed ones (x, y, yaw).

        Without the truth, the believed poses are the best that is known.
        """
        moves, truth = np.array(self.moves), np.array(self._truth).reshape(-1, 8)
        _, rows, true_rows = np.intersect1d(moves[:, 0], truth[:, 0], return_indices=True)
        if not len(rows):
            return moves, np.zeros((0, 3))
        moves, truth = moves[rows], truth[true_rows]
        believed = np.column_stack([moves[:, 1:3], yaws_from_quaternions(moves[:, 4:8])])
        return np.column_stack([truth, moves[:, 8:]]), believed

    def _covariances(self, times_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the covariance of the last estimate at each time; NaN before the first."""
        if not self._estimates:
            return np.zeros((0, 3, 3))
        numbers = np.searchsorted([at_s for at_s, _ in self._estimates], times_s, side="right")
        return np.array([np.full((3, 3), np.nan), *(one for _, one in self._estimates)])[numbers]


def _planar(twist: Any) -> Tuple[float, float, float]:
    """Return (vx, vy, vyaw) of a ``geometry_msgs/Twist``."""
    velocity = twist.linear.x, twist.linear.y, twist.angular.z
    require(twist_problem(Twist2D(*velocity)))
    return velocity


def _place(pose: Any) -> Tuple[float, float, float]:
    q = pose.orientation
    return pose.position.x, pose.position.y, yaw_from_quaternion((q.x, q.y, q.z, q.w))


def _seconds(header: Any) -> float:
    return stamp_ns(header.stamp) / 1e9
