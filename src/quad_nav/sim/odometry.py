"""Odometry frames: each robot's frame ``odom{i}``, which may drift and turn in ``map``.

The odometry of a real robot drifts, and a localization publishes ``map -> odom`` to correct it. The
simulation does the same with a drift that is known: ``odom{i}`` moves along a straight line and
turns about its origin, both at constant speed. Without drift it is ``map``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import List, Tuple

import numpy as np

from quad_nav.errors import InputError
from quad_nav.geometry import Pose2D, Pose3D

MAX_DRIFT = 1.0
"""Largest speed, in m/s and in rad/s, of an odometry frame."""
_IDENTITY = Pose2D(0.0, 0.0)


@dataclass(frozen=True)
class OdomDrift:
    """Speeds of every odometry frame in ``map``.

    Raises:
        InputError: A speed is not within 0 and ``MAX_DRIFT``.
    """

    speed_mps: float = 0.0
    turn_radps: float = 0.0

    def __post_init__(self) -> None:
        speeds = (self.speed_mps, self.turn_radps)
        if not all(0.0 <= speed <= MAX_DRIFT for speed in speeds):
            raise InputError(
                [f"odom_drift: {list(speeds)}, expected m/s and rad/s, 0 to {MAX_DRIFT:g} each"]
            )

    @property
    def is_zero(self) -> bool:
        """True if every odometry frame is ``map``."""
        return self.speed_mps == 0.0 and self.turn_radps == 0.0


class OdomFrames:
    """Odometry frames of all robots.

    Each drifts into a direction of its own. Robots with even and with odd numbers turn in opposite
    directions.
    """

    def __init__(self, drift: OdomDrift, n_robots: int, seed: int) -> None:
        """Choose the directions of ``n_robots`` frames at random, by the seed."""
        self._drift, self.are_fixed = drift, drift.is_zero
        self._directions: List[Tuple[float, float]] = []
        for robot in range(n_robots):
            angle_rad = 2.0 * math.pi * np.random.default_rng([seed, 3, robot]).random()
            self._directions.append((math.cos(angle_rad), math.sin(angle_rad)))
        self._first_turns_left = bool(np.random.default_rng([seed, 3]).integers(2))

    def map_from_odom(self, robot: int, elapsed_s: float) -> Pose2D:
        """Return the pose of ``odom{robot}`` in ``map``, ``elapsed_s`` after the start."""
        if self.are_fixed:
            return _IDENTITY
        distance_m = self._drift.speed_mps * elapsed_s
        cos, sin = self._directions[robot]
        turns_left = (robot % 2 == 0) == self._first_turns_left
        yaw_rad = self._drift.turn_radps * elapsed_s
        return Pose2D(distance_m * cos, distance_m * sin, yaw_rad if turns_left else -yaw_rad)

    def map_from_frame(self, frame: str, robot: int, elapsed_s: float) -> Pose2D:
        """Return the pose of a frame in ``map``: of ``odom{robot}``; any other frame is ``map``."""
        if self.are_fixed or frame.lstrip("/") != f"odom{robot}":
            return _IDENTITY
        return self.map_from_odom(robot, elapsed_s)


def pose_in(map_from_frame: Pose2D, map_from_base: Pose3D) -> Pose3D:
    """Express a pose in ``map`` in another frame; without drift it is the same object."""
    if map_from_frame is _IDENTITY or map_from_frame == _IDENTITY:
        return map_from_base
    return map_from_frame.to_3d().inverse().compose(map_from_base)
