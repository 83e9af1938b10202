"""Beams of a scan as the laser models take them: range, and bearing in the base frame."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Optional, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.geometry import (
    Pose3D,
    Quaternion,
    Scan,
    multiply_quaternions,
    quaternion_from_yaw,
    rotation_from_quaternion,
)

_BAND_M = 0.3
_NO_RETURN = float(np.finfo(np.float64).max)


@dataclass(frozen=True)
class Beams:
    """All beams of a scan.

    Attributes:
        ranges_m: float64[n]; too short ones are ``range_max_m``, too long ones the largest number,
            and NaN is left out.
        bearings_rad: float64[n], in the base frame.
        range_max_m: Largest range.
    """

    ranges_m: NDArray[np.float64]
    bearings_rad: NDArray[np.float64]
    range_max_m: float

    def ends(self, mount: Tuple[float, float]) -> NDArray[np.float64]:
        """Return the ends float64[n, 2] in the base frame of a laser at a place of the base."""
        directions = np.column_stack((np.cos(self.bearings_rad), np.sin(self.bearings_rad)))
        ends: NDArray[np.float64] = mount + self.ranges_m[:, None] * directions
        return ends


def beams_of(
    scan: Scan, base_from_laser: Pose3D, min_range_m: float, max_range_m: float
) -> Optional[Beams]:
    """Return the beams of a scan, None if its limits are not sound.

    The bearings follow linearly from the first two beams, which also serves a laser that is upside
    down. Limits of the range that are above 0 narrow those of the scan.
    """
    largest_m, least_m = np.float32(scan.range_max_m), np.float32(scan.range_min_m)
    if max_range_m > 0.0:
        largest_m = min(largest_m, np.float32(max_range_m))
    if min_range_m > 0.0:
        least_m = max(least_m, np.float32(min_range_m))
    if not (largest_m > 0.0 and least_m >= 0.0):
        return None
    first, step = np.float32(scan.angle_min_rad), np.float32(scan.angle_increment_rad)
    start_rad, second_rad = (
        tilted_yaw(multiply_quaternions(base_from_laser.quaternion, quaternion_from_yaw(angle_rad)))
        for angle_rad in (float(first), float(first + step))
    )
    step_rad = math.fmod(second_rad - start_rad + 5 * math.pi, 2 * math.pi) - math.pi
    ranges_m = scan.ranges_m.astype(np.float64)
    with np.errstate(invalid="ignore"):
        too_short, too_long = ranges_m <= least_m, ranges_m > largest_m
    ranges_m[too_long], ranges_m[too_short] = _NO_RETURN, largest_m
    bearings_rad = np.add(start_rad, np.arange(len(ranges_m)) * step_rad)
    return Beams(ranges_m, bearings_rad, float(largest_m))


def levelled(beams: Beams, odom_from_base: Quaternion) -> Beams:
    """Project beams to the ground: a quadcopter tilts when it accelerates.

    At 10 degrees a range of 10 m is 0.15 m too long. Ends that are more than ``_BAND_M`` above or
    below the laser are left out; they may be on the floor.
    """
    turn = quaternion_from_yaw(-tilted_yaw(odom_from_base))
    tilt = rotation_from_quaternion(multiply_quaternions(turn, odom_from_base))
    flat = np.stack([np.cos(beams.bearings_rad), np.sin(beams.bearings_rad)])
    x, y, z = tilt[:, :2] @ flat
    ranges_m = beams.ranges_m.copy()
    is_return = ranges_m <= beams.range_max_m
    ranges_m[is_return & (np.abs(z * np.where(is_return, ranges_m, 0.0)) > _BAND_M)] = np.nan
    ranges_m[is_return] *= np.hypot(x, y)[is_return]
    return replace(beams, ranges_m=ranges_m, bearings_rad=np.arctan2(y, x))


def tilted_yaw(quaternion: Quaternion) -> float:
    """Return the yaw of a quaternion that need not be a unit, as ``tf2::getYaw``."""
    x, y, z, w = quaternion
    xx, yy, zz, ww = x * x, y * y, z * z, w * w
    sine = -2 * (x * z - w * y) / (xx + yy + zz + ww)
    if sine <= -0.99999:
        return -2 * math.atan2(y, x)
    if sine >= 0.99999:
        return 2 * math.atan2(y, x)
    return math.atan2(2 * (x * y + w * z), ww + xx - yy - zz)
