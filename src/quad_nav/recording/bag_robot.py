"""One quadcopter's part of a recording."""

from __future__ import annotations

from typing import Any, Dict, List, Mapping, Tuple

import numpy as np

from quad_nav.geometry import Pose2D, Pose3D, yaw_from_quaternion
from quad_nav.navigator.tick import State
from quad_nav.recording.bag_file import Message
from quad_nav.recording.bag_info import checked_pose, finite
from quad_nav.recording.messages import pose_from, stamp_ns
from quad_nav.recording.trace import GoalTrace, RobotTrace

_STATES = {state.value: state for state in State}


class BagRobot:
    """Takes messages and becomes a ``RobotTrace``; times are the recording's clock until then."""

    def __init__(self) -> None:
        self.map_from_odom = Pose3D(0.0, 0.0, 0.0)
        self._moves: List[Tuple[float, ...]] = []
        self._commands: List[Tuple[float, float, float, float]] = []
        self._cycles: List[float] = []
        self._plans: List[Tuple[float, np.ndarray]] = []
        self._states: List[Tuple[float, State]] = []
        self._recoveries: List[Tuple[float, str]] = []
        self._goals: List[Dict[str, Any]] = []

    @property
    def has_moved(self) -> bool:
        """Whether there is any odometry."""
        return bool(self._moves)

    @property
    def first_s(self) -> float:
        """When the first odometry was."""
        return self._moves[0][0]

    @property
    def last_s(self) -> float:
        """When the last odometry was."""
        return self._moves[-1][0]

    def move(self, message: Message) -> None:
        odometry = message.content
        time_s = _seconds(odometry.header)
        if self._moves and time_s <= self._moves[-1][0]:
            return  # told again by a paused simulation
        pose = self.map_from_odom.compose(
            checked_pose(pose_from(odometry.pose.pose.position, odometry.pose.pose.orientation))
        )
        twist = odometry.twist.twist
        finite((twist.linear.x, twist.linear.y, twist.angular.z))
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

    def command(self, message: Message) -> None:
        twist = message.content
        finite((twist.linear.x, twist.linear.y, twist.angular.z))
        self._commands.append(
            (message.stamp_ns / 1e9, twist.linear.x, twist.linear.y, twist.angular.z)
        )

    def plan(self, message: Message) -> None:
        """The original tells NavFn's plan twice, then with the goal; an empty one is none."""
        time_s, poses = _seconds(message.content.header), message.content.poses
        if self._plans and self._plans[-1][0] == time_s:
            self._plans.pop()
        if poses:
            plan = np.array([_planar(one.pose) for one in poses])
            finite((float(np.abs(plan).max()),))
            self._plans.append((time_s, plan))

    def state(self, message: Message) -> None:
        state = _STATES.get(message.content.data)
        if state is not None:
            self._states.append((message.stamp_ns / 1e9, state))

    def cycle(self, message: Message) -> None:
        self._cycles.append(_seconds(message.content.feedback.base_position.header))

    def recovery(self, message: Message) -> None:
        status = message.content
        self._recoveries.append(
            (_seconds(status.pose_stamped.header), status.recovery_behavior_name)
        )

    def event(self, event: Dict[str, Any]) -> None:
        """What the sequencer did, as ``checked_event`` has it."""
        if event["event"] == "sent" and not event["why"]:
            self._goals.append(event)
        elif event["event"] == "ended" and self._goals:
            self._goals[-1] = {
                **self._goals[-1],
                "ended_s": event["time_s"],
                "reached": event["reached"],
                "reason": event["reason"],
                "attempts": event["attempts"],
            }

    def trace(self, number: int, start_s: float, told: Mapping[str, Any]) -> RobotTrace:
        """``told`` is what ``/quad/flight`` says about it."""
        moves = np.array(self._moves)
        commands = np.array(self._commands).reshape(-1, 4)
        return RobotTrace(
            told.get("name", f"quad{number}"),
            moves[:, 0] - start_s,
            moves[:, 1:4],
            moves[:, 4:8],
            moves[:, 8:],
            commands[:, 0] - start_s,
            commands[:, 1:],
            np.array(self._cycles) - start_s,
            np.zeros(0),
            tuple((time_s - start_s, plan) for time_s, plan in self._plans),
            tuple((time_s - start_s, state) for time_s, state in self._states),
            tuple((time_s - start_s, name) for time_s, name in self._recoveries),
            tuple(_goal(event, start_s) for event in self._goals),
            told.get("parameters", {}),
        )


def _goal(event: Mapping[str, Any], start_s: float) -> GoalTrace:
    ended_s = event.get("ended_s")
    return GoalTrace(
        event["goal"],
        event["lap"],
        Pose2D(event["x_m"], event["y_m"], event["yaw_rad"]),
        event["time_s"] - start_s,
        None if ended_s is None else ended_s - start_s,
        event.get("reached", False),
        event.get("reason", ""),
        event.get("attempts", 1),
    )


def _planar(pose: Any) -> Tuple[float, float, float]:
    q = pose.orientation
    return pose.position.x, pose.position.y, yaw_from_quaternion((q.x, q.y, q.z, q.w))


def _seconds(header: Any) -> float:
    return stamp_ns(header.stamp) / 1e9
