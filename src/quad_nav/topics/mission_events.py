"""What the sequencers do, as ``/quad/events`` tells it with ``quad/MissionEvent``."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Dict, Optional

from quad_nav.errors import assert_never
from quad_nav.geometry import Pose2D
from quad_nav.mission.actions import Action, Event, GoalEnded, Level, SendGoal, SequenceDone
from quad_nav.topics.validation import MAX_MAGNITUDE, shown_text

EVENTS_TOPIC = "/quad/events"
SUMMARY_TOPIC = "/quad/summary"
"""How the mission has ended, the JSON object of ``mission.summary`` as text; "" before that."""


@dataclass(frozen=True)
class MissionEvent:
    """An action of a sequencer.

    Attributes:
        time_s: Time of the action.
        robot: Number of the robot.
        event: What the action does.
        level: Whether people should look at it.
        text: One line for people.
        goal: Index of the goal in its file; 0 if all goals have ended, as the next.
        lap: Round through the goals, 1 for the first.
        attempts: How often the goal has been sent, this time included.
        reason: Why the goal is sent again or skipped.
        pose: The goal's pose in ``map``; None unless it is sent.
        yaw_error_rad: The robot's yaw less the goal's; None unless a goal with a yaw has ended.
    """

    time_s: float
    robot: int
    event: Event
    level: Level
    text: str
    goal: int = 0
    lap: int = 0
    attempts: int = 0
    reason: str = ""
    pose: Optional[Pose2D] = None
    yaw_error_rad: Optional[float] = None

    @property
    def fields(self) -> Dict[str, Any]:
        """The fields of a ``quad/MissionEvent``, apart from its header."""
        pose = self.pose or Pose2D(0.0, 0.0, 0.0)
        return {
            "robot": self.robot,
            "event": int(self.event),
            "level": int(self.level),
            "text": self.text,
            "goal": self.goal,
            "lap": self.lap,
            "attempts": self.attempts,
            "reason": self.reason,
            "x": pose.x_m,
            "y": pose.y_m,
            "yaw": pose.yaw_rad,
            "yaw_error": math.nan if self.yaw_error_rad is None else self.yaw_error_rad,
        }


def mission_event(robot: int, time_s: float, action: Action) -> MissionEvent:
    """Return the event of a robot's action."""
    about = time_s, robot, action.event, action.level, action.text
    if isinstance(action, SendGoal):
        goal = action.index, action.lap, action.attempt, action.resend_reason
        return MissionEvent(*about, *goal, pose=action.pose)
    if isinstance(action, GoalEnded):
        goal = action.index, action.lap, action.attempts, action.reason
        return MissionEvent(*about, *goal, yaw_error_rad=action.yaw_error_rad)
    if isinstance(action, SequenceDone):
        return MissionEvent(*about)
    assert_never(action)


def mission_event_from_message(message: Any, time_s: float) -> MissionEvent:
    """Read a ``quad/MissionEvent`` with this stamp, of rospy or of a recording.

    Raises:
        ValueError: A field is not valid.
    """
    event, level = Event(message.event), Level(message.level)
    pose = yaw_error_rad = None
    if event is Event.SENT:
        pose = Pose2D(message.x, message.y, message.yaw)
        if not all(abs(value) <= MAX_MAGNITUDE for value in (pose.x_m, pose.y_m, pose.yaw_rad)):
            raise ValueError(f"goal at {pose}, expected finite numbers up to {MAX_MAGNITUDE:g}")
    elif not math.isnan(message.yaw_error):
        yaw_error_rad = float(message.yaw_error)
        if abs(yaw_error_rad) > math.pi:
            raise ValueError(f"yaw_error: {yaw_error_rad:g}, expected -pi to pi, or NaN")
    return MissionEvent(
        time_s,
        message.robot,
        event,
        level,
        shown_text(message.text),
        message.goal,
        message.lap,
        message.attempts,
        shown_text(message.reason),
        pose,
        yaw_error_rad,
    )
