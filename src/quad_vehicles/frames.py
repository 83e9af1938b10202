"""Convert between the axes of autopilots and the axes of ROS.

Autopilots (MAVLink) have a world frame NED (x north, y east, z down) and a body frame FRD (x
forward, y right, z down). ROS (REP 103) has ENU (x east, y north, z up) and FLU (x forward, y left,
z up). Yaw is clockwise from north in NED, and counter-clockwise from east in ENU.

This is the only place of the project where an axis changes its sign or its name. Each of the vector
conversions is its own inverse.

Quaternions of ROS are (x, y, z, w), those of MAVLink (w, x, y, z).

A Crazyflie has ROS's axes, but for the sign of the pitch that it logs.
"""

from __future__ import annotations

import math
from typing import Any, Optional, Tuple

import numpy as np

from quad_nav.geometry import (
    Quaternion,
    Scan,
    multiply_quaternions,
    quaternion_from_euler,
)

Vector = Tuple[float, float, float]
MavlinkQuaternion = Tuple[float, float, float, float]
"""(w, x, y, z), the rotation from FRD to NED, as in ``ATTITUDE_QUATERNION``."""

_SQRT_HALF = math.sqrt(0.5)
_ENU_FROM_NED: Quaternion = (_SQRT_HALF, _SQRT_HALF, 0.0, 0.0)  # half a turn about (1, 1, 0)
_FRD_FROM_FLU: Quaternion = (1.0, 0.0, 0.0, 0.0)  # half a turn about x
_UNKNOWN_CM = 65535
_BODY_FRD = 12
_FULL_TURN_DEG = 360.0
_LEAST_SECTOR_DEG = 0.01


def enu_from_ned(vector: Vector) -> Vector:
    """Return a position or velocity (north, east, down) as (east, north, up)."""
    north, east, down = vector
    return (east, north, -down)


def flu_from_frd(vector: Vector) -> Vector:
    """Return a velocity or angular velocity (forward, right, down) as (forward, left, up)."""
    forward, right, down = vector
    return (forward, -right, -down)


frd_from_flu = flu_from_frd  # its own inverse


def yaw_rate(rate_radps: float) -> float:
    """Return a clockwise yaw rate as a counter-clockwise one, or the other way round."""
    return -rate_radps


def enu_from_flu(frd_to_ned: MavlinkQuaternion) -> Quaternion:
    """Return the attitude of a body in ROS's axes.

    Args:
        frd_to_ned: Attitude of MAVLink, of length 1.

    Returns:
        Quaternion (x, y, z, w) of the rotation from FLU to ENU, with w >= 0.
    """
    w, x, y, z = frd_to_ned
    turned = multiply_quaternions(_ENU_FROM_NED, multiply_quaternions((x, y, z, w), _FRD_FROM_FLU))
    x, y, z, w = turned
    return (-x, -y, -z, -w) if w < 0.0 else turned


def mavlink_quaternion(roll_rad: float, pitch_rad: float, yaw_rad: float) -> MavlinkQuaternion:
    """Return the quaternion of ``ATTITUDE``'s roll, pitch and yaw (Tait-Bryan z-y'-x'')."""
    cr, sr = math.cos(roll_rad / 2.0), math.sin(roll_rad / 2.0)
    cp, sp = math.cos(pitch_rad / 2.0), math.sin(pitch_rad / 2.0)
    cy, sy = math.cos(yaw_rad / 2.0), math.sin(yaw_rad / 2.0)
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )


def crazyflie_quaternion(roll_deg: float, pitch_deg: float, yaw_deg: float) -> Quaternion:
    """Return a Crazyflie's logged attitude, whose pitch is positive nose up, in ROS's axes."""
    roll, pitch, yaw = (math.radians(angle) for angle in (roll_deg, -pitch_deg, yaw_deg))
    return quaternion_from_euler(roll, pitch, yaw)


def scan_from_obstacle_distance(
    message: Any, stamp_s: float, heading_rad: float = 0.0
) -> Optional[Scan]:
    """Convert the sectors to a scan in the body frame (FLU), counter-clockwise.

    Sector k of the message looks along ``angle_offset + k increment``, clockwise from ahead, or
    from north if its frame is not the body's. A sector is one beam in its middle direction. A
    sector without an obstacle is +inf, one that was not measured NaN.

    Args:
        message: Has the message's fields as attributes.
        stamp_s: Time of the scan.
        heading_rad: Heading of the vehicle, clockwise from north.

    Returns:
        The scan; None if the message's angles or limits make no scan.
    """
    increment_deg = float(message.increment_f) or float(message.increment)
    offset_rad = math.radians(float(message.angle_offset))
    nearest_m, furthest_m = message.min_distance / 100.0, message.max_distance / 100.0
    is_sound = math.isfinite(increment_deg) and math.isfinite(offset_rad)
    if not is_sound or abs(increment_deg) < _LEAST_SECTOR_DEG or not nearest_m < furthest_m:
        return None
    sectors = min(len(message.distances), math.floor(_FULL_TURN_DEG / abs(increment_deg) + 1e-6))
    if sectors < 1:
        return None
    offset_rad -= 0.0 if message.frame == _BODY_FRD else heading_rad
    centimetres = np.array(message.distances[:sectors], dtype=np.float64)
    ranges_m = np.where(centimetres > message.max_distance, np.inf, centimetres / 100.0)
    ranges_m[centimetres == _UNKNOWN_CM] = np.nan
    increment_rad = math.radians(increment_deg)
    first_rad = -(offset_rad + (sectors - 1) * increment_rad)  # the last sector comes first
    return Scan(
        stamp_s,
        first_rad,
        increment_rad,
        nearest_m,
        furthest_m,
        ranges_m[::-1].astype(np.float32),
    )
