"""BARN's protocol: from where to where, how long, what counts and how it is scored.

Xiao et al., "Autonomous Ground Navigation in Highly Constrained Spaces"; the numbers are
those of the challenge's own runner.
"""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass
from typing import Optional, Tuple

from quad_nav.geometry import Pose2D

START = Pose2D(-2.25, 3.0, math.pi / 2)
"""In the worlds' frame, which is ``map`` here."""
GOAL_M: Tuple[float, float] = (-2.25, 13.0)
GOAL_TOLERANCE_M = 1.0
TIME_LIMIT_S = 100.0
OPTIMAL_SPEED_MPS = 2.0
CLIP = (2.0, 8.0)
"""The times that are told apart, in optimal times; the upper one was 4 before March 2026."""
SAMPLE_STEP = 6
"""Every sixth world, from 0 on, is in the official sample of 50."""


class Outcome(enum.Enum):
    SUCCESS = "success"
    COLLISION = "collision"
    TIME_OUT = "time-out"


@dataclass(frozen=True)
class Run:
    """One flight through one world.

    ``time_s`` from the goal to its end; the whole time limit after a time-out, also where
    ``gave_up`` says why the navigator had dropped the goal before. ``touched`` and
    ``touched_at_m`` are of the contact that ended it. ``min_clearance_m`` is between hulls.
    """

    world: int
    run: int
    seed: int
    outcome: Outcome
    time_s: float
    metric: float
    path_length_m: float
    min_clearance_m: float
    recoveries: int
    gave_up: str = ""
    touched: str = ""
    touched_at_m: Optional[Tuple[float, float]] = None

    @property
    def in_sample(self) -> bool:
        """Whether the world is one of the official sample."""
        return self.world % SAMPLE_STEP == 0


def metric(outcome: Outcome, time_s: float, path_length_m: float) -> float:
    """The challenge's score of a run: success * OT / clip(AT, 2 OT, 8 OT).

    AT is the time taken; OT is the time that the reference path, ``path_length_m``, takes at
    2 m/s. At best 1/2, and 1/8 for anything slow.
    """
    if outcome is not Outcome.SUCCESS:
        return 0.0
    optimal_s = path_length_m / OPTIMAL_SPEED_MPS
    least, most = CLIP
    return optimal_s / min(max(time_s, least * optimal_s), most * optimal_s)
