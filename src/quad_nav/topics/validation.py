"""Accept or reject incoming messages: any node can publish on a topic.

Each `..._problem` function returns what is wrong with a message, or "" if the message is valid.
The caller drops an invalid message and logs a warning. A topic that carries only invalid messages
times out like a topic without messages. `CommandLease` selects the node whose commands count.
"""

from __future__ import annotations

import math
from typing import Dict, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.geometry import Pose3D, Scan, Twist2D

MAX_BEAMS = 100_000
MAX_POINTS = 1_000_000
MAX_POSES = 100_000
MAX_CELLS = 10**8
MAX_MAGNITUDE = 1e6
"""Largest accepted position coordinate in m, and speed in m/s or rad/s."""


def scan_problem(scan: Scan) -> str:
    """Check the angles, the limits and the number of beams of a scan.

    The ranges themselves may hold any value: consumers use only those between the limits.
    """
    numbers = (scan.angle_min_rad, scan.angle_increment_rad, scan.range_min_m)
    if not all(map(math.isfinite, numbers)) or math.isnan(scan.range_max_m):
        return "angles or range limits are not finite"
    if len(scan.ranges_m) > MAX_BEAMS:
        return f"{len(scan.ranges_m)} beams, expected {MAX_BEAMS} at most"
    return ""


def pose_problem(pose: Pose3D) -> str:
    """Check that the position is finite and the quaternion close to unit length."""
    length = math.sqrt(sum(part * part for part in pose.quaternion))
    if not all(abs(value) <= MAX_MAGNITUDE for value in (pose.x_m, pose.y_m, pose.z_m)):
        return (
            f"position ({pose.x_m:g}, {pose.y_m:g}, {pose.z_m:g}) m, expected finite coordinates"
            f" up to {MAX_MAGNITUDE:g} m"
        )
    return "" if 0.9 < length < 1.1 else f"quaternion of length {length:g}, expected 1"


def twist_problem(twist: Twist2D) -> str:
    """Check that every component of a velocity is finite."""
    values = (twist.vx_mps, twist.vy_mps, twist.vyaw_radps)
    if all(abs(value) <= MAX_MAGNITUDE for value in values):
        return ""
    return f"velocity {values}, expected finite numbers up to {MAX_MAGNITUDE:g}"


def path_problem(path: NDArray[np.float64]) -> str:
    """Check the length of a path and that its points are finite.

    Args:
        path: Shape (n, 2), x and y in m.
    """
    if len(path) > MAX_POSES:
        return f"{len(path)} poses, expected {MAX_POSES} at most"
    return "" if np.all(np.abs(path) <= MAX_MAGNITUDE) else "poses are not finite"


def grid_problem(width: int, height: int, resolution_m: float, values: int) -> str:
    """Check the size and the resolution of a grid message.

    Args:
        width: Number of columns that the message states.
        height: Number of rows that the message states.
        resolution_m: Side of a cell.
        values: Number of cells that the message carries.
    """
    if not 0 < width * height <= MAX_CELLS:
        return f"{width} x {height} cells, expected 1 to {MAX_CELLS}"
    if width * height != values:
        return f"{values} values for {width} x {height} cells"
    if not (math.isfinite(resolution_m) and resolution_m > 0.0):
        return f"resolution {resolution_m:g} m, expected more than 0"
    return ""


class CommandLease:
    """Accept velocity commands from one node at a time for each quadcopter.

    The first node that sends a command holds the lease until its last command has expired.
    """

    def __init__(self, valid_s: float) -> None:
        """Start without holders; `valid_s` is how long a command stays in force."""
        self._valid_s = valid_s
        self._holders: Dict[int, Tuple[str, float]] = {}  # node, and when its lease expires

    def holder(self, robot: int, node: str, now_s: float) -> str:
        """Return the node that controls a robot, now that `node` has sent it a command."""
        holder, until_s = self._holders.get(robot, (node, now_s))
        if holder != node and now_s < until_s:
            return holder
        self._holders[robot] = node, now_s + self._valid_s
        return node

    def clear(self) -> None:
        """Release all leases."""
        self._holders.clear()
