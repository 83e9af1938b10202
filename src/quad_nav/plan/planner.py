"""What the navigator asks of a global planner."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from quad_nav.geometry import Pose2D
from quad_nav.grid import GridSpec


class GlobalPlanner(Protocol):
    """Makes a path over the global costmap."""

    def make_plan(
        self, spec: GridSpec, costs: np.ndarray, start: Pose2D, goal: Pose2D
    ) -> np.ndarray:
        """A plan from start to goal, float64[n, 3] rows x, y, yaw.

        ``costs`` is the global costmap's own uint8[H, W] on ``spec``; start, goal
        and plan are in its frame. The last row is where the robot is to end, and
        which way it is to look there. Raises a ``PlanningError`` when there is no
        plan; a plan returned is never empty.
        """
        ...
