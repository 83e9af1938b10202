"""Goals of one robot, in the order in which it flies them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional, Tuple

from quad_nav.geometry import Pose2D


@dataclass(frozen=True)
class Goal:
    """Position in ``map``; without a yaw the robot may face in the direction of its path."""

    x_m: float
    y_m: float
    yaw_rad: Optional[float] = None

    @property
    def pose(self) -> Pose2D:
        """Pose in ``map``, with yaw 0 if the goal has none."""
        return Pose2D(self.x_m, self.y_m, self.yaw_rad or 0.0)


@dataclass(frozen=True)
class SequenceSettings:
    """Tolerance, retries and repetition; times are simulated if there is a simulation.

    Attributes:
        goal_tolerance_m: Distance from the goal within which it counts as reached.
        goal_timeout_s: Time for one attempt.
        retries: Further attempts before the goal is skipped.
        loop: Start again with the first goal after the last one.
    """

    goal_tolerance_m: float = 0.4
    goal_timeout_s: float = 120.0
    retries: int = 1
    loop: bool = False


DEFAULT_SETTINGS = SequenceSettings()


@dataclass(frozen=True)
class GoalSequence:
    """Content of a goal file."""

    goals: Tuple[Goal, ...]
    settings: SequenceSettings = DEFAULT_SETTINGS
