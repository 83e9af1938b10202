"""How long a robot has stayed where it is."""
from __future__ import annotations

import math
from typing import Optional

from quad_nav.geometry import Pose2D


class Standstill:
    """Watches whether a robot gets away from where it was last seen to have moved."""

    def __init__(self) -> None:
        self._reference: Optional[Pose2D] = None
        self._since_s = math.inf

    def restart(self, now_s: float) -> None:
        """Counts from now; the reference stays."""
        self._since_s = now_s

    def has_moved(self, now_s: float, pose: Pose2D, distance_m: float) -> bool:
        """Whether the robot is that far from the reference, which it then becomes."""
        if self._reference is not None and pose.distance_to(self._reference) < distance_m:
            return False
        self._reference = pose
        self._since_s = now_s
        return True

    def exceeds(self, now_s: float, timeout_s: float) -> bool:
        """Whether it has lasted longer than a time-out; 0 means that there is none."""
        return timeout_s > 0.0 and now_s > self._since_s + timeout_s
