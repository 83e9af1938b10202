"""Poses, twists, scans, angles and footprints.

Right-handed frames, metres, radians, seconds. Yaw is counter-clockwise about
z. Quaternions are (x, y, z, w). A pose named ``a_from_b`` takes coordinates in
frame b to coordinates in frame a.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Sequence, Tuple

import numpy as np

Quaternion = Tuple[float, float, float, float]


@dataclass(frozen=True)
class Pose2D:
    """Position and heading in a horizontal plane."""

    x_m: float
    y_m: float
    yaw_rad: float = 0.0

    def distance_to(self, other: Pose2D) -> float:
        return math.hypot(other.x_m - self.x_m, other.y_m - self.y_m)


@dataclass(frozen=True)
class Twist2D:
    """Velocity in the body frame, as in ``geometry_msgs/Twist``."""

    vx_mps: float = 0.0
    vy_mps: float = 0.0
    vyaw_radps: float = 0.0

    @property
    def is_zero(self) -> bool:
        return self.vx_mps == 0.0 and self.vy_mps == 0.0 and self.vyaw_radps == 0.0

    @property
    def is_finite(self) -> bool:
        return all(map(math.isfinite, (self.vx_mps, self.vy_mps, self.vyaw_radps)))


@dataclass(frozen=True)
class Pose3D:
    """Rigid transform: translation in metres and a unit quaternion."""

    x_m: float
    y_m: float
    z_m: float
    quaternion: Quaternion = (0.0, 0.0, 0.0, 1.0)

    @property
    def translation(self) -> np.ndarray:
        """float64[3]"""
        return np.array([self.x_m, self.y_m, self.z_m])

    @property
    def rotation(self) -> np.ndarray:
        """float64[3, 3]"""
        return rotation_from_quaternion(self.quaternion)

    @property
    def yaw_rad(self) -> float:
        return yaw_from_quaternion(self.quaternion)

    def to_2d(self) -> Pose2D:
        return Pose2D(self.x_m, self.y_m, self.yaw_rad)

    def compose(self, other: Pose3D) -> Pose3D:
        """``a_from_b.compose(b_from_c)`` is ``a_from_c``."""
        x, y, z = rotate(self.quaternion, (other.x_m, other.y_m, other.z_m))
        return Pose3D(
            self.x_m + x,
            self.y_m + y,
            self.z_m + z,
            multiply_quaternions(self.quaternion, other.quaternion),
        )

    def inverse(self) -> Pose3D:
        qx, qy, qz, qw = self.quaternion
        x, y, z = -(self.rotation.T @ self.translation)
        return Pose3D(float(x), float(y), float(z), (-qx, -qy, -qz, qw))


@dataclass(frozen=True)
class Scan:
    """One turn of a planar LIDAR, as in ``sensor_msgs/LaserScan``.

    ``ranges_m`` is float32[n]; beam k looks along
    ``angle_min_rad + k * angle_increment_rad`` in the sensor's xy plane. A beam
    that hits nothing is +inf.
    """

    stamp_s: float
    angle_min_rad: float
    angle_increment_rad: float
    range_min_m: float
    range_max_m: float
    ranges_m: np.ndarray


def normalize_angle(angle_rad: float) -> float:
    """The same angle in [-pi, pi]."""
    return math.atan2(math.sin(angle_rad), math.cos(angle_rad))


def angle_difference(to_rad: float, from_rad: float) -> float:
    """The shortest turn that takes ``from_rad`` to ``to_rad``, in [-pi, pi]."""
    return normalize_angle(to_rad - from_rad)


def quaternion_from_yaw(yaw_rad: float) -> Quaternion:
    return (0.0, 0.0, math.sin(yaw_rad / 2.0), math.cos(yaw_rad / 2.0))


def yaw_from_quaternion(quaternion: Quaternion) -> float:
    x, y, z, w = quaternion
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def quaternion_from_euler(roll_rad: float, pitch_rad: float, yaw_rad: float) -> Quaternion:
    """Intrinsic z-y'-x'' (yaw, pitch, roll), ROS's fixed-axis roll-pitch-yaw."""
    cr, sr = math.cos(roll_rad / 2), math.sin(roll_rad / 2)
    cp, sp = math.cos(pitch_rad / 2), math.sin(pitch_rad / 2)
    cy, sy = math.cos(yaw_rad / 2), math.sin(yaw_rad / 2)
    return (
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    )


def multiply_quaternions(a: Quaternion, b: Quaternion) -> Quaternion:
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def rotate(quaternion: Quaternion, vector: Sequence[float]) -> Tuple[float, float, float]:
    """A vector (x, y, z) turned by a unit quaternion: v + 2 w (q x v) + 2 q x (q x v).

    In plain numbers, because arrays of three take ten times as long.
    """
    qx, qy, qz, qw = quaternion
    x, y, z = vector
    cx, cy, cz = 2 * (qy * z - qz * y), 2 * (qz * x - qx * z), 2 * (qx * y - qy * x)
    return (
        x + qw * cx + qy * cz - qz * cy,
        y + qw * cy + qz * cx - qx * cz,
        z + qw * cz + qx * cy - qy * cx,
    )


def rotation_from_quaternion(quaternion: Quaternion) -> np.ndarray:
    """Rotation matrix float64[3, 3] of a unit quaternion."""
    x, y, z, w = quaternion
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
