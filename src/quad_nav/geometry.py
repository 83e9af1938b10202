"""Poses, twists, scans and angles.

Frames are right-handed. Units are metres, radians and seconds. Yaw is counter-clockwise
about z. Quaternions are (x, y, z, w). A pose named ``a_from_b`` takes coordinates in frame b
to coordinates in frame a, so that ``a_from_b.compose(b_from_c)`` is ``a_from_c``. The pose of
a robot in ``map`` is ``map_from_base``.

The transforms of ``Pose2D`` are the only planar rotations of the project outside of the
kernels. Their order of operations is part of the contract: seeded flights are compared bit
for bit.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Sequence, Tuple, TypeVar

import numpy as np
from numpy.typing import NDArray

Quaternion = Tuple[float, float, float, float]
Coordinate = TypeVar("Coordinate", float, "NDArray[np.float64]")


@dataclass(frozen=True)
class Pose2D:
    """Position and heading in a horizontal plane, or a planar rigid transform.

    Attributes:
        x_m: Position along x of the outer frame.
        y_m: Position along y of the outer frame.
        yaw_rad: Heading, not necessarily in [-pi, pi].

    Example:
        >>> map_from_base = Pose2D(1.0, 2.0, math.pi / 2)
        >>> x_m, y_m = map_from_base.transform(3.0, 0.0)  # 3 m ahead of the robot
        >>> round(x_m, 6), round(y_m, 6)
        (1.0, 5.0)
    """

    x_m: float
    y_m: float
    yaw_rad: float = 0.0

    def distance_to(self, other: Pose2D) -> float:
        """Return the distance of the two positions in metres."""
        return math.hypot(other.x_m - self.x_m, other.y_m - self.y_m)

    def compose(self, other: Pose2D) -> Pose2D:
        """Chain two transforms: ``a_from_b.compose(b_from_c)`` is ``a_from_c``.

        The yaws are added and not normalised.
        """
        x_m, y_m = self.transform(other.x_m, other.y_m)
        return Pose2D(x_m, y_m, other.yaw_rad + self.yaw_rad)

    def inverse(self) -> Pose2D:
        """Invert the transform: ``a_from_b.inverse()`` is ``b_from_a``."""
        x_m, y_m = self.inverse_transform(0.0, 0.0)
        return Pose2D(x_m, y_m, -self.yaw_rad)

    def relative_to(self, origin: Pose2D) -> Pose2D:
        """Express this pose in the frame of another: ``a_from_c`` relative to ``a_from_b``.

        Equals ``origin.inverse().compose(self)`` with less rounding far from (0, 0).
        """
        x_m, y_m = origin.inverse_transform(self.x_m, self.y_m)
        return Pose2D(x_m, y_m, self.yaw_rad - origin.yaw_rad)

    def rotate(self, x: Coordinate, y: Coordinate) -> Tuple[Coordinate, Coordinate]:
        """Rotate vectors, such as velocities, by the yaw: from frame b to frame a.

        Components are numbers, or arrays of shapes that broadcast.
        """
        return rotate_vectors(math.cos(self.yaw_rad), math.sin(self.yaw_rad), x, y)

    def transform(self, x_m: Coordinate, y_m: Coordinate) -> Tuple[Coordinate, Coordinate]:
        """Transform points from frame b to frame a.

        Coordinates are numbers, or arrays of shapes that broadcast.
        """
        x_m, y_m = self.rotate(x_m, y_m)
        return x_m + self.x_m, y_m + self.y_m

    def inverse_transform(self, x_m: Coordinate, y_m: Coordinate) -> Tuple[Coordinate, Coordinate]:
        """Transform points, as ``transform`` takes them, from frame a to frame b.

        Equals ``inverse().transform(x_m, y_m)`` with less rounding far from (0, 0).
        """
        cos, sin = math.cos(self.yaw_rad), math.sin(self.yaw_rad)
        return rotate_vectors(cos, -sin, x_m - self.x_m, y_m - self.y_m)

    def transform_points(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Transform points float64[n, 2], metres, from frame b to frame a."""
        return np.column_stack(self.transform(points[:, 0], points[:, 1]))

    def transform_poses(self, poses: NDArray[np.float64]) -> NDArray[np.float64]:
        """Transform poses float64[n, 3], rows x, y, yaw, from frame b to frame a.

        The yaws are not normalised.
        """
        return np.column_stack((self.transform_points(poses[:, :2]), poses[:, 2] + self.yaw_rad))

    def inverse_transform_points(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Transform points float64[n, 2], metres, from frame a to frame b."""
        return np.column_stack(self.inverse_transform(points[:, 0], points[:, 1]))

    def to_3d(self) -> Pose3D:
        """Return the same pose in space, at z = 0."""
        return Pose3D(self.x_m, self.y_m, 0.0, quaternion_from_yaw(self.yaw_rad))


@dataclass(frozen=True)
class Twist2D:
    """Velocity in the robot's frame, as in ``geometry_msgs/Twist`` (REP 103: x ahead, y left)."""

    vx_mps: float = 0.0
    vy_mps: float = 0.0
    vyaw_radps: float = 0.0

    @property
    def is_zero(self) -> bool:
        """True if every component is 0."""
        return self.vx_mps == 0.0 and self.vy_mps == 0.0 and self.vyaw_radps == 0.0

    @property
    def is_finite(self) -> bool:
        """True if no component is infinite or NaN."""
        return all(map(math.isfinite, (self.vx_mps, self.vy_mps, self.vyaw_radps)))


def leading_velocity(
    vx_mps: float, vy_mps: float, vyaw_radps: float, lead_s: float
) -> Tuple[float, float]:
    """Return a velocity turned by the angle through which the heading turns in a time.

    A vehicle that follows a velocity later by this time flies along its heading in a turn.
    """
    cos, sin = math.cos(lead_s * vyaw_radps), math.sin(lead_s * vyaw_radps)
    return cos * vx_mps - sin * vy_mps, sin * vx_mps + cos * vy_mps


@dataclass(frozen=True)
class Pose3D:
    """Pose in space, or a rigid transform: translation in metres and a unit quaternion."""

    x_m: float
    y_m: float
    z_m: float
    quaternion: Quaternion = (0.0, 0.0, 0.0, 1.0)

    @property
    def translation(self) -> NDArray[np.float64]:
        """Translation in metres, float64[3]."""
        return np.array([self.x_m, self.y_m, self.z_m])

    @property
    def rotation(self) -> NDArray[np.float64]:
        """Rotation matrix, float64[3, 3]."""
        return rotation_from_quaternion(self.quaternion)

    @property
    def yaw_rad(self) -> float:
        """Heading about z in [-pi, pi]."""
        return yaw_from_quaternion(self.quaternion)

    def to_2d(self) -> Pose2D:
        """Project onto the horizontal plane: x, y and yaw."""
        return Pose2D(self.x_m, self.y_m, self.yaw_rad)

    def compose(self, other: Pose3D) -> Pose3D:
        """Chain two transforms: ``a_from_b.compose(b_from_c)`` is ``a_from_c``."""
        x, y, z = rotate(self.quaternion, (other.x_m, other.y_m, other.z_m))
        return Pose3D(
            self.x_m + x,
            self.y_m + y,
            self.z_m + z,
            multiply_quaternions(self.quaternion, other.quaternion),
        )

    def inverse(self) -> Pose3D:
        """Invert the transform: ``a_from_b.inverse()`` is ``b_from_a``."""
        qx, qy, qz, qw = self.quaternion
        x, y, z = -(self.rotation.T @ self.translation)
        return Pose3D(float(x), float(y), float(z), (-qx, -qy, -qz, qw))

    def transform_points(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Transform points float64[n, 3], metres, from frame b to frame a."""
        transformed: NDArray[np.float64] = points @ self.rotation.T + self.translation
        return transformed


@dataclass(frozen=True)
class Scan:
    """One turn of a planar LIDAR, as in ``sensor_msgs/LaserScan``.

    Attributes:
        stamp_s: Time of the first beam.
        angle_min_rad: Bearing of beam 0 in the sensor's xy plane.
        angle_increment_rad: Beam k looks along ``angle_min_rad + k * angle_increment_rad``.
        range_min_m: Shortest range that counts.
        range_max_m: Range from which on nothing counts.
        ranges_m: float32[n]; a beam without a return is +inf.
    """

    stamp_s: float
    angle_min_rad: float
    angle_increment_rad: float
    range_min_m: float
    range_max_m: float
    ranges_m: NDArray[np.float32]


def covariance_36(planar: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a covariance float64[3, 3] of x, y and yaw as messages have it; the rest is exact.

    Returns:
        float64[36], the rows of x, y, z, roll, pitch and yaw.
    """
    covariance = np.zeros((6, 6))
    covariance[np.ix_((0, 1, 5), (0, 1, 5))] = planar
    return covariance.reshape(36)


def normalize_angle(angle_rad: float) -> float:
    """Return the same angle in [-pi, pi]."""
    return math.atan2(math.sin(angle_rad), math.cos(angle_rad))


def wrap_angle(angle_rad: float) -> float:
    """Return the same angle in (-pi, pi], rounded as ``angles::normalize_angle`` of ROS."""
    wrapped_rad = math.fmod(angle_rad + math.pi, 2.0 * math.pi)
    return wrapped_rad + math.pi if wrapped_rad <= 0.0 else wrapped_rad - math.pi


def angle_difference(to_rad: float, from_rad: float) -> float:
    """Return the shortest turn from ``from_rad`` to ``to_rad``, in [-pi, pi]."""
    return normalize_angle(to_rad - from_rad)


def rotate_vectors(
    cos_yaw: Any, sin_yaw: Any, x: Coordinate, y: Coordinate
) -> Tuple[Coordinate, Coordinate]:
    """Rotate planar vectors by an angle: return ``(cos x - sin y, sin x + cos y)``.

    For callers with many angles; all others use ``Pose2D``. Numbers and arrays broadcast. The
    opposite sine gives the inverse rotation.
    """
    return cos_yaw * x - sin_yaw * y, sin_yaw * x + cos_yaw * y


def yaw_rotations(yaws_rad: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the rotation matrices float64[n, 3, 3] about z of yaws float64[n]."""
    rotations = np.zeros((len(yaws_rad), 3, 3))
    rotations[:, 0, 0] = rotations[:, 1, 1] = np.cos(yaws_rad)
    rotations[:, 1, 0] = np.sin(yaws_rad)
    rotations[:, 0, 1] = -rotations[:, 1, 0]
    rotations[:, 2, 2] = 1.0
    return rotations


def quaternion_from_yaw(yaw_rad: float) -> Quaternion:
    """Return the unit quaternion of a rotation about z."""
    return (0.0, 0.0, math.sin(yaw_rad / 2.0), math.cos(yaw_rad / 2.0))


def yaw_from_quaternion(quaternion: Quaternion) -> float:
    """Return the yaw of a unit quaternion in [-pi, pi], as ``tf2::getYaw``."""
    x, y, z, w = quaternion
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def yaws_from_quaternions(quaternions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the yaws float64[n] of unit quaternions float64[n, 4], (x, y, z, w)."""
    # Contiguous operands: near the end of a strided one numpy may take its scalar arctan2, whose
    # last bit differs, as the memory happens to lie.
    x, y, z, w = quaternions.T
    yaws_rad: NDArray[np.float64] = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return yaws_rad


def quaternion_from_euler(roll_rad: float, pitch_rad: float, yaw_rad: float) -> Quaternion:
    """Return the unit quaternion of ROS's fixed-axis roll, pitch, yaw.

    The same rotation as intrinsic z-y'-x'' (yaw, pitch, roll).
    """
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
    """Return the Hamilton product ab: the rotation b followed by the rotation a."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def rotate(quaternion: Quaternion, vector: Sequence[float]) -> Tuple[float, float, float]:
    """Rotate a vector (x, y, z) by a unit quaternion: v + 2 w (q x v) + 2 q x (q x v).

    Plain numbers are ten times as fast here as arrays of three.
    """
    qx, qy, qz, qw = quaternion
    x, y, z = vector
    cx, cy, cz = 2 * (qy * z - qz * y), 2 * (qz * x - qx * z), 2 * (qx * y - qy * x)
    return (
        x + qw * cx + qy * cz - qz * cy,
        y + qw * cy + qz * cx - qx * cz,
        z + qw * cz + qx * cy - qy * cx,
    )


def rotation_from_quaternion(quaternion: Quaternion) -> NDArray[np.float64]:
    """Return the rotation matrix float64[3, 3] of a unit quaternion."""
    x, y, z, w = quaternion
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
