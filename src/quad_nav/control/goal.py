"""At the goal's position: stop, then turn to the goal's heading."""

from __future__ import annotations

import math
from typing import Protocol

from quad_nav.geometry import Twist2D


class GoalLimits(Protocol):
    """What both local planners' parameters say about stopping and turning."""

    @property
    def acc_lim_x_mps2(self) -> float: ...

    @property
    def acc_lim_y_mps2(self) -> float: ...

    @property
    def acc_lim_theta_radps2(self) -> float: ...

    @property
    def max_rotational_vel_radps(self) -> float: ...

    @property
    def min_in_place_vel_theta_radps(self) -> float: ...

    @property
    def trans_stopped_velocity_mps(self) -> float: ...

    @property
    def rot_stopped_velocity_radps(self) -> float: ...

    @property
    def predict_goal_turn(self) -> bool: ...


def is_stopped(velocity: Twist2D, params: GoalLimits) -> bool:
    return (
        abs(velocity.vyaw_radps) <= params.rot_stopped_velocity_radps
        and abs(velocity.vx_mps) <= params.trans_stopped_velocity_mps
        and abs(velocity.vy_mps) <= params.trans_stopped_velocity_mps
    )


def stopping_command(velocity: Twist2D, params: GoalLimits, control_period_s: float) -> Twist2D:
    """As slow as the acceleration limits allow to be in one control period."""
    return Twist2D(
        _slowed(velocity.vx_mps, params.acc_lim_x_mps2 * control_period_s),
        _slowed(velocity.vy_mps, params.acc_lim_y_mps2 * control_period_s),
        _slowed(velocity.vyaw_radps, params.acc_lim_theta_radps2 * control_period_s),
    )


def turning_command(
    turn_rad: float, velocity: Twist2D, params: GoalLimits, control_period_s: float
) -> Twist2D:
    """Turn in place by ``turn_rad``, fast enough for the base and slow enough to stop there.

    In order of strength: at least ``min_in_place_vel_theta`` and at most
    ``max_rotational_vel``; no faster than can be braked, sqrt(2 * acc * turn);
    within the acceleration limit of the current speed.

    ``predict_goal_turn`` is stronger than all of these: the command counts for a
    whole control period, so a turn that is shorter than that is made slower. At
    1 Hz and 1 rad/s the original steps over the goal's heading for ever.
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
