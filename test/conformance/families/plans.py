"""Comparing plans: recorded ones have poses, ours rows x, y, yaw."""

from __future__ import annotations

import numpy as np

from families.comparison import Comparison
from quad_nav.geometry import angle_difference, yaw_from_quaternion

NO_PLAN = np.zeros((0, 3))


def compare_plans(
    comparison: Comparison,
    field: str,
    plan: np.ndarray,
    recorded: np.ndarray,
    tolerance_m: float,
    tolerance_rad: float,
) -> None:
    """plan: float64[n, 3]; recorded: float64[n, 7], x, y, z, qx, qy, qz, qw."""
    comparison.near(field, plan[:, :2], recorded[:, :2], tolerance_m)
    turns = [
        angle_difference(yaw, yaw_from_quaternion(quaternion))
        for yaw, quaternion in zip(plan[:, 2], recorded[:, 3:])
    ]
    comparison.near(f"{field} (yaw, apart)", turns, np.zeros(len(turns)), tolerance_rad)
