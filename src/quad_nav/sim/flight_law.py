"""Flight law: from commanded velocities to forces and torques.

``sim/flight.py`` has the formulas and their reasons. Bodies are rows of float64[n, 13] as in
``sim.flight.BodyState``: position (3) in m, quaternion (x, y, z, w), velocity (3) in m/s and
angular velocity (3) in rad/s, all in ``map``.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.files.kernel_cache import njit


class BodyConstants(NamedTuple):
    """Mass properties and limits of every quadcopter, and gravity."""

    mass_kg: float
    gravity_mps2: float
    max_thrust_n: float
    inertia_kgm2: Tuple[float, float, float]  # about the body's axes, which are principal
    max_torques_nm: Tuple[float, float, float]  # about the body's axes


class FlightGains(NamedTuple):
    """Gains and limits of the flight law, as in ``sim.flight``."""

    velocity_gain_per_s: float
    attitude_bandwidth_radps: float
    altitude_bandwidth_radps: float
    yaw_rate_gain_per_s: float
    max_acceleration_mps2: float  # horizontal
    max_yaw_acceleration_radps2: float


@njit(cache=True, nogil=True)
def rotation_from_quaternion(
    quaternion: NDArray[np.float64], rotation: NDArray[np.float64]
) -> None:
    """Fill a rotation matrix from a unit quaternion.

    Args:
        quaternion: float64[4], (x, y, z, w).
        rotation: float64[3, 3], filled with the body's axes in ``map`` as columns.
    """
    x, y, z, w = quaternion
    rotation[0, 0] = 1 - 2 * (y * y + z * z)
    rotation[0, 1] = 2 * (x * y - w * z)
    rotation[0, 2] = 2 * (x * z + w * y)
    rotation[1, 0] = 2 * (x * y + w * z)
    rotation[1, 1] = 1 - 2 * (x * x + z * z)
    rotation[1, 2] = 2 * (y * z - w * x)
    rotation[2, 0] = 2 * (x * z - w * y)
    rotation[2, 1] = 2 * (y * z + w * x)
    rotation[2, 2] = 1 - 2 * (x * x + y * y)


@njit(cache=True, nogil=True)
def rotations_from_quaternions(
    quaternions: NDArray[np.float64], rotations: NDArray[np.float64]
) -> None:
    """Fill rotation matrices from unit quaternions.

    Args:
        quaternions: float64[n, 4], rows (x, y, z, w).
        rotations: float64[n, 3, 3], filled with the bodies' axes in ``map`` as columns.
    """
    for k in range(quaternions.shape[0]):
        rotation_from_quaternion(quaternions[k], rotations[k])


@njit(cache=True, nogil=True)
def fly(
    rows: NDArray[np.float64],
    commands: NDArray[np.float64],
    altitude_m: float,
    constants: BodyConstants,
    gains: FlightGains,
    forces: NDArray[np.float64],
    torques: NDArray[np.float64],
) -> None:
    """Compute the forces and torques that track commands.

    Args:
        rows: float64[n, 13], bodies in ``map``.
        commands: float64[n, 3], (vx, vy, vyaw): m/s ahead and to the left of the heading,
            rad/s.
        altitude_m: Altitude to hold, z in ``map``.
        constants: Mass properties and limits.
        gains: Gains and limits of the law.
        forces: float64[n, 3], filled, N in ``map``.
        torques: float64[n, 3], filled, N m in ``map``.
    """
    mass, gravity, max_thrust = constants.mass_kg, constants.gravity_mps2, constants.max_thrust_n
    gain, attitude, lift, yaw_gain, max_acceleration, max_yaw_acceleration = gains
    r = np.empty((3, 3))
    omega = np.empty(3)
    body_torque = np.empty(3)
    for k in range(rows.shape[0]):
        height, velocity, angular = rows[k, 2], rows[k, 7:10], rows[k, 10:13]
        rotation_from_quaternion(rows[k, 3:7], r)
        ax, ay = _horizontal_acceleration(
            r, velocity, angular[2], commands[k], gain, max_acceleration
        )
        length = math.sqrt(ax * ax + ay * ay + gravity * gravity)
        up_x, up_y, up_z = ax / length, ay / length, gravity / length

        az = lift * lift * (altitude_m - height) - 2 * lift * velocity[2]
        thrust = mass * (gravity + az) / max(r[2, 2], 0.5)
        thrust = min(max(thrust, 0.0), max_thrust)
        for axis in range(3):
            forces[k, axis] = thrust * r[axis, 2]
            omega[axis] = (
                r[0, axis] * angular[0] + r[1, axis] * angular[1] + r[2, axis] * angular[2]
            )

        goal_x = r[0, 0] * up_x + r[1, 0] * up_y + r[2, 0] * up_z
        goal_y = r[0, 1] * up_x + r[1, 1] * up_y + r[2, 1] * up_z
        body_torque[0] = -attitude * attitude * goal_y - 2 * attitude * omega[0]
        body_torque[1] = attitude * attitude * goal_x - 2 * attitude * omega[1]
        body_torque[2] = _limited(yaw_gain * (commands[k, 2] - omega[2]), max_yaw_acceleration)
        for axis in range(3):
            body_torque[axis] = _limited(
                body_torque[axis] * constants.inertia_kgm2[axis], constants.max_torques_nm[axis]
            )
        for axis in range(3):
            torques[k, axis] = (
                r[axis, 0] * body_torque[0]
                + r[axis, 1] * body_torque[1]
                + r[axis, 2] * body_torque[2]
            )


@njit(cache=True, nogil=True)
def _horizontal_acceleration(
    rotation: NDArray[np.float64],
    velocity: NDArray[np.float64],
    yaw_rate: float,
    command: NDArray[np.float64],
    gain: float,
    limit: float,
) -> Tuple[float, float]:
    """Acceleration (ax, ay) in ``map``, m/s^2, that tracks a command; no longer than the limit."""
    forward_x, forward_y = rotation[0, 0], rotation[1, 0]
    length = math.hypot(forward_x, forward_y)
    forward_x, forward_y = forward_x / length, forward_y / length
    wanted_x = command[0] * forward_x - command[1] * forward_y
    wanted_y = command[0] * forward_y + command[1] * forward_x
    ax = gain * (wanted_x - velocity[0]) - yaw_rate * wanted_y
    ay = gain * (wanted_y - velocity[1]) + yaw_rate * wanted_x
    shorten = limit / max(math.hypot(ax, ay), limit)
    return shorten * ax, shorten * ay


@njit(cache=True, nogil=True)
def _limited(value: float, limit: float) -> float:
    return min(max(value, -limit), limit)


@njit(cache=True, nogil=True)
def planar_states(rows: NDArray[np.float64], states: NDArray[np.float64]) -> None:
    """Project bodies onto the horizontal plane.

    The same operations in the same order as ``geometry.Pose3D.to_2d``, ``geometry.rotate`` and
    ``Pose2D.rotate``, so that the numbers are the same.

    Args:
        rows: float64[n, 13], bodies.
        states: float64[n, 8], filled: pose (x_m, y_m, yaw_rad) in ``map``, velocity (vx_mps,
            vy_mps, vyaw_radps) in ``base_link``, and (vx_mps, vy_mps) of that turned by the yaw.
    """
    for k in range(rows.shape[0]):
        x, y, z, w = rows[k, 3], rows[k, 4], rows[k, 5], rows[k, 6]
        yaw = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
        vx, vy, _ = _rotate_back(x, y, z, w, rows[k, 7], rows[k, 8], rows[k, 9])
        _, _, vyaw = _rotate_back(x, y, z, w, rows[k, 10], rows[k, 11], rows[k, 12])
        cos, sin = math.cos(yaw), math.sin(yaw)
        states[k, 0], states[k, 1], states[k, 2] = rows[k, 0], rows[k, 1], yaw
        states[k, 3], states[k, 4], states[k, 5] = vx, vy, vyaw
        states[k, 6], states[k, 7] = cos * vx - sin * vy, sin * vx + cos * vy


@njit(cache=True, nogil=True)
def _rotate_back(
    qx: float, qy: float, qz: float, qw: float, x: float, y: float, z: float
) -> Tuple[float, float, float]:
    """Rotate a vector by the inverse of a unit quaternion, as ``geometry.rotate``."""
    qx, qy, qz = -qx, -qy, -qz
    cx, cy, cz = 2 * (qy * z - qz * y), 2 * (qz * x - qx * z), 2 * (qx * y - qy * x)
    return (
        x + qw * cx + qy * cz - qz * cy,
        y + qw * cy + qz * cx - qx * cz,
        z + qw * cz + qx * cy - qy * cx,
    )
