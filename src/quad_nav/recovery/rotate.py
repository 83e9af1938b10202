"""Recovery ``rotate_recovery/RotateRecovery``: turn once in place."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Optional

import numpy as np

from quad_nav.costmap.layered import LayeredCostmap
from quad_nav.geometry import Pose2D, Twist2D, angle_difference
from quad_nav.parameter import POSITIVE, deviation, fixed_number
from quad_nav.recovery.recovery import RecoveryContext, Step


@dataclass(frozen=True)
class TurnLimits:
    """Parameters that RotateRecovery reads from TrajectoryPlannerROS, with its own defaults."""

    yaw_goal_tolerance_rad: float = fixed_number(
        "yaw_goal_tolerance", 0.10, "radians", "Tolerance of the heading after the turn."
    )
    acc_lim_theta_radps2: float = fixed_number(
        "acc_lim_theta", 3.2, "rad/s^2", "Rotational acceleration limit."
    )
    max_vel_theta_radps: float = fixed_number(
        "max_vel_theta", 1.0, "rad/s", "Largest rotational velocity."
    )
    min_in_place_vel_theta_radps: float = fixed_number(
        "min_in_place_vel_theta", 0.4, "rad/s", "Smallest speed of a turn in place."
    )


@dataclass(frozen=True)
class RotateParams:
    """Parameters of ``rotate_recovery/RotateRecovery``.

    Attributes:
        stop_after_rotation: Publish a stop after the turn; False restores upstream behaviour.
    """

    frequency_hz: float = fixed_number("frequency", 20.0, "Hz", "Rate of commands.", POSITIVE)
    sim_granularity_rad: float = fixed_number(
        "sim_granularity", 0.017, "radians", "Step of the turn's collision check.", POSITIVE
    )
    limits: TurnLimits = TurnLimits()
    stop_after_rotation: bool = deviation()


class Rotate:
    """Turns the robot once in place, as long as its footprint stays free.

    The speed follows the braking curve sqrt(2 * acceleration * remaining angle), between the
    in-place minimum and the maximum; the maximum takes precedence.
    """

    def __init__(self, params: RotateParams) -> None:
        """Create the behaviour."""
        self.params = params
        self.period_s = 1.0 / params.frequency_hz
        self._start_yaw_rad: Optional[float] = None
        self._past_half_turn = False

    def start(self, context: RecoveryContext) -> None:
        """Start a turn from the pose of the first step."""
        self._start_yaw_rad = None
        self._past_half_turn = False

    def step(self, context: RecoveryContext) -> Step:
        """Turn on; stop if the pose is unknown or the rest of the turn would collide."""
        pose = context.pose_in_local
        if pose is None:
            return self._end("rotation stopped: robot pose unknown", stop=True)
        if self._start_yaw_rad is None:
            self._start_yaw_rad = pose.yaw_rad
        remaining_rad = self._remaining_angle(pose.yaw_rad)
        if remaining_rad is None:
            return self._end("", stop=self.params.stop_after_rotation)
        if not self._is_free(context.local_costmap, pose, remaining_rad):
            return self._end("rotation stopped: the footprint would touch an obstacle", stop=True)
        return Step(command=Twist2D(vyaw_radps=self._speed(remaining_rad)))

    def _end(self, message: str, stop: bool) -> Step:
        return Step(command=Twist2D() if stop else None, done=True, message=message)

    def _remaining_angle(self, yaw_rad: float) -> Optional[float]:
        """Return the remaining angle, None if the turn is complete."""
        assert self._start_yaw_rad is not None
        tolerance = self.params.limits.yaw_goal_tolerance_rad
        to_half_turn = abs(angle_difference(self._start_yaw_rad + math.pi, yaw_rad))
        if not self._past_half_turn:
            self._past_half_turn = to_half_turn < tolerance
            return math.pi + to_half_turn
        remaining_rad = abs(angle_difference(self._start_yaw_rad, yaw_rad))
        return None if remaining_rad <= tolerance else remaining_rad

    def _is_free(self, costmap: LayeredCostmap, pose: Pose2D, remaining_rad: float) -> bool:
        return all(
            costmap.footprint_cost(Pose2D(pose.x_m, pose.y_m, pose.yaw_rad + turn)) >= 0.0
            for turn in np.arange(0.0, remaining_rad, self.params.sim_granularity_rad)
        )

    def _speed(self, remaining_rad: float) -> float:
        limits = self.params.limits
        speed = math.sqrt(2.0 * limits.acc_lim_theta_radps2 * remaining_rad)
        return min(max(speed, limits.min_in_place_vel_theta_radps), limits.max_vel_theta_radps)
