"""What a sequencer does: each action carries its event, its level, and a line for people.

Code that tells actions apart ends in ``assert_never``, so that mypy finds what a new action lacks.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import Optional, Union

from quad_nav.geometry import Pose2D
from quad_nav.mission.goal import Goal


class Event(enum.IntEnum):
    """What an action does, numbered as in ``quad/MissionEvent``."""

    SENT, REACHED, SKIPPED, DONE = range(1, 5)


class Level(enum.IntEnum):
    """Whether people should look at an action, numbered as in ``quad/MissionEvent``."""

    INFO, WARNING = range(2)


@dataclass(frozen=True)
class SendGoal:
    """Action: send ``pose`` to the navigator.

    ``resend_reason`` says why the goal is sent again; it is empty the first time.
    """

    index: int
    lap: int
    pose: Pose2D
    attempt: int
    resend_reason: str = ""
    event = Event.SENT
    level = Level.INFO

    @property
    def text(self) -> str:
        """One line for people."""
        again = f", attempt {self.attempt}: {self.resend_reason}" if self.resend_reason else ""
        return f"goal {self.index + 1}: sent ({self.pose.x_m:.2f}, {self.pose.y_m:.2f}){again}"


@dataclass(frozen=True)
class GoalEnded:
    """Action: a goal is reached, or skipped for ``reason``.

    ``time_s`` is the time since it was first sent, ``yaw_error_rad`` the robot's yaw less the
    goal's; None for a goal without yaw. The robot stays for the goal's ``wait_s`` afterwards.
    """

    index: int
    lap: int
    goal: Goal
    reached: bool
    time_s: float
    attempts: int
    reason: str = ""
    yaw_error_rad: Optional[float] = None

    @property
    def event(self) -> Event:
        """Whether the goal is reached or skipped."""
        return Event.REACHED if self.reached else Event.SKIPPED

    @property
    def level(self) -> Level:
        """A warning for a skipped goal."""
        return Level.INFO if self.reached else Level.WARNING

    @property
    def text(self) -> str:
        """One line for people."""
        end = f"reached after {self.time_s:.1f} s" if self.reached else f"skipped: {self.reason}"
        return f"goal {self.index + 1}: {end}"


@dataclass(frozen=True)
class SequenceDone:
    """Action: all goals have ended."""

    event = Event.DONE
    level = Level.INFO
    text = "all goals have ended"


Action = Union[SendGoal, GoalEnded, SequenceDone]
