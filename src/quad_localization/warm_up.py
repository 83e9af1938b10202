"""Compile the kernels of localization before anything flies; numba caches them."""

from __future__ import annotations

import math

import numpy as np

from quad_localization.slam import Slam
from quad_nav.geometry import Pose2D, Pose3D, Scan


def localize() -> None:
    """Take a turn in a round room."""
    ranges_m = np.full(64, 2.0, np.float32)
    scan = Scan(0.0, -math.pi, math.tau / len(ranges_m), 0.02, 60.0, ranges_m)
    slam = Slam({0: Pose2D(0.0, 0.0), 1: Pose2D(0.1, 0.0)})
    for robot in (0, 1):
        slam.add_scan(robot, scan, Pose2D(0.0, 0.0), Pose3D(0.0, 0.0, 1.0))


if __name__ == "__main__":
    localize()
