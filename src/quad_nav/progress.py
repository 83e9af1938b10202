"""A robot that spins or stands: first another plan and more daring, then recoveries.

The original takes an in-place turn for valid control for ever.
"""
from __future__ import annotations

import enum
from typing import Any, Optional

from quad_nav.geometry import Pose2D
from quad_nav.mends import Mends
from quad_nav.recovery import ParameterLimit
from quad_nav.standstill import Standstill


class Remedy(enum.Enum):
    NONE = "it gets on"
    NEW_PLAN = "a new plan"
    RECOVERIES = "recoveries"


class ProgressWatch:
    """Counts how long a robot has stayed within ``progress_distance_m``."""

    def __init__(self) -> None:
        self._standstill = Standstill()
        self._has_replanned = False

    def restart(self, now_s: float) -> None:
        """Counts from now."""
        self._standstill.restart(now_s)

    def begin_anew(self, now_s: float) -> None:
        """Counts from now, and the next remedy is the first one again."""
        self.restart(now_s)
        self._has_replanned = False

    def look(self, now_s: float, pose: Pose2D, mends: Mends) -> Remedy:
        """What is due for a robot at ``pose``; counting begins again with each remedy."""
        if self._standstill.has_moved(now_s, pose, mends.progress_distance_m):
            self._has_replanned = False
        if not self._standstill.exceeds(now_s, mends.progress_timeout_s):
            return Remedy.NONE
        self._standstill.restart(now_s)
        if self._has_replanned:
            return Remedy.RECOVERIES
        self._has_replanned = True
        return Remedy.NEW_PLAN


def daring(params: Any, mends: Mends, distance_m: float) -> Optional[ParameterLimit]:
    """Obstacle costs count for less until the robot has got away.

    A robot that spins has usually found that they outweigh all progress. What collides
    stays forbidden. None for a controller without ``occdist_scale``.
    """
    weight = getattr(params, "occdist_scale", None)
    if weight is None or mends.stuck_cost_factor >= 1.0:
        return None
    return ParameterLimit((("occdist_scale", mends.stuck_cost_factor * weight),), distance_m)
