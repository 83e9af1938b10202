"""A robot that spins or stands: first another plan and more relaxed_obstacle_weight, then recoveries.

The original takes an in-place turn for valid control for ever.
"""

from __future__ import annotations

import enum
from typing import Any, Optional

from quad_nav.geometry import Pose2D
from quad_nav.navigator.fixes import Fixes
from quad_nav.recovery import ParameterLimit
from quad_nav.timing import StallTimer


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

    def look(self, now_s: float, pose: Pose2D, fixes: Fixes) -> StuckAction:
        """What is due for a robot at ``pose``; counting begins again with each remedy."""
        if self._stall_timer.has_moved(now_s, pose, fixes.progress_distance_m):
            self._has_replanned = False
        if not self._stall_timer.exceeds(now_s, fixes.progress_timeout_s):
            return StuckAction.NONE
        self._stall_timer.restart(now_s)
        if self._has_replanned:
            return StuckAction.RECOVERIES
        self._has_replanned = True
        return StuckAction.NEW_PLAN


def relaxed_obstacle_weight(
    params: Any, fixes: Fixes, distance_m: float
) -> Optional[ParameterLimit]:
    """Obstacle costs count for less until the robot has got away.

    A robot that spins has usually found that they outweigh all progress. What collides
    stays forbidden. None for a controller without ``occdist_scale``.
    """
    weight = getattr(params, "occdist_scale", None)
    if weight is None or fixes.stuck_cost_factor >= 1.0:
        return None
    return ParameterLimit((("occdist_scale", fixes.stuck_cost_factor * weight),), distance_m)
