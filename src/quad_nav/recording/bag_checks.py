"""Validate numbers of a recording: it may come from anywhere."""

from __future__ import annotations

import math
from typing import Iterable

from quad_nav.geometry import Pose3D

LARGEST_M = 1e6
_UNIT_WITHIN = 1e-2


def require_finite(values: Iterable[float], largest: float = LARGEST_M) -> None:
    """Check numbers.

    Raises:
        ValueError: A number is not finite or its magnitude exceeds ``largest``.
    """
    for value in values:
        if not abs(value) <= largest:
            raise ValueError(f"{value}, expected a finite number up to {largest:g}")


def checked_pose(pose: Pose3D) -> Pose3D:
    """Return the pose if its numbers are finite and its quaternion has unit length.

    Raises:
        ValueError: Otherwise.
    """
    require_finite((pose.x_m, pose.y_m, pose.z_m))
    length = math.sqrt(sum(part * part for part in pose.quaternion))
    if not abs(length - 1.0) < _UNIT_WITHIN:
        raise ValueError(f"rotation of length {length:g}, expected a unit quaternion")
    return pose
