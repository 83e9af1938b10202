"""One robot of a recorded flight at any time."""

from __future__ import annotations

import bisect
import math
from dataclasses import replace
from typing import Any, Dict, List, Optional, Sequence, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.geometry import Pose2D, Pose3D
from quad_nav.mission.goal import Goal
from quad_nav.recording.trace import GoalTrace, RobotTrace
from quad_nav.topics.right_of_way import RightOfWay
from quad_nav.topics.robot_topics import COLUMNS, goal_distance_m
from quad_web.view import rows
from quad_web.view.items import TRAIL_POINTS, TRAIL_SPACING_M, UNKNOWN_BODY
from quad_web.view.localization import Located

_DEFAULT_RECOVERIES = 4  # of move_base
LOST_AFTER_S = 1.0
"""A robot without a pose for so long is lost: recorded time has no delays, and over longer gaps
poses are not interpolated."""


RecordedEvent = Tuple[float, str, str, Optional[int]]
"""Time, text, level and robot of an entry of the log of events."""


class RobotTrack:
    """One robot's trace at any time.

    Attributes:
        robot: The trace.
        goals: The goals of the mission.
    """

    def __init__(self, robot: RobotTrace) -> None:
        """Look up a trace."""
        self.robot = robot
        self.goals = robot.mission or _flown_goals(robot.goals)
        self._state_times_s = [time_s for time_s, _ in robot.states]
        self._plan_times_s = [time_s for time_s, _ in robot.plans]
        self._said_times_s = {
            name: [time_s for time_s, _ in values] for name, values in robot.said.items()
        }
        self._sent_s = [goal.sent_s for goal in robot.goals]
        self._spaced = _spaced(robot.positions_m[:, :2])

    def body(self, time_s: float) -> NDArray[np.float64]:
        """Return the row of ``poses_item`` at a time, float64[13], between two samples."""
        robot = self.robot
        after = int(np.searchsorted(robot.times_s, time_s, side="right"))
        if after == 0 and time_s < robot.times_s[0]:
            return np.array(UNKNOWN_BODY)
        k, end = after - 1, min(after, len(robot.times_s) - 1)
        span_s = robot.times_s[end] - robot.times_s[k]
        part = (time_s - robot.times_s[k]) / span_s if 0.0 < span_s <= LOST_AFTER_S else 0.0
        first, last = robot.quaternions[k], robot.quaternions[end]
        last = last if float(first @ last) >= 0.0 else -last
        quaternion = (1.0 - part) * first + part * last
        quaternion /= math.sqrt(float(quaternion @ quaternion))
        position = (1.0 - part) * robot.positions_m[k] + part * robot.positions_m[end]
        vx_mps, vy_mps, turn_radps = robot.velocities[k].tolist()
        yaw_rad = Pose3D(0.0, 0.0, 0.0, tuple(quaternion.tolist())).yaw_rad
        vx_mps, vy_mps = Pose2D(0.0, 0.0, yaw_rad).rotate(vx_mps, vy_mps)
        velocities = (vx_mps, vy_mps, 0.0, 0.0, 0.0, turn_radps)
        return np.concatenate((position, quaternion, velocities))

    def positions(self, times_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the positions at some times, float64[t, 2]; NaN before and after the recording."""
        robot = self.robot
        return np.column_stack(
            [
                np.interp(times_s, robot.times_s, axis_m, left=np.nan, right=np.nan)
                for axis_m in robot.positions_m[:, :2].T
            ]
        )

    def pose(self, time_s: float) -> Optional[Pose3D]:
        """Return the pose in ``map`` at a time, None before the first one."""
        x_m, y_m, z_m, *quaternion = self.body(time_s)[:7].tolist()
        return None if math.isnan(x_m) else Pose3D(x_m, y_m, z_m, tuple(quaternion))

    def age_s(self, time_s: float) -> float:
        """Return the age of the last pose; 0 before the first one."""
        times_s = self.robot.times_s
        number = int(np.searchsorted(times_s, time_s, side="right")) - 1
        return max(0.0, time_s - float(times_s[max(number, 0)]))

    def located(self, time_s: float) -> Optional[Located]:
        """Return where the robot believes itself; None if it knows its place, or before a pose."""
        robot = self.robot
        number = int(np.searchsorted(robot.times_s, time_s, side="right")) - 1
        if number < 0 or not robot.is_localized:
            return None
        x_m, y_m, z_m = robot.positions_m[number].tolist()
        here = Pose3D(x_m, y_m, z_m, tuple(robot.quaternions[number].tolist())).to_2d()
        covariances = robot.covariances
        known = Located(covariance=covariances[number]) if len(covariances) else Located()
        if not len(robot.believed):
            return replace(known, pose=here)
        return replace(known, pose=Pose2D(*robot.believed[number].tolist()), truth=here)

    def trail_end(self, time_s: float) -> int:
        """Return how many points of the spaced path there are up to a time."""
        end = int(np.searchsorted(self.robot.times_s, time_s, side="right"))
        return int(np.searchsorted(self._spaced, end))

    def trail(self, end: int) -> NDArray[np.float64]:
        """Return the points before ``trail_end``, float64[k, 2]."""
        return self.robot.positions_m[self._spaced[max(0, end - TRAIL_POINTS) : end], :2]

    def leg(self, time_s: float) -> Optional[GoalTrace]:
        """Return the goal that was sent last."""
        number = bisect.bisect_right(self._sent_s, time_s) - 1
        return self.robot.goals[number] if number >= 0 else None

    @staticmethod
    def is_active(leg: GoalTrace, time_s: float) -> bool:
        """Return whether a goal that was sent has not ended at a time."""
        return leg.ended_s is None or leg.ended_s > time_s

    def goal_rows(self, row: int, time_s: float) -> List[Dict[str, Any]]:
        """Return the rows of the item ``goals``."""
        leg = self.leg(time_s)
        if leg is None:
            return rows.goal_rows(row, self.goals, 0, False)
        is_active = self.is_active(leg, time_s)
        failed = {
            one.index
            for one in self.robot.goals
            if one.lap == leg.lap and not one.reached and not self.is_active(one, time_s)
        }
        index = leg.index if is_active else leg.index + 1
        return rows.goal_rows(row, self.goals, index, is_active, failed)

    def plan_number(self, time_s: float) -> Optional[int]:
        """Return the number of the plan that is followed."""
        number = bisect.bisect_right(self._plan_times_s, time_s) - 1
        leg = self.leg(time_s)
        has_ended = leg is not None and not self.is_active(leg, time_s)
        return None if number < 0 or has_ended else number

    def _state(self, time_s: float) -> str:
        """Return the navigator's state; what the goals tell if the recording has no states."""
        number = bisect.bisect_right(self._state_times_s, time_s) - 1
        if number >= 0:
            return self.robot.states[number][1].value
        leg = self.leg(time_s)
        return "idle" if leg is None or not self.is_active(leg, time_s) else "controlling"

    def now(self, time_s: float) -> rows.RobotNow:
        """Return what is known of the robot at a time."""
        leg, goals, age_s = self.leg(time_s), self.goals, self.age_s(time_s)
        is_active = leg is not None and self.is_active(leg, time_s)
        is_done = leg is not None and not is_active and 0 < len(goals) <= leg.index + 1
        right = self._said("right_of_way", time_s) or RightOfWay()
        located = self.located(time_s)
        return rows.RobotNow(
            self._state(time_s),
            right.decision,
            right.limited_by,
            is_done=is_done,
            is_lost=age_s > LOST_AFTER_S,
            goal=leg.index + 1 if leg is not None and is_active else None,
            goals=len(goals) or None,
            said=self._columns(time_s),
            recoveries=self._recoveries(time_s),
            age_s=age_s,
            localization=None if located is None else located.row(),
        )

    def _said(self, name: str, time_s: float) -> Any:
        """Return what the robot said last on a topic of ``ROBOT_TOPICS``; None if nothing."""
        number = bisect.bisect_right(self._said_times_s.get(name, ()), time_s) - 1
        return self.robot.said[name][number][1] if number >= 0 else None

    def _columns(self, time_s: float) -> Dict[str, float]:
        """Return the numbers of the topics in ``COLUMNS``; the distance to the goal is computed."""
        leg, pose = self.leg(time_s), self.pose(time_s)
        goal = leg.pose if leg is not None and self.is_active(leg, time_s) else None
        said = {topic.name: self._said(topic.name, time_s) for topic in COLUMNS}
        here = None if pose is None else pose.to_2d()
        known = {name: value for name, value in said.items() if value is not None}
        return {**known, "goal_distance": goal_distance_m(goal, here)}

    def _recoveries(self, time_s: float) -> Tuple[int, int]:
        """Return how many recovery behaviours began for the present goal, and how many exist."""
        leg = self.leg(time_s)
        since_s = -math.inf if leg is None else leg.sent_s
        begun = sum(since_s <= at_s <= time_s for at_s, _ in self.robot.recoveries)
        parameters = self.robot.parameters
        listed = parameters.get("recovery_behaviors")
        usual = _DEFAULT_RECOVERIES if parameters else 0
        return begun, max(begun, len(listed) if isinstance(listed, list) else usual)


def _spaced(positions_m: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return the indices of positions float64[n, 2] that are ``TRAIL_SPACING_M`` apart."""
    kept: List[int] = []
    x0_m, y0_m = math.inf, math.inf
    for number, (x_m, y_m) in enumerate(positions_m.tolist()):
        if not math.hypot(x_m - x0_m, y_m - y0_m) < TRAIL_SPACING_M:
            kept.append(number)
            x0_m, y0_m = x_m, y_m
    return np.array(kept, np.int64)


def _flown_goals(flown: Sequence[GoalTrace]) -> Tuple[Goal, ...]:
    """Return the goals that were sent, where the recording does not have those of the file."""
    known = {goal.index: Goal(goal.pose.x_m, goal.pose.y_m) for goal in flown}
    return (
        tuple(known[k] for k in range(len(known))) if set(known) == set(range(len(known))) else ()
    )


def events_of(robots: Sequence[RobotTrace]) -> List[RecordedEvent]:
    """Return what happened to goals, recoveries and peers."""
    events: List[RecordedEvent] = []
    for row, robot in enumerate(robots):
        for goal in robot.goals:
            name = f"goal {goal.index + 1}"
            place = f"({goal.pose.x_m:.2f}, {goal.pose.y_m:.2f})"
            events.append((goal.sent_s, f"{name}: sent {place}", "info", row))
            if goal.ended_s is not None and goal.reached:
                text = f"{name}: reached after {goal.ended_s - goal.sent_s:.1f} s"
                events.append((goal.ended_s, text, "info", row))
            elif goal.ended_s is not None:
                events.append((goal.ended_s, f"{name}: skipped: {goal.reason}", "warning", row))
        for at_s, recovery in robot.recoveries:
            events.append((at_s, f"recovery {recovery}", "warning", row))
        for at_s, right in robot.said.get("right_of_way", ()):
            if right.decision is not None:
                events.append((at_s, right.text, "info", row))
    return events
