"""Progress of one robot through its goals: what a journal keeps and a sequencer resumes from."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Optional

from quad_nav.geometry import Pose2D
from quad_nav.mission.goal import Goal


@dataclass(frozen=True)
class ActiveGoal:
    """Goal that the robot flies to.

    Attributes:
        goal: The goal as in the goal file.
        pose: The pose that was sent, with the yaw that was chosen.
        first_sent_s: Time of the first attempt.
        sent_s: Start of the present attempt.
        attempt: 1 for the first one.
        replaced: The navigator flies another node's goal instead.
    """

    goal: Goal
    pose: Pose2D
    first_sent_s: float
    sent_s: float
    attempt: int = 1
    replaced: bool = False


@dataclass(frozen=True)
class Dwell:
    """Stay at a goal that was reached at ``since_s``, for its ``wait_s``."""

    goal: Goal
    since_s: float

    @property
    def until_s(self) -> float:
        """Time from which the next goal is due."""
        return self.since_s + self.goal.wait_s


@dataclass(frozen=True)
class SequenceProgress:
    """Snapshot of a sequencer.

    Attributes:
        index: Index of the active or next goal.
        lap: Round through the goals, 1 for the first.
        active_goal: The goal that the robot flies to.
        dwell: The stay at the goal before ``index``.
        held_s: Time at which the robot's mission was stopped; None if it is not stopped.
    """

    index: int = 0
    lap: int = 1
    active_goal: Optional[ActiveGoal] = None
    dwell: Optional[Dwell] = None
    held_s: Optional[float] = None

    def shifted(self, by_s: float) -> SequenceProgress:
        """Return the same progress with all times later by ``by_s``."""
        active, dwell, held_s = self.active_goal, self.dwell, self.held_s
        if active is not None:
            active = replace(
                active, first_sent_s=active.first_sent_s + by_s, sent_s=active.sent_s + by_s
            )
        if dwell is not None:
            dwell = replace(dwell, since_s=dwell.since_s + by_s)
        if held_s is not None:
            held_s += by_s
        return replace(self, active_goal=active, dwell=dwell, held_s=held_s)


START = SequenceProgress()
