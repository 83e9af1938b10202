"""Scans from MAVLink's OBSTACLE_DISTANCE: up to 72 sectors, clockwise, in centimetres."""

from __future__ import annotations

import math
from typing import Any, Optional

import numpy as np

from quad_nav.geometry import Scan

_UNKNOWN_CM = 65535
_BODY_FRD = 12
_FULL_TURN_DEG = 360.0


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
    is_sound = math.isfinite(increment_deg) and math.isfinite(offset_rad) and increment_deg != 0.0
    if not is_sound or not nearest_m < furthest_m:
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
