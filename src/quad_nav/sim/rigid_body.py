"""Rigid bodies that touch nothing: move them until one may touch something.

Bodies are rows of float64[n, 13] as in ``flight_law``.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.files.kernel_cache import njit
from quad_nav.sim.flight_law import BodyConstants, FlightGains, fly, rotation_from_quaternion

NO_INDEX = -1
MOVING = -2
"""Instead of another quadcopter's number: a solid that moves by itself."""


class FreeSpace(NamedTuple):
    """Space around each quadcopter in which it touches nothing.

    Checked points and free distances are valid until the caller replaces them. All positions are in
    ``map``, lengths in metres.
    """

    mount_m: float  # height of a hull's centre above the body's origin, along the body's z axis
    pair_m: float  # two quadcopters with centres nearer than this may touch
    checked_m: NDArray[np.float64]  # [n, 3], where the distance to the nearest surface was computed
    free_m: NDArray[np.float64]  # [n], how far a centre may be from its checked point
    centres_m: NDArray[np.float64]  # [n, 3], the hulls' centres, filled by ``find_near``


class MovingSolids(NamedTuple):
    """Solids that move by themselves, as upright cylinders that hold them, in ``map``."""

    poses: NDArray[np.float64]
    """[steps, m, 3], (x_m, y_m, yaw_rad) at the end of each step"""
    reaches_m: NDArray[np.float64]
    """[m], a hull with its centre nearer than this, seen from above, may touch"""
    lows_m: NDArray[np.float64]
    """[m], least height of the centre of a hull that may touch"""
    highs_m: NDArray[np.float64]
    """[m], greatest height"""


@njit(cache=True, nogil=True)
def fly_freely(
    rows: NDArray[np.float64],
    commands: NDArray[np.float64],
    excluded: NDArray[np.bool_],
    steps: int,
    step_s: float,
    altitude_m: float,
    constants: BodyConstants,
    gains: FlightGains,
    space: FreeSpace,
    moving: MovingSolids,
) -> Tuple[int, int, int]:
    """Fly as long as nothing may be touched.

    Args:
        rows: float64[n, 13], bodies in ``map``, moved in place.
        commands: float64[n, 3], as for ``flight_law.fly``.
        excluded: bool[n], bodies that something else moves; they stay where they are.
        steps: Most steps to fly.
        step_s: Length of a step.
        altitude_m: Altitude to hold, z in ``map``.
        constants: Mass properties and limits.
        gains: Gains and limits of the flight law.
        space: Space in which nothing is touched.
        moving: Solids that move by themselves, at ``steps`` steps.

    Returns:
        The steps flown, and the two numbers that ``find_near`` returned before the next one. The
        second is ``MOVING`` if the quadcopter may touch a solid that moves by itself.
    """
    forces, torques = np.empty_like(commands), np.empty_like(commands)
    for done in range(steps):
        found, other = find_near(rows, excluded, space)
        if found != NO_INDEX:
            return done, found, other
        found = find_near_moving(excluded, space, moving, done)
        if found != NO_INDEX:
            return done, found, MOVING
        fly(rows, commands, altitude_m, constants, gains, forces, torques)
        step_freely(rows, excluded, forces, torques, constants, step_s)
    return steps, NO_INDEX, NO_INDEX


@njit(cache=True, nogil=True)
def step_freely(
    rows: NDArray[np.float64],
    excluded: NDArray[np.bool_],
    forces: NDArray[np.float64],
    torques: NDArray[np.float64],
    constants: BodyConstants,
    step_s: float,
) -> None:
    """Move bodies by one time step, as the physics engine does.

    Velocities go first (Newton, and Euler's equations with the gyroscopic term), then
    positions with the new velocities. A body turns about its angular velocity (F. Grassia,
    "Practical Parameterization of Rotations Using the Exponential Map", 1998).

    Args:
        rows: float64[n, 13], bodies in ``map``, moved in place.
        excluded: bool[n], bodies that stay where they are.
        forces: float64[n, 3], N in ``map``.
        torques: float64[n, 3], N m in ``map``.
        constants: Mass properties and gravity.
        step_s: Length of the step.
    """
    mass, gravity, inertia = constants.mass_kg, constants.gravity_mps2, constants.inertia_kgm2
    r = np.empty((3, 3))
    omega, torque = np.empty(3), np.empty(3)
    for k in range(rows.shape[0]):
        if excluded[k]:
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
def _turn(quaternion: NDArray[np.float64], omega: NDArray[np.float64], step_s: float) -> None:
    """Turn a quaternion, float64[4], in place, at float64[3], rad/s in ``map``."""
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
def find_near(
    rows: NDArray[np.float64], excluded: NDArray[np.bool_], space: FreeSpace
) -> Tuple[int, int]:
    """Find a quadcopter that is not excluded and that may touch something.

    Args:
        rows: float64[n, 13], bodies in ``map``.
        excluded: bool[n], bodies that something else moves.
        space: Space in which nothing is touched; its ``centres_m`` are filled.

    Returns:
        The quadcopter's number and that of another one with its centre nearer than
        ``space.pair_m``. The second is ``NO_INDEX`` if the first is beyond its free distance: it
        may be near to something else. Both are ``NO_INDEX`` if nothing may be touched.
    """
    mount_m, pair_m, centres_m = space.mount_m, space.pair_m, space.centres_m
    for k in range(rows.shape[0]):
        x, y, z, w = rows[k, 3:7]
        centres_m[k, 0] = rows[k, 0] + mount_m * 2 * (x * z + w * y)
        centres_m[k, 1] = rows[k, 1] + mount_m * 2 * (y * z - w * x)
        centres_m[k, 2] = rows[k, 2] + mount_m * (1 - 2 * (x * x + y * y))
    for k in range(rows.shape[0]):
        room_m = space.free_m[k]
        if not excluded[k] and _square_m2(centres_m[k], space.checked_m[k]) >= room_m * room_m:
            return k, NO_INDEX
    for k in range(rows.shape[0]):
        for other in range(k):
            if _square_m2(centres_m[k], centres_m[other]) < pair_m * pair_m and not (
                excluded[k] and excluded[other]
            ):
                return (other, k) if excluded[k] else (k, other)
    return NO_INDEX, NO_INDEX


@njit(cache=True, nogil=True)
def find_near_moving(
    excluded: NDArray[np.bool_], space: FreeSpace, moving: MovingSolids, step: int
) -> int:
    """Find a quadcopter that is not excluded and that may touch a solid that moves by itself.

    Returns:
        Its number, or ``NO_INDEX``.
    """
    for k in range(excluded.shape[0] if moving.reaches_m.shape[0] > 0 else 0):
        x, y, z = space.centres_m[k]
        for solid in range(0 if excluded[k] else moving.reaches_m.shape[0]):
            dx, dy = x - moving.poses[step, solid, 0], y - moving.poses[step, solid, 1]
            if (
                dx * dx + dy * dy < moving.reaches_m[solid] * moving.reaches_m[solid]
                and moving.lows_m[solid] < z < moving.highs_m[solid]
            ):
                return k
    return NO_INDEX


@njit(cache=True, nogil=True)
def _square_m2(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    """Squared distance of two points, float64[3]."""
    dx, dy, dz = a[0] - b[0], a[1] - b[1], a[2] - b[2]
    return dx * dx + dy * dy + dz * dz
