"""Protocol of the BARN benchmark: start, goal, time limit, outcomes and score.

Source: X. Xiao et al., "Autonomous Ground Navigation in Highly Constrained Spaces". The numbers
are those of the challenge's own runner.
"""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass
from typing import Optional, Tuple

from quad_nav.geometry import Pose2D

START = Pose2D(-2.25, 3.0, math.pi / 2)
"""Start pose in the worlds' frame, which is ``map`` here."""
GOAL_M: Tuple[float, float] = (-2.25, 13.0)
AREA: Tuple[float, float, float, float] = (-4.5, 2.0, 0.0, 14.0)
"""Least x and y, greatest x and y of the field between start and goal, a metre beyond both, m."""
GOAL_TOLERANCE_M = 1.0
TIME_LIMIT_S = 100.0
OPTIMAL_SPEED_MPS = 2.0
CLIP = (2.0, 8.0)
"""Limits of the scored time, in optimal times; the upper limit was 4 before March 2026."""
SAMPLE_STEP = 6
"""Step between the worlds of the official sample: 0, 6, ..., 50 worlds in total."""


class Outcome(enum.Enum):
    """Outcome of a run."""

    SUCCESS = "success"
    COLLISION = "collision"
    TIME_OUT = "time-out"


@dataclass(frozen=True)
class Run:
    """Flight through one world.

    Attributes:
        world: Number of the world.
        run: Number of the flight through this world.
        seed: Seed of the LIDAR's noise.
        outcome: Outcome.
        time_s: Time from sending the goal to its end; the time limit after a time-out.
        metric: Score, see ``metric``.
        path_length_m: Length of the flown path.
        min_clearance_m: Smallest distance from the hull to an obstacle.
        recoveries: Number of recovery behaviours.
        gave_up: Reason why the navigator aborted the goal before the time limit, or empty.
        touched: Name of the touched obstacle, or empty.
        touched_at_m: Position of that contact.
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
        """True if the world belongs to the official sample."""
        return self.world % SAMPLE_STEP == 0


def metric(outcome: Outcome, time_s: float, path_length_m: float) -> float:
    """Return the challenge's score of a run: success * OT / clip(AT, 2 OT, 8 OT).

    AT is the time taken. OT is the time for the reference path, ``path_length_m``, at 2 m/s. The
    best score is 1/2; a slow success scores 1/8.
    """
    if outcome is not Outcome.SUCCESS:
        return 0.0
    optimal_s = path_length_m / OPTIMAL_SPEED_MPS
    least, most = CLIP
    return optimal_s / min(max(time_s, least * optimal_s), most * optimal_s)
