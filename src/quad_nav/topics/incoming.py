"""What comes on topics, judged before anybody uses it: anyone may publish on them.

Each function says what is wrong, "" when nothing is. Whoever gets such a message drops it
and warns; what stops coming in this way is noticed like a sensor that has fallen silent.
"""

from __future__ import annotations

import math

import numpy as np

from quad_nav.geometry import Pose3D, Scan, Twist2D

MOST_BEAMS = 100_000
MOST_POINTS = 1_000_000
MOST_POSES = 100_000
MOST_CELLS = 10**8
LARGEST = 1e6
"""No place in metres and no speed in metres per second is beyond it."""


def scan_problem(scan: Scan) -> str:
    """Ranges may be anything, and count only between the limits; the rest has to be numbers."""
    numbers = (scan.angle_min_rad, scan.angle_increment_rad, scan.range_min_m)
    if not all(map(math.isfinite, numbers)) or math.isnan(scan.range_max_m):
        return "its angles or limits are not finite numbers"
    if len(scan.ranges_m) > MOST_BEAMS:
        return f"{len(scan.ranges_m)} beams, expected {MOST_BEAMS} at most"
    return ""


def pose_problem(pose: Pose3D) -> str:
    """A place that is finite, and a rotation."""
    length = math.sqrt(sum(part * part for part in pose.quaternion))
    if not all(abs(value) <= LARGEST for value in (pose.x_m, pose.y_m, pose.z_m)):
        return f"its place ({pose.x_m:g}, {pose.y_m:g}, {pose.z_m:g}) is not on this earth"
    return "" if 0.9 < length < 1.1 else f"its quaternion has the length {length:g}, expected 1"


def twist_problem(twist: Twist2D) -> str:
    values = (twist.vx_mps, twist.vy_mps, twist.vyaw_radps)
    if all(abs(value) <= LARGEST for value in values):
        return ""
    return f"its velocity {values} holds what is no finite number"


def way_problem(way: np.ndarray) -> str:
    """Points float64[n, 2]."""
    if len(way) > MOST_POSES:
        return f"{len(way)} poses, expected {MOST_POSES} at most"
    return "" if np.all(np.abs(way) <= LARGEST) else "its poses are not finite numbers"


def grid_problem(width: int, height: int, resolution_m: float, values: int) -> str:
    """Whether a message's cells are as many as it says."""
    if not 0 < width * height <= MOST_CELLS:
        return f"{width} x {height} cells, expected 1 to {MOST_CELLS}"
    if width * height != values:
        return f"{values} values for {width} x {height} cells"
    if not (math.isfinite(resolution_m) and resolution_m > 0.0):
        return f"cells of {resolution_m:g} m, expected more than 0"
    return ""
