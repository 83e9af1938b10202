"""Odometry: what each robot measures of its own motion, with errors that add up.

The odometry of a real robot errs with every metre and every turn, and a localization publishes
``map -> odom`` to correct it. The simulation knows the errors, so it can do the same: ``odom{i}``
is the frame in which the sum of the measured motions is the robot's pose. Without errors it is
``map``.
"""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass, fields
from typing import Mapping, Optional

import numpy as np
from numpy.typing import NDArray

from quad_nav.errors import InputError
from quad_nav.geometry import Pose2D, Pose3D

MAX_ERROR = 1.0
"""Largest value of every error."""
_SLIP_S = 0.5
_IDENTITY = Pose2D(0.0, 0.0)


@dataclass(frozen=True)
class OdometryErrors:
    """Errors of every robot's odometry.

    ``per_m`` and ``per_rad`` make random walks: their variances grow with the way, so that they do
    not depend on how often odometry is computed.

    Attributes:
        per_m: Standard deviation in m, in each direction, after 1 m.
        per_rad: Standard deviation in rad after a turn of 1 rad.
        speed: Speed in m/s that is measured at rest, in a direction of each robot's own.
        turn: Turning speed in rad/s that is measured at rest; neighbours turn in opposite
            directions.
        slip: Share of the time, in pieces of half a second, in which translation is not measured.

    Raises:
        InputError: An error is not within 0 and ``MAX_ERROR``.
    """

    per_m: float = 0.0
    per_rad: float = 0.0
    speed: float = 0.0
    turn: float = 0.0
    slip: float = 0.0

    def __post_init__(self) -> None:
        wrong = [
            f"odom_drift/{name}: {value}, expected 0 to {MAX_ERROR:g}"
            for name, value in vars(self).items()
            if not 0.0 <= value <= MAX_ERROR
        ]
        if wrong:
            raise InputError(wrong)

    @classmethod
    def of(cls, values: Mapping[str, float]) -> OdometryErrors:
        """Create it from some of its attributes."""
        return cls(**{name: float(value) for name, value in values.items()})

    @property
    def is_zero(self) -> bool:
        """True if every odometry frame is ``map``."""
        return not any(astuple(self))


ERROR_NAMES = tuple(field.name for field in fields(OdometryErrors))


class OdomFrames:
    """Poses of all robots' odometry frames at one instant."""

    def __init__(self, map_from_odom: Optional[NDArray[np.float64]] = None) -> None:
        """Take poses float64[n, 3], (x_m, y_m, yaw_rad) in ``map``; None if all are ``map``."""
        self.rows = map_from_odom

    def map_from_odom(self, robot: int) -> Pose2D:
        """Return the pose of ``odom{robot}`` in ``map``."""
        return _IDENTITY if self.rows is None else Pose2D(*self.rows[robot].tolist())

    def map_from_frame(self, frame: str, robot: int) -> Pose2D:
        """Return the pose of a frame in ``map``: of ``odom{robot}``; any other frame is ``map``."""
        if self.rows is None or frame.lstrip("/") != f"odom{robot}":
            return _IDENTITY
        return self.map_from_odom(robot)


FIXED_FRAMES = OdomFrames()
"""Of odometry without errors."""


class Odometry:
    """Odometry of all robots, which begins with their true poses.

    Attributes:
        frames: The odometry frames now.
        covariances: float64[n, 3, 3] of (x_m, y_m, yaw_rad) in the odometry frames, as far as the
            random walks explain the errors.
    """

    def __init__(
        self, errors: OdometryErrors, poses: NDArray[np.float64], now_s: float, seed: int
    ) -> None:
        """Start at ``poses``, float64[n, 3] of (x_m, y_m, yaw_rad) in ``map``."""
        self._errors = errors
        self._true, self._measured, self._now_s = poses.copy(), poses.copy(), now_s
        self._rng = np.random.default_rng([seed, 3])
        angles = 2.0 * math.pi * self._rng.random(len(poses))
        self._velocities = errors.speed * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        signs = np.where((np.arange(len(poses)) + self._rng.integers(2)) % 2 == 0, 1.0, -1.0)
        self._turns = errors.turn * signs
        self._slips, self._slip_end_s = np.zeros(len(poses), dtype=bool), now_s
        self.covariances = np.zeros((len(poses), 3, 3))
        self.frames = OdomFrames()

    def update(self, poses: NDArray[np.float64], now_s: float) -> None:
        """Measure the motion to ``poses``, float64[n, 3] of (x_m, y_m, yaw_rad) in ``map``."""
        errors, elapsed_s = self._errors, now_s - self._now_s
        if now_s >= self._slip_end_s:
            self._slips = self._rng.random(len(poses)) < errors.slip
            self._slip_end_s = now_s + _SLIP_S
        moves_m = _rotated(poses[:, :2] - self._true[:, :2], -self._true[:, 2])
        turns_rad = np.remainder(poses[:, 2] - self._true[:, 2] + math.pi, 2 * math.pi) - math.pi
        deviations = np.empty((len(poses), 3))
        deviations[:, :2] = errors.per_m * np.sqrt(np.hypot(*moves_m.T))[:, None]
        deviations[:, 2] = errors.per_rad * np.sqrt(np.abs(turns_rad))
        moves_m[self._slips] = 0.0
        measured = np.column_stack([moves_m, turns_rad])
        measured += deviations * self._rng.standard_normal((len(poses), 3))
        measured += np.column_stack([self._velocities, self._turns]) * elapsed_s
        self._add(measured, deviations)
        self._true, self._now_s = poses.copy(), now_s
        self._place_frames()

    def _add(self, moves: NDArray[np.float64], deviations: NDArray[np.float64]) -> None:
        """Add motions in the bodies' frames; their covariances are propagated to first order."""
        yaws_rad = self._measured[:, 2]
        steps_m = _rotated(moves[:, :2], yaws_rad)
        # How a step follows from the pose before: an error of yaw moves it to the side.
        by_pose = np.tile(np.eye(3), (len(moves), 1, 1))
        by_pose[:, 0, 2], by_pose[:, 1, 2] = -steps_m[:, 1], steps_m[:, 0]
        # The noise of a step is the same in every direction, so that it needs no turn.
        noise = np.zeros_like(by_pose)
        noise[:, [0, 1, 2], [0, 1, 2]] = deviations**2
        self.covariances = by_pose @ self.covariances @ by_pose.transpose(0, 2, 1) + noise
        self._measured[:, :2] += steps_m
        self._measured[:, 2] += moves[:, 2]

    def _place_frames(self) -> None:
        yaws_rad = self._true[:, 2] - self._measured[:, 2]
        origins_m = self._true[:, :2] - _rotated(self._measured[:, :2], yaws_rad)
        self.frames = OdomFrames(np.column_stack([origins_m, yaws_rad]))


def _rotated(vectors: NDArray[np.float64], angles_rad: NDArray[np.float64]) -> NDArray[np.float64]:
    """Turn vectors float64[n, 2], each by its own angle."""
    x, y, cos, sin = vectors[:, 0], vectors[:, 1], np.cos(angles_rad), np.sin(angles_rad)
    return np.stack([cos * x - sin * y, sin * x + cos * y], axis=1)


def pose_in(map_from_frame: Pose2D, map_from_base: Pose3D) -> Pose3D:
    """Express a pose in ``map`` in another frame; without drift it is the same object."""
    if map_from_frame is _IDENTITY or map_from_frame == _IDENTITY:
        return map_from_base
    return map_from_frame.to_3d().inverse().compose(map_from_base)
