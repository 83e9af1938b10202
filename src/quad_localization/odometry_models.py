"""Odometry models: particles move with the odometry and with noise.

``diff`` turns, drives and turns; ``omni`` moves in any direction. Both take a variance as the
standard deviation; the corrected models take its root.

Source: S. Thrun, W. Burgard, D. Fox, "Probabilistic Robotics", 2005, section 5.4; the models as in
ros-planning/navigation, amcl 1.17.3.
"""

from __future__ import annotations

import math
from typing import Any, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_localization.parameters import AmclParams
from quad_localization.random_numbers import State, normals

Floats = NDArray[np.float64]
Delta = Tuple[float, float, float]

_LEAST_WAY_M = 0.01  # the bearing of a shorter way is noise


def angle_difference(a: Any, b: Any) -> Any:
    """Return a - b by the shorter way, of numbers or arrays, rounded as amcl rounds it."""
    a, b = np.arctan2(np.sin(a), np.cos(a)), np.arctan2(np.sin(b), np.cos(b))
    direct = a - b
    other = np.where(direct > 0, -1.0, 1.0) * (2 * math.pi - np.abs(direct))
    return np.where(np.abs(direct) < np.abs(other), direct, other)


def moved(params: AmclParams, poses: Floats, old_yaw: float, delta: Delta, state: State) -> Floats:
    """Return poses float64[m, 3], metres and radians, after a motion.

    Args:
        params: Parameters of the model.
        poses: Poses before.
        old_yaw: Heading of the odometry before, radians.
        delta: Change of the odometry in its frame: x, y in metres, yaw in radians.
        state: Of the random numbers, changed.
    """
    way, bearing = math.sqrt(delta[0] * delta[0] + delta[1] * delta[1]), 0.0
    is_diff = params.odom_model_type.startswith("diff")
    if not is_diff or way >= _LEAST_WAY_M:
        bearing = float(angle_difference(math.atan2(delta[1], delta[0]), old_yaw))
    variances = np.array((_diff if is_diff else _omni)(params, way, bearing, delta[2]))
    noise = np.sqrt(variances) if _is_corrected(params) else variances
    noise = noise * normals(state, 3 * len(poses)).reshape(-1, 3)
    if not is_diff:
        cos, sin = np.cos(bearing + poses[:, 2]), np.sin(bearing + poses[:, 2])
        way_, aside = way + noise[:, 0], noise[:, 2]
        steps = (way_ * cos + aside * sin, way_ * sin - aside * cos, delta[2] + noise[:, 1])
        return poses + np.column_stack(steps)
    turn1 = angle_difference(bearing, noise[:, 0])
    turn2 = angle_difference(angle_difference(delta[2], bearing), noise[:, 2])
    way_, yaw = way - noise[:, 1], poses[:, 2] + turn1
    return poses + np.column_stack((way_ * np.cos(yaw), way_ * np.sin(yaw), turn1 + turn2))


def _is_corrected(params: AmclParams) -> bool:
    return params.odom_model_type.endswith("-corrected")


def _diff(params: AmclParams, way: float, turn1: float, turn: float) -> Delta:
    """Return the variances of the first turn, the way and the second turn."""
    squares = []
    for one in (turn1, angle_difference(turn, turn1)):  # backward motion counts like forward
        least = min(abs(angle_difference(one, ahead)) for ahead in (0.0, math.pi))
        squares.append(float(least * least))
    square1, square2, of_way = *squares, way * way
    return (
        params.odom_alpha1 * square1 + params.odom_alpha2 * of_way,
        params.odom_alpha3 * of_way + params.odom_alpha4 * square1 + params.odom_alpha4 * square2,
        params.odom_alpha1 * square2 + params.odom_alpha2 * of_way,
    )


def _omni(params: AmclParams, way: float, _: float, turn: float) -> Delta:
    """Return the variances of the way, the turn and the way aside.

    The corrected model exchanges the roles of alpha1 and alpha4.
    """
    own, other = params.odom_alpha4, params.odom_alpha1
    if _is_corrected(params):
        own, other = other, own
    of_way, of_turn = way * way, turn * turn
    return (
        params.odom_alpha3 * of_way + other * of_turn,
        own * of_turn + params.odom_alpha2 * of_way,
        other * of_turn + params.odom_alpha5 * of_way,
    )
