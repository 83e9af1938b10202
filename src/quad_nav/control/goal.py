"""Commands at the goal's position: stop, then turn to the goal's heading."""

from __future__ import annotations

import math
from typing import Protocol

from quad_nav.geometry import Twist2D


class GoalLimits(Protocol):
    """Parameters of both local planners for stopping and turning."""

    @property
    def acc_lim_x_mps2(self) -> float:
        """Largest forward acceleration."""
        ...

    @property
    def acc_lim_y_mps2(self) -> float:
        """Largest sideways acceleration."""
        ...

    @property
    def acc_lim_theta_radps2(self) -> float:
        """Largest angular acceleration."""
        ...

    @property
    def max_rotational_vel_radps(self) -> float:
        """Largest turn rate at the goal."""
        ...

    @property
    def min_in_place_vel_theta_radps(self) -> float:
        """Smallest turn rate at the goal."""
        ...

    @property
    def trans_stopped_velocity_mps(self) -> float:
        """Speed up to which the robot counts as stopped."""
        ...

    @property
    def rot_stopped_velocity_radps(self) -> float:
        """Turn rate up to which the robot counts as stopped."""
        ...

    @property
    def predict_goal_turn(self) -> bool:
        """Turn no farther in one control period than is left."""
        ...


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

    Limits, the strongest first: with ``predict_goal_turn``, no farther than the turn in one
    control period; at least ``min_in_place_vel_theta`` and at most ``max_rotational_vel``; no
    faster than can be braked, sqrt(2 * acceleration * turn); within the acceleration limit of
    the current speed. Without the first, at 1 Hz and 1 rad/s, upstream oversteps the goal's
    heading for ever.

    Args:
        turn_rad: Turn that is left.
        velocity: Velocity of the robot, in its own frame.
        params: Limits.
        control_period_s: How long the command stays in force.
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
