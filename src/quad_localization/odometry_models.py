"""Kernels of the odometry models: particles move with the odometry and with noise.

``diff`` turns, drives and turns; ``omni`` moves in any direction. Both take a variance as the
standard deviation; the corrected models take its root.

Source: S. Thrun, W. Burgard, D. Fox, "Probabilistic Robotics", 2005, section 5.4; the models as in
ros-planning/navigation, amcl 1.17.3.
"""

from __future__ import annotations

import math
from typing import Tuple

import numpy as np
from numpy.typing import NDArray

from quad_localization.random_numbers import State, normal
from quad_nav.files.kernel_cache import njit

Floats = NDArray[np.float64]
Alphas = Tuple[float, float, float, float, float]

_LEAST_WAY = 0.01  # metres; the bearing of a shorter way is noise


@njit(cache=True, nogil=True)
def angle_difference(a: float, b: float) -> float:
    """Return a - b by the shorter way, rounded as amcl rounds it."""
    a, b = math.atan2(math.sin(a), math.cos(a)), math.atan2(math.sin(b), math.cos(b))
    direct = a - b
    other = 2 * math.pi - abs(direct)
    if direct > 0:
        other = -other
    return direct if abs(direct) < abs(other) else other


@njit(cache=True, nogil=True)
def move_diff(
    poses: Floats,
    old_yaw: float,
    delta: Tuple[float, float, float],
    alphas: Alphas,
    corrected: bool,
    state: State,
) -> None:
    """Move poses by ``diff`` or ``diff-corrected``.

    Args:
        poses: float64[m, 3], metres and radians, changed.
        old_yaw: Heading of the odometry before, radians.
        delta: Change of the odometry in its own frame: x, y in metres, yaw in radians.
        alphas: The parameters ``odom_alpha1`` to ``odom_alpha5``.
        corrected: Whether the noise is the root of the variance.
        state: Of the random numbers, changed.
    """
    way = math.sqrt(delta[0] * delta[0] + delta[1] * delta[1])
    turn1 = 0.0
    if way >= _LEAST_WAY:
        turn1 = angle_difference(math.atan2(delta[1], delta[0]), old_yaw)
    turn2 = angle_difference(delta[2], turn1)
    # Backward motion has the noise of forward motion.
    noise1 = min(abs(angle_difference(turn1, 0.0)), abs(angle_difference(turn1, math.pi)))
    noise2 = min(abs(angle_difference(turn2, 0.0)), abs(angle_difference(turn2, math.pi)))
    deviation1 = alphas[0] * noise1 * noise1 + alphas[1] * way * way
    deviation2 = alphas[0] * noise2 * noise2 + alphas[1] * way * way
    deviation = alphas[2] * way * way + alphas[3] * noise1 * noise1 + alphas[3] * noise2 * noise2
    if corrected:
        deviation1, deviation2 = math.sqrt(deviation1), math.sqrt(deviation2)
        deviation = math.sqrt(deviation)
    for m in range(len(poses)):
        turned1 = angle_difference(turn1, normal(state, deviation1))
        moved = way - normal(state, deviation)
        turned2 = angle_difference(turn2, normal(state, deviation2))
        poses[m, 0] += moved * math.cos(poses[m, 2] + turned1)
        poses[m, 1] += moved * math.sin(poses[m, 2] + turned1)
        poses[m, 2] += turned1 + turned2


@njit(cache=True, nogil=True)
def move_omni(
    poses: Floats,
    old_yaw: float,
    delta: Tuple[float, float, float],
    alphas: Alphas,
    corrected: bool,
    state: State,
) -> None:
    """Move poses by ``omni`` or ``omni-corrected``; arguments as in ``move_diff``.

    The corrected model also exchanges the roles of alpha1 and alpha4.
    """
    way, turn = math.sqrt(delta[0] * delta[0] + delta[1] * delta[1]), delta[2]
    of_turn, of_way = (alphas[0], alphas[3]) if corrected else (alphas[3], alphas[0])
    deviation = alphas[2] * (way * way) + of_way * (turn * turn)
    turn_deviation = of_turn * (turn * turn) + alphas[1] * (way * way)
    side_deviation = of_way * (turn * turn) + alphas[4] * (way * way)
    if corrected:
        deviation, turn_deviation = math.sqrt(deviation), math.sqrt(turn_deviation)
        side_deviation = math.sqrt(side_deviation)
    bearing = angle_difference(math.atan2(delta[1], delta[0]), old_yaw)
    for m in range(len(poses)):
        cos, sin = math.cos(bearing + poses[m, 2]), math.sin(bearing + poses[m, 2])
        moved = way + normal(state, deviation)
        turned = turn + normal(state, turn_deviation)
        aside = normal(state, side_deviation)
        poses[m, 0] += moved * cos + aside * sin
        poses[m, 1] += moved * sin - aside * cos
        poses[m, 2] += turned
