"""Comparing plans: recorded ones have poses, ours rows x, y, yaw."""

from __future__ import annotations

import numpy as np

from families.comparison import Comparison
from quad_nav.geometry import quaternion_from_yaw

NO_PLAN = np.zeros((0, 3))


def compare_plans(
    comparison: Comparison, field: str, plan: np.ndarray, recorded: np.ndarray
) -> None:
    """To the last bit. plan: float64[n, 3]; recorded: float64[n, 7], x, y, z, qx, qy, qz, qw."""
    poses = [(x, y, 0.0, *quaternion_from_yaw(yaw)) for x, y, yaw in plan.tolist()]
    comparison.exact(field, np.reshape(poses, (-1, 7)), recorded)
