"""Common part of the local planners: a plan that is cut and pruned, a goal, a footprint."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quad_nav.control.plan_follower_kernel import count_farther, stretch_near
from quad_nav.errors import NoLocalPlan
from quad_nav.geometry import Pose2D
from quad_nav.grid import GridSpec

NO_POSES = np.zeros((0, 3))
_PASSED_BEYOND_M = 1.0


class PlanFollower:
    """Base of the local planners; remembers a plan and whether its goal was reached.

    Attributes:
        params: Parameters, with a ``prune_plan``.
        control_period_s: Length of a control period.
        plan: float64[n, 3], the global plan that is left, rows x, y, yaw in its own frame.
        local_global_plan: float64[m, 3], its part in the local costmap, in the local frame; also
            after a failed call.
        footprint: float64[n, 2], padded, in the robot's frame.
        rotating_to_goal: The robot turns to the goal's heading.
        xy_tolerance_latch: The robot has been at the goal's position.
    """

    def __init__(
        self, params: Any, footprint: NDArray[np.float64], control_period_s: float
    ) -> None:
        self.params = params
        self.control_period_s = control_period_s
        self.plan = NO_POSES
        self.local_global_plan = NO_POSES
        self.rotating_to_goal = False
        self.xy_tolerance_latch = False
        self._goal_reached = False
        self.set_footprint(footprint)

    def set_params(self, params: Any) -> None:
        """Take other parameters; plan and state stay, but the goal is no longer reached."""
        self.params = params
        self._goal_reached = False

    def set_footprint(self, footprint: NDArray[np.float64]) -> None:
        """Take another padded footprint, float64[n, 2] in the robot's frame."""
        self.footprint = np.array(footprint, dtype=np.float64, order="C")

    def set_plan(self, plan: NDArray[np.float64]) -> None:
        """Take a new global plan, float64[n, 3] rows x, y, yaw; its goal is not reached."""
        self.plan = np.array(plan, dtype=np.float64, order="C").reshape(-1, 3)
        self.xy_tolerance_latch = False
        self._goal_reached = False

    def is_goal_reached(self) -> bool:
        """Tell whether the robot has reached the goal, heading included."""
        return self._goal_reached

    def _cut_plan(
        self, spec: GridSpec, pose: Pose2D, local_from_plan: Pose2D
    ) -> NDArray[np.float64]:
        """Return the plan's part in the local costmap.

        Raises:
            NoLocalPlan: There is none.
        """
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


def plan_in_window(
    plan: NDArray[np.float64], spec: GridSpec, pose: Pose2D, local_from_plan: Pose2D
) -> NDArray[np.float64]:
    """Return a plan's first stretch near the robot.

    Near is half of the costmap's longer side. The stretch begins with the first near pose and
    ends with the first far one after it.

    Args:
        plan: float64[n, 3], rows x, y, yaw in its own frame.
        spec: Grid of the local costmap.
        pose: Pose of the robot in the local costmap's frame.
        local_from_plan: Pose of the plan's frame in the local costmap's frame.

    Returns:
        float64[m, 3], in the local costmap's frame; empty if no pose is near.
    """
    radius_m = float(max(spec.size_x, spec.size_y) * spec.resolution_m / 2.0)
    robot = pose.relative_to(local_from_plan)
    yaw_rad = float(local_from_plan.yaw_rad)
    return stretch_near(
        plan,
        float(robot.x_m),
        float(robot.y_m),
        radius_m,
        (float(local_from_plan.x_m), float(local_from_plan.y_m)),
        (math.cos(yaw_rad), math.sin(yaw_rad)),
        yaw_rad,
    )


def plan_end(plan: NDArray[np.float64], local_from_plan: Pose2D) -> Pose2D:
    """Return the last pose of a plan, float64[n, 3] with n >= 1, in the local frame."""
    return Pose2D(*local_from_plan.transform_poses(plan[-1:])[0].tolist())


def count_passed(plan: NDArray[np.float64], pose: Pose2D) -> int:
    """Count the poses at a plan's beginning that are 1 m or more away from the robot."""
    return count_farther(plan, float(pose.x_m), float(pose.y_m), _PASSED_BEYOND_M)
