"""The part of a global plan that matters here and now."""

from __future__ import annotations

import numpy as np

from quad_nav.geometry import Pose2D
from quad_nav.grid import GridSpec

_PASSED_BEYOND_M = 1.0


def plan_in_window(
    plan: np.ndarray, spec: GridSpec, pose: Pose2D, local_from_plan: Pose2D
) -> np.ndarray:
    """The plan's first stretch near the robot, float64[m, 3] in the local frame.

    Near is half the window's longer side. The stretch begins with the first
    near pose and ends with the first far one after it. Empty when no pose of
    the plan, float64[n, 3], is near.
    """
    radius_m = max(spec.size_x * spec.resolution_m / 2.0, spec.size_y * spec.resolution_m / 2.0)
    robot = pose.relative_to(local_from_plan)
    near = _distance2(plan, robot) <= radius_m * radius_m
    if not near.any():
        return np.zeros((0, 3))
    first = int(np.argmax(near))
    far_after = np.flatnonzero(~near[first:])
    end = first + int(far_after[0]) + 1 if len(far_after) else len(plan)
    return _transform(local_from_plan, plan[first:end])


def plan_end(plan: np.ndarray, local_from_plan: Pose2D) -> Pose2D:
    """The last pose of a plan, float64[n, 3] with n >= 1, in the local frame."""
    return Pose2D(*_transform(local_from_plan, plan[-1:])[0].tolist())


def count_passed(plan: np.ndarray, pose: Pose2D) -> int:
    """How many poses at a plan's beginning are 1 m or more away from the robot."""
    near = _distance2(plan, pose) < _PASSED_BEYOND_M
    return int(np.argmax(near)) if near.any() else len(plan)


def _distance2(plan: np.ndarray, pose: Pose2D) -> np.ndarray:
    dx, dy = pose.x_m - plan[:, 0], pose.y_m - plan[:, 1]
    return dx * dx + dy * dy


def _transform(a_from_b: Pose2D, poses: np.ndarray) -> np.ndarray:
    return np.column_stack(
        (a_from_b.transform_points(poses[:, :2]), poses[:, 2] + a_from_b.yaw_rad)
    )
