"""Localization: robots that find their places by their scans, instead of knowing them.

Bodies and LIDARs stay where they are; navigators get what the robots believe.
"""

from __future__ import annotations

from typing import Callable, Optional, Protocol, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.geometry import Pose2D, Pose3D, Scan, multiply_quaternions, quaternion_from_yaw
from quad_nav.sim.flight import BodyState
from quad_nav.sim.odometry import OdomFrames
from quad_nav.sim.robot_state import RobotStates
from quad_nav.sim.scene import Scene

Estimate = Tuple[Pose2D, NDArray[np.float64]]
"""A pose in ``map``, and its covariance float64[3, 3] of x, y in metres and yaw in radians."""


class Localization(Protocol):
    """Finds the odometry frames of all robots in ``map``.

    Attributes:
        name: Name of the method, with which the topic of its estimates begins.
    """

    name: str = ""

    def add_scan(
        self, robot: int, scan: Scan, odom_from_base: Pose3D, odom_from_lidar: Pose3D
    ) -> None:
        """Take a scan, with the poses of the robot and of its LIDAR by odometry at its stamp."""

    def map_from_odom(self, robot: int) -> Pose2D:
        """Return where a robot's odometry frame is, as far as it knows."""

    def is_lost(self, robot: int) -> bool:
        """Return whether a robot does not know its place."""

    def estimate(self, robot: int) -> Optional[Estimate]:
        """Return where a robot believed itself at its last scan; None if that is not known."""
        return None

    def particles(self, robot: int) -> Optional[NDArray[np.float64]]:
        """Return particles float64[n, 3], poses in ``map``; None if the method has none."""
        return None

    def set_pose(self, robot: int, pose: Pose2D, covariance: NDArray[np.float64]) -> bool:
        """Tell a robot where it is in ``map``; return False if the method cannot be told."""
        return False

    def set_uniform(self, robot: int) -> bool:
        """Let a robot search the whole map; return False if the method cannot."""
        return False


_UNKNOWN: NDArray[np.float64] = np.full((3, 3), np.nan)
LocalizationMaker = Callable[[Scene, int], Localization]
"""Maker of the localization of a flight: of its scene, and the number of robots."""


def covariances(localization: Localization, robots: int) -> NDArray[np.float64]:
    """Return the covariances float64[n, 3, 3] of the robots' last estimates; NaN before them."""
    estimates = [localization.estimate(robot) for robot in range(robots)]
    return np.array([_UNKNOWN if one is None else one[1] for one in estimates])


def believed_states(states: RobotStates, localization: Optional[Localization]) -> RobotStates:
    """Return the states as the robots believe them; without localization they know them."""
    if localization is None:
        return states
    count, bodies = len(states), states.bodies
    rows, frames = bodies.rows.copy(), np.empty((count, 3))
    for robot in range(count):
        frame = localization.map_from_odom(robot)
        frames[robot] = frame.x_m, frame.y_m, frame.yaw_rad
        error = frame.compose(states.frames.map_from_odom(robot).inverse())
        row = rows[robot]
        row[:2] = error.transform(row[0], row[1])
        turn = quaternion_from_yaw(error.yaw_rad)
        x, y, z, w = row[3:7].tolist()
        row[3:7] = multiply_quaternions(turn, (x, y, z, w))
        row[7:9] = error.rotate(row[7], row[8])
        row[10:12] = error.rotate(row[10], row[11])
    return RobotStates(BodyState(rows, bodies.obstacles), OdomFrames(frames))
