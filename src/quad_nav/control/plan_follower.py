"""Common part of the local planners: a plan that is cut and pruned, and the stop at its goal."""

from __future__ import annotations

import math
from typing import Any, Tuple, Union

import numpy as np
from numpy.typing import NDArray

from quad_nav.control.dwa_planner_params import DwaParams
from quad_nav.control.trajectory_planner_params import TrajectoryPlannerParams
from quad_nav.costmap.collision import Triple
from quad_nav.errors import NoLocalPlan
from quad_nav.files.kernel_cache import njit
from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.grid import GridSpec

NO_POSES = np.zeros((0, 3))
GoalLimits = Union[TrajectoryPlannerParams, DwaParams]
"""Parameters of both local planners for stopping and turning."""
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
        self.footprint = np.array(footprint, dtype=np.float64, order="C")

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

    def _stop_or_turn(self, turn_rad: float, velocity: Twist2D, limits: GoalLimits) -> Twist2D:
        """Return the command at the goal's position: stop, then turn to the goal's heading."""
        if not self.rotating_to_goal and not is_stopped(velocity, limits):
            return stopping_command(velocity, limits, self.control_period_s)
        self.rotating_to_goal = True
        return turning_command(turn_rad, velocity, limits, self.control_period_s)

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


def is_stopped(velocity: Twist2D, params: GoalLimits) -> bool:
    """Tell whether a velocity counts as stopped."""
    return (
        abs(velocity.vyaw_radps) <= params.rot_stopped_velocity_radps
        and abs(velocity.vx_mps) <= params.trans_stopped_velocity_mps
        and abs(velocity.vy_mps) <= params.trans_stopped_velocity_mps
    )


def stopping_command(velocity: Twist2D, params: GoalLimits, control_period_s: float) -> Twist2D:
    """Return the slowest command that the acceleration limits allow in one control period."""
    return Twist2D(
        _slowed(velocity.vx_mps, params.acc_lim_x_mps2 * control_period_s),
        _slowed(velocity.vy_mps, params.acc_lim_y_mps2 * control_period_s),
        _slowed(velocity.vyaw_radps, params.acc_lim_theta_radps2 * control_period_s),
    )


def turning_command(
    turn_rad: float, velocity: Twist2D, params: GoalLimits, control_period_s: float
) -> Twist2D:
    """Return a turn in place that stops at the goal's heading.

    Limits, the strongest first: with ``predict_goal_turn``, no farther than the turn in one control
    period; at least ``min_in_place_vel_theta`` and at most ``max_rotational_vel``; no faster than
    can be braked, sqrt(2 * acceleration * turn); within the acceleration limit of the current
    speed. Without the first, at 1 Hz and 1 rad/s, upstream oversteps the goal's heading for ever.
    """
    acceleration = params.acc_lim_theta_radps2
    current, change = abs(velocity.vyaw_radps), acceleration * control_period_s
    speed = _in_place_speed(abs(turn_rad), params)
    speed = min(max(speed, current - change), current + change)
    speed = min(speed, math.sqrt(2.0 * acceleration * abs(turn_rad)))
    speed = _in_place_speed(speed, params)
    if params.predict_goal_turn:
        speed = min(speed, abs(turn_rad) / control_period_s)
    return Twist2D(vyaw_radps=speed if turn_rad > 0.0 else -speed)


def _in_place_speed(speed_radps: float, params: GoalLimits) -> float:
    return min(
        params.max_rotational_vel_radps, max(params.min_in_place_vel_theta_radps, speed_radps)
    )


def _slowed(velocity: float, max_change: float) -> float:
    return math.copysign(max(0.0, abs(velocity) - max_change), velocity)


def plan_in_window(
    plan: NDArray[np.float64], spec: GridSpec, pose: Pose2D, local_from_plan: Pose2D
) -> NDArray[np.float64]:
    """Return a plan's first stretch near the robot, float64[m, 3], in the local costmap's frame.

    Near is half of the costmap's longer side. The stretch begins with the first near pose and ends
    with the first far one after it; it is empty if no pose is near.
    """
    radius_m = float(max(spec.size_x, spec.size_y) * spec.resolution_m / 2.0)
    robot = pose.relative_to(local_from_plan)
    at, yaw_rad = (float(robot.x_m), float(robot.y_m)), float(local_from_plan.yaw_rad)
    frame = float(local_from_plan.x_m), float(local_from_plan.y_m), yaw_rad
    rotation = math.cos(yaw_rad), math.sin(yaw_rad)
    return _stretch_near(plan, *at, radius_m, frame, rotation)


def count_passed(plan: NDArray[np.float64], pose: Pose2D) -> int:
    """Count the poses at a plan's beginning that are 1 m or more away from the robot."""
    return _count_farther(plan, float(pose.x_m), float(pose.y_m), _PASSED_BEYOND_M)


def plan_end(plan: NDArray[np.float64], local_from_plan: Pose2D) -> Pose2D:
    """Return the last pose of a plan, float64[n, 3] with n >= 1, in the local frame."""
    return Pose2D(*local_from_plan.transform_poses(plan[-1:])[0].tolist())


@njit(cache=True, nogil=True)
def _stretch_near(
    plan: NDArray[np.float64],
    x: float,
    y: float,
    radius_m: float,
    a_from_plan: Triple,
    rotation: Tuple[float, float],
) -> NDArray[np.float64]:
    """Return the first stretch near a point of the plan's frame, in another frame a."""
    first = 0
    while first < plan.shape[0] and not _distance2(plan, first, x, y) <= radius_m * radius_m:
        first += 1
    end = first
    while end < plan.shape[0] and _distance2(plan, end, x, y) <= radius_m * radius_m:
        end += 1
    end = min(end + 1, plan.shape[0])
    cos, sin = rotation
    stretch = np.empty((end - first, 3))
    for k in range(end - first):
        from_x, from_y = plan[first + k, 0], plan[first + k, 1]
        stretch[k, 0] = cos * from_x - sin * from_y + a_from_plan[0]
        stretch[k, 1] = sin * from_x + cos * from_y + a_from_plan[1]
        stretch[k, 2] = plan[first + k, 2] + a_from_plan[2]
    return stretch


@njit(cache=True, nogil=True)
def _count_farther(plan: NDArray[np.float64], x: float, y: float, square_m2: float) -> int:
    count = 0
    while count < plan.shape[0] and not _distance2(plan, count, x, y) < square_m2:
        count += 1
    return count


@njit(cache=True, nogil=True)
def _distance2(plan: NDArray[np.float64], k: int, x: float, y: float) -> float:
    dx, dy = x - plan[k, 0], y - plan[k, 1]
    return dx * dx + dy * dy
