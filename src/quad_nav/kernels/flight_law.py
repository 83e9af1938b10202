"""The flight law's loop over quadcopters; ``sim/flight.py`` has the formulas and their reasons."""

from __future__ import annotations

import math

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def rotation_from_quaternion(quaternion, rotation):
    """Fill rotation float64[3, 3], body axes as columns, from quaternion float64[4]."""
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
def fly(rows, commands, altitude, gravity, airframe, law, forces, torques):
    """Fill forces and torques float64[n, 3], in the frame of the bodies.

    rows: float64[n, 13] as in ``BodyState``; commands: float64[n, 3], (vx, vy, vyaw).
    airframe: mass, largest thrust, inertia (3), largest torques (3). law: velocity gain,
    attitude bandwidth, altitude bandwidth, yaw rate gain, limits of the horizontal and
    the yaw acceleration.
    """
    mass, max_thrust = airframe[0], airframe[1]
    gain, attitude, lift, yaw_gain, max_acceleration, max_yaw_acceleration = law
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

        az = lift * lift * (altitude - height) - 2 * lift * velocity[2]
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
            body_torque[axis] = _limited(body_torque[axis] * airframe[2 + axis], airframe[5 + axis])
        for axis in range(3):
            torques[k, axis] = (
                r[axis, 0] * body_torque[0]
                + r[axis, 1] * body_torque[1]
                + r[axis, 2] * body_torque[2]
            )


@njit(cache=True, nogil=True)
def _horizontal_acceleration(rotation, velocity, yaw_rate, command, gain, limit):
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
def _limited(value, limit):
    return min(max(value, -limit), limit)
