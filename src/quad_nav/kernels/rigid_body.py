"""Loops over quadcopters that touch nothing: how they move, until one may touch something."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from quad_nav.kernels.flight_law import fly, rotation_from_quaternion

NOBODY = -1


@njit(cache=True, nogil=True)
def fly_freely(
    rows,
    commands,
    held,
    steps,
    step_s,
    altitude,
    gravity,
    airframe,
    law,
    mount_m,
    pair_m,
    known_m,
    rooms_m,
    centres_m,
):
    """Up to so many steps, in place, as long as nothing may be touched.

    Those that are held, bool[n], stand still: something else moves them. The other arguments
    are those of ``flight_law.fly``, ``step_freely`` and ``find_near``. Returns the steps done
    and what ``find_near`` found before the next one.
    """
    forces, torques = np.empty_like(commands), np.empty_like(commands)
    for done in range(steps):
        found, other = find_near(rows, held, mount_m, pair_m, known_m, rooms_m, centres_m)
        if found != NOBODY:
            return done, found, other
        fly(rows, commands, altitude, gravity, airframe, law, forces, torques)
        step_freely(rows, held, forces, torques, airframe, gravity, step_s)
    return steps, NOBODY, NOBODY


@njit(cache=True, nogil=True)
def step_freely(rows, held, forces, torques, airframe, gravity, step_s):
    """One time step of the bodies that are not held, in place, as the physics engine makes it.

    rows: float64[n, 13] as in ``BodyState``; held: bool[n]; forces and torques: float64[n, 3]
    in the frame of the bodies; airframe: as in ``flight_law.fly``. Velocities go first (Newton,
    and Euler's equations with the gyroscopic term), then positions with the new velocities; a
    body turns about its angular velocity (Grassia, Practical Parameterization of Rotations
    Using the Exponential Map, 1998).
    """
    mass, inertia = airframe[0], airframe[2:5]
    r = np.empty((3, 3))
    omega, torque = np.empty(3), np.empty(3)
    for k in range(rows.shape[0]):
        if held[k]:
            continue
        row = rows[k]
        for axis in range(3):
            acceleration = forces[k, axis] / mass - (gravity if axis == 2 else 0.0)
            row[7 + axis] += step_s * acceleration
            row[axis] += step_s * row[7 + axis]
        rotation_from_quaternion(row[3:7], r)
        for axis in range(3):
            omega[axis] = r[0, axis] * row[10] + r[1, axis] * row[11] + r[2, axis] * row[12]
            torque[axis] = (
                r[0, axis] * torques[k, 0] + r[1, axis] * torques[k, 1] + r[2, axis] * torques[k, 2]
            )
        spin_up_x = (torque[0] - (inertia[2] - inertia[1]) * omega[1] * omega[2]) / inertia[0]
        spin_up_y = (torque[1] - (inertia[0] - inertia[2]) * omega[2] * omega[0]) / inertia[1]
        spin_up_z = (torque[2] - (inertia[1] - inertia[0]) * omega[0] * omega[1]) / inertia[2]
        for axis in range(3):
            row[10 + axis] += step_s * (
                r[axis, 0] * spin_up_x + r[axis, 1] * spin_up_y + r[axis, 2] * spin_up_z
            )
        _turn(row[3:7], row[10:13], step_s)


@njit(cache=True, nogil=True)
def _turn(quaternion, omega, step_s):
    """Turn a quaternion for a time at an angular velocity given in the outer frame."""
    rate = math.sqrt(omega[0] * omega[0] + omega[1] * omega[1] + omega[2] * omega[2])
    half = 0.5 * rate * step_s
    # sin(x) / x is 1 - x^2 / 6 to the last digit at such rates.
    scale = math.sin(half) / rate if rate > 1e-3 else 0.5 * step_s * (1.0 - half * half / 6.0)
    ax, ay, az, aw = scale * omega[0], scale * omega[1], scale * omega[2], math.cos(half)
    bx, by, bz, bw = quaternion
    quaternion[0] = aw * bx + ax * bw + ay * bz - az * by
    quaternion[1] = aw * by - ax * bz + ay * bw + az * bx
    quaternion[2] = aw * bz + ax * by - ay * bx + az * bw
    quaternion[3] = aw * bw - ax * bx - ay * by - az * bz
    quaternion /= math.sqrt(
        quaternion[0] * quaternion[0]
        + quaternion[1] * quaternion[1]
        + quaternion[2] * quaternion[2]
        + quaternion[3] * quaternion[3]
    )


@njit(cache=True, nogil=True)
def find_near(rows, held, mount_m, pair_m, known_m, rooms_m, centres_m):
    """A quadcopter that is not held, bool[n], and that may touch something; or ``NOBODY``.

    Returns its number, and that of another one with its centre nearer than ``pair_m``; the
    second is ``NOBODY`` if it is further than rooms_m, float64[n], from its known_m,
    float64[n, 3], so that it may be near to something else. centres_m, float64[n, 3], is
    filled: points ``mount_m`` above the origins of rows, float64[n, 13] as in ``BodyState``,
    along the bodies' own axes.
    """
    for k in range(rows.shape[0]):
        x, y, z, w = rows[k, 3:7]
        centres_m[k, 0] = rows[k, 0] + mount_m * 2 * (x * z + w * y)
        centres_m[k, 1] = rows[k, 1] + mount_m * 2 * (y * z - w * x)
        centres_m[k, 2] = rows[k, 2] + mount_m * (1 - 2 * (x * x + y * y))
    for k in range(rows.shape[0]):
        if not held[k] and _square_m2(centres_m[k], known_m[k]) >= rooms_m[k] * rooms_m[k]:
            return k, NOBODY
    for k in range(rows.shape[0]):
        for other in range(k):
            if _square_m2(centres_m[k], centres_m[other]) < pair_m * pair_m and not (
                held[k] and held[other]
            ):
                return (other, k) if held[k] else (k, other)
    return NOBODY, NOBODY


@njit(cache=True, nogil=True)
def _square_m2(a, b):
    dx, dy, dz = a[0] - b[0], a[1] - b[1], a[2] - b[2]
    return dx * dx + dy * dy + dz * dz
