"""A robot that spins or stands: first another plan and more relaxed_obstacle_weight, then recoveries.

The original takes an in-place turn for valid control for ever.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import Any, Optional

from quad_nav.geometry import Pose2D
from quad_nav.recovery import ParameterLimit
from quad_nav.timing import StallTimer


@dataclass(frozen=True)
class ProgressParams:
    """Parameters of the progress checker.

    Attributes:
        timeout_s: Seconds within ``distance_m`` until a new plan, and as many again until
            the recoveries; 0 disables the checker.
        distance_m: A robot that has moved so far makes progress.
        stuck_cost_factor: Factor of the obstacle weight from the new plan on, until the
            robot has moved; 1 keeps the weight.
    """

    timeout_s: float = 10.0
    distance_m: float = 0.1
    stuck_cost_factor: float = 0.1


class StuckAction(enum.Enum):
    NONE = "it gets on"
    NEW_PLAN = "a new plan"
    RECOVERIES = "recoveries"


class ProgressChecker:
    """Counts how long a robot has stayed within ``progress_distance_m``."""

    def __init__(self) -> None:
        self._stall_timer = StallTimer()
        self._has_replanned = False

    def restart(self, now_s: float) -> None:
        """Counts from now."""
        self._stall_timer.restart(now_s)

    def begin_anew(self, now_s: float) -> None:
        """Counts from now, and the next remedy is the first one again."""
        self.restart(now_s)
        self._has_replanned = False

    def look(self, now_s: float, pose: Pose2D, params: ProgressParams) -> StuckAction:
        """What is due for a robot at ``pose``; counting begins again with each remedy."""
        if self._stall_timer.has_moved(now_s, pose, params.distance_m):
            self._has_replanned = False
        if not self._stall_timer.exceeds(now_s, params.timeout_s):
            return StuckAction.NONE
        self._stall_timer.restart(now_s)
        if self._has_replanned:
            return StuckAction.RECOVERIES
        self._has_replanned = True
        return StuckAction.NEW_PLAN


def relaxed_obstacle_weight(
    params: Any, factor: float, distance_m: float
) -> Optional[ParameterLimit]:
    """Obstacle costs count for less until the robot has got away.

    A robot that spins has usually found that they outweigh all progress. What collides
    stays forbidden. None for a controller without ``occdist_scale``.
    """
    weight = getattr(params, "occdist_scale", None)
    if weight is None or factor >= 1.0:
        return None
    return ParameterLimit((("occdist_scale", factor * weight),), distance_m)
