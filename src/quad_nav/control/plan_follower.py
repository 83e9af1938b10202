"""What the local planners have in common: a plan that is cut and pruned, a goal, a footprint."""

from __future__ import annotations

from typing import Any

import numpy as np

from quad_nav.control.plan_window import count_passed, plan_in_window
from quad_nav.errors import NoLocalPlan
from quad_nav.geometry import Pose2D
from quad_nav.grid import GridSpec

NO_POSES = np.zeros((0, 3))


class PlanFollower:
    """Remembers a plan and whether its goal was reached.

    Readable: ``plan`` float64[n, 3] (what is left of the global plan, in its
    own frame) and ``local_global_plan`` float64[m, 3] (its part in the window, in
    the local frame, also after a failed call). ``params`` has a ``prune_plan``.
    """

    def __init__(self, params: Any, footprint: np.ndarray, control_period_s: float):
        self.params = params
        self.control_period_s = control_period_s
        self.plan = NO_POSES
        self.local_global_plan = NO_POSES
        self.rotating_to_goal = False
        self.xy_tolerance_latch = False
        self._goal_reached = False
        self.set_footprint(footprint)

    def set_params(self, params: Any) -> None:
        """Take new parameters; plan and state stay, but the goal is no longer reached."""
        self.params = params
        self._goal_reached = False

    def set_footprint(self, footprint: np.ndarray) -> None:
        """The padded footprint, float64[n, 2] in the robot's frame."""
        self.footprint = np.array(footprint, dtype=np.float64)

    def set_plan(self, plan: np.ndarray) -> None:
        """A new global plan, float64[n, 3] rows x, y, yaw; the goal is to be reached anew."""
        self.plan = np.array(plan, dtype=np.float64).reshape(-1, 3)
        self.xy_tolerance_latch = False
        self._goal_reached = False

    def is_goal_reached(self) -> bool:
        """Whether the robot was found at the goal, heading included."""
        return self._goal_reached

    def _cut_plan(self, spec: GridSpec, pose: Pose2D, local_from_plan: Pose2D) -> np.ndarray:
        """The plan's part in the window. Raises NoLocalPlan when there is none."""
        self.local_global_plan = NO_POSES
        if not len(self.plan):
            raise NoLocalPlan("there is no global plan to follow")
        plan = plan_in_window(self.plan, spec, pose, local_from_plan)
        if self.params.prune_plan:
            passed = count_passed(plan, pose)
            plan, self.plan = plan[passed:], self.plan[passed:]
        if not len(plan):
            raise NoLocalPlan(
                f"the global plan does not come near the robot at "
                f"({pose.x_m:.2f}, {pose.y_m:.2f}) m"
            )
        self.local_global_plan = plan
        return plan
