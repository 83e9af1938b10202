"""The goals of one quadcopter and how they are flown."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional, Tuple

from quad_nav.geometry import Pose2D


@dataclass(frozen=True)
class Goal:
    """A place in ``map``; without a yaw the quadcopter may face along its way."""

    x_m: float
    y_m: float
    yaw_rad: Optional[float] = None

    @property
    def pose(self) -> Pose2D:
        return Pose2D(self.x_m, self.y_m, self.yaw_rad or 0.0)


@dataclass(frozen=True)
class SequenceSettings:
    """How a sequence is flown; times are simulated time where there is a simulation.

    ``goal_timeout_s`` is the time for one attempt; a goal gets ``retries`` more
    attempts before it is skipped.
    """

    goal_tolerance_m: float = 0.4
    goal_timeout_s: float = 120.0
    retries: int = 1
    loop: bool = False


DEFAULT_SETTINGS = SequenceSettings()


@dataclass(frozen=True)
class GoalSequence:
    """What one goal file says."""

    goals: Tuple[Goal, ...]
    settings: SequenceSettings = DEFAULT_SETTINGS
