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

from quad_nav.errors import excerpt
from quad_nav.files.values import memory_problem
from quad_nav.geometry import Pose3D, Scan, Twist2D
from quad_nav.sim.contacts import Contact

MAX_BEAMS = 100_000
MAX_POINTS = 1_000_000
MAX_POSES = 100_000
MAX_CORNERS = 1_000
MAX_CELLS = 10**8
MAX_TIME_S = 2.0**32
"""End of the range of ROS times."""
MAX_MAGNITUDE = 1e6
"""Largest accepted position coordinate in m, and speed in m/s or rad/s."""
MAX_OUTLINE_M = 100.0
"""Largest accepted coordinate of a footprint; what peers compute grows with it."""
MAX_ANGLE_RAD = 1e3
"""Largest accepted first angle of a scan, and largest angle between two beams."""
MAX_FRAME_ID = 200
MAX_GOAL_ID = 256
MAX_LEAD_S = 1.0
"""Largest accepted lead of a stamp over the clock; a larger one dates from before a clock jump."""
MAX_STAMP_S = 2.0**31 - 3600.0
"""Largest accepted stamp, in 2038: tf2 aborts when two stamps are 2**31 s apart."""
MIN_RESOLUTION_M, MAX_RESOLUTION_M = 1e-3, 100.0
MAX_TEXT = 10_000
"""Characters of a text that are kept."""
_PLANAR = [0, 1, 5]  # vx, vy and vyaw of a twist


def shown_text(text: str) -> str:
    """Return a text without unprintable characters, which would break text output."""
    return "".join(c for c in text[:MAX_TEXT] if c.isprintable() or c == "\n")


def stamp_problem(stamp_s: float, now_s: float) -> str:
    """Check that a stamp is not from the future."""
    if stamp_s - now_s > MAX_LEAD_S:
        return (
            f"stamped {stamp_s - now_s:.2f} s ahead of the clock, expected {MAX_LEAD_S:g} s at most"
        )
    return "" if stamp_s <= MAX_STAMP_S else f"stamp {stamp_s:.2f} s, expected {MAX_STAMP_S:.0f} s"


def frame_problem(frame: str) -> str:
    """Check that the name of a frame is one that tf2 can look up."""
    if 0 < len(frame) <= MAX_FRAME_ID and frame.isprintable() and frame[0] != "/":
        return ""
    return f"frame '{excerpt(frame)}', expected a name of 1 to {MAX_FRAME_ID} characters"


def goal_id_problem(goal_id: str, stamp_s: float, now_s: float) -> str:
    """Check the id of an action's goal or cancel request, and its stamp."""
    if len(goal_id) > MAX_GOAL_ID:
        return f"id '{excerpt(goal_id, 20)}', expected {MAX_GOAL_ID} characters at most"
    return stamp_problem(stamp_s, now_s)


def scan_problem(scan: Scan) -> str:
    """Check the angles, the limits and the number of beams of a scan.

    The ranges themselves may hold any value: consumers use only those between the limits.
    """
    numbers = (scan.angle_min_rad, scan.angle_increment_rad, scan.range_min_m)
    if not all(map(math.isfinite, numbers)) or math.isnan(scan.range_max_m):
        return "angles or range limits are not finite"
    beams = len(scan.ranges_m)
    if not 0 < beams <= MAX_BEAMS:
        return f"{beams} beams, expected 1 to {MAX_BEAMS}"
    if max(abs(scan.angle_min_rad), abs(scan.angle_increment_rad)) > MAX_ANGLE_RAD:
        return (
            f"angle_min {scan.angle_min_rad:g} rad and angle_increment"
            f" {scan.angle_increment_rad:g} rad, expected {MAX_ANGLE_RAD:g} rad at most"
        )
    if beams > 1 and scan.angle_increment_rad == 0.0:
        return f"angle_increment 0 rad between {beams} beams, expected another value"
    if not 0.0 <= scan.range_min_m < scan.range_max_m:
        return (
            f"ranges from {scan.range_min_m:g} to {scan.range_max_m:g} m, expected range_min from 0"
            " to less than range_max"
        )
    return ""


def footprint_problem(points: NDArray[np.float64]) -> str:
    """Check that a footprint, float64[n, 2] in metres, is a polygon of finite points."""
    if not 3 <= len(points) <= MAX_CORNERS:
        return f"{len(points)} points, expected 3 to {MAX_CORNERS}"
    if not (np.abs(points) <= MAX_OUTLINE_M).all():
        return f"coordinates that are not finite or beyond {MAX_OUTLINE_M:g} m"
    return ""


def pose_problem(pose: Pose3D) -> str:
    """Check that the position is finite and the quaternion close to unit length."""
    x, y, z, w = pose.quaternion
    length = math.sqrt(x * x + y * y + z * z + w * w)
    most = MAX_MAGNITUDE
    if not (-most <= pose.x_m <= most and -most <= pose.y_m <= most and -most <= pose.z_m <= most):
        return (
            f"position ({pose.x_m:g}, {pose.y_m:g}, {pose.z_m:g}) m, expected finite coordinates"
            f" up to {MAX_MAGNITUDE:g} m"
        )
    return "" if 0.9 < length < 1.1 else f"quaternion of length {length:g}, expected 1"


def twist_problem(twist: Twist2D) -> str:
    """Check that every component of a velocity is finite."""
    vx, vy, vyaw, most = twist.vx_mps, twist.vy_mps, twist.vyaw_radps, MAX_MAGNITUDE
    if -most <= vx <= most and -most <= vy <= most and -most <= vyaw <= most:
        return ""
    return f"velocity {(vx, vy, vyaw)}, expected finite numbers up to {MAX_MAGNITUDE:g}"


def odometry_problem(frame: str, odom_from_base: Pose3D, velocity: Twist2D) -> str:
    """Check the frame, the pose and the velocity of an odometry message."""
    return (
        frame_problem(frame.lstrip("/")) or pose_problem(odom_from_base) or twist_problem(velocity)
    )


def valid_states(
    poses: NDArray[np.float64], twists: NDArray[np.float64]
) -> Tuple[NDArray[np.bool_], str]:
    """Check the states of many robots, as `pose_problem` and `twist_problem` check one.

    Args:
        poses: float64[n, 7], positions in m and quaternions (x, y, z, w).
        twists: float64[n, 6], velocities in m/s and angular velocities in rad/s.

    Returns:
        Mask bool[n] of the valid states, and what is wrong with the first invalid one.
    """
    planar = twists[:, _PLANAR]
    lengths = np.sqrt(np.einsum("ij,ij->i", poses[:, 3:], poses[:, 3:]))
    valid = (
        (np.abs(poses[:, :3]) <= MAX_MAGNITUDE).all(axis=1)
        & (lengths > 0.9)
        & (lengths < 1.1)
        & (np.abs(planar) <= MAX_MAGNITUDE).all(axis=1)
    )
    if valid.all():
        return valid, ""
    row = int(np.argmin(valid))
    x, y, z, *quaternion = poses[row].tolist()
    pose = Pose3D(x, y, z, (quaternion[0], quaternion[1], quaternion[2], quaternion[3]))
    return valid, pose_problem(pose) or twist_problem(Twist2D(*planar[row].tolist()))


def contact_problem(contact: Contact) -> str:
    """Check the time, the position and the names of a contact."""
    x_m, y_m = contact.x_m, contact.y_m
    if not 0.0 <= contact.time_s <= MAX_TIME_S:
        return f"time {contact.time_s:g} s, expected 0 to {MAX_TIME_S:g}"
    if not (abs(x_m) <= MAX_MAGNITUDE and abs(y_m) <= MAX_MAGNITUDE):
        return f"position ({x_m:g}, {y_m:g}) m, expected finite numbers up to {MAX_MAGNITUDE:g}"
    longest = max(len(contact.robot), len(contact.other))
    return (
        ""
        if longest <= MAX_FRAME_ID
        else f"name of {longest} characters, expected {MAX_FRAME_ID} or less"
    )


def path_problem(path: NDArray[np.float64]) -> str:
    """Check the length of a path and that its points are finite.

    Args:
        path: Shape (n, 2), x and y in m.
    """
    if len(path) > MAX_POSES:
        return f"{len(path)} poses, expected {MAX_POSES} at most"
    return "" if np.all(np.abs(path) <= MAX_MAGNITUDE) else "poses are not finite"


def grid_problem(
    width: int,
    height: int,
    resolution_m: float,
    values: int,
    origin_m: Tuple[float, float] = (0.0, 0.0),
    bytes_per_cell: int = 1,
) -> str:
    """Check the size and the resolution of a grid message.

    Args:
        width: Number of columns that the message states.
        height: Number of rows that the message states.
        resolution_m: Side of a cell.
        values: Number of cells that the message carries.
        origin_m: Lower left corner of the grid.
        bytes_per_cell: Memory that each cell takes here.
    """
    if not 0 < width * height <= MAX_CELLS:
        return f"{width} x {height} cells, expected 1 to {MAX_CELLS}"
    advice = "a map with fewer or larger cells"
    problem = memory_problem(width, height, "cells", bytes_per_cell, advice)
    if problem:
        return problem
    if width * height != values:
        return f"{values} values for {width} x {height} cells"
    if not MIN_RESOLUTION_M <= resolution_m <= MAX_RESOLUTION_M:
        return (
            f"resolution {resolution_m:g} m, expected {MIN_RESOLUTION_M:g} to {MAX_RESOLUTION_M:g}"
        )
    if not all(abs(value) <= MAX_MAGNITUDE for value in origin_m):
        return (
            f"origin ({origin_m[0]:g}, {origin_m[1]:g}) m, expected finite coordinates up to"
            f" {MAX_MAGNITUDE:g} m"
        )
    return ""


class CommandLease:
    """Accept velocity commands from one node at a time for each quadcopter.

    The first node that sends a command holds the lease until its last command has expired.

    Attributes:
        valid_s: Time for which a command stays in force.
    """

    def __init__(self, valid_s: float) -> None:
        """Start without holders; `valid_s` is how long a command stays in force."""
        self.valid_s = valid_s
        self._holders: Dict[int, Tuple[str, float]] = {}  # node, and when its lease expires

    def holder(self, robot: int, node: str, now_s: float) -> str:
        """Return the node that controls a robot, now that `node` has sent it a command."""
        holder, until_s = self._holders.get(robot, (node, now_s))
        if holder != node and now_s < until_s:
            return holder
        self._holders[robot] = node, now_s + self.valid_s
        return node

    def clear(self) -> None:
        """Release all leases."""
        self._holders.clear()
