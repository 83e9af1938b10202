"""Places of a composed fleet's robots as tf tells them, which its navigators believe."""

from __future__ import annotations

import importlib
import math
from typing import Mapping, Optional, Sequence

import numpy as np
import rospy
from numpy.typing import NDArray

from quad_nav.config import Configuration
from quad_nav.geometry import Pose2D, Pose3D, Scan
from quad_nav.ros.composed.transforms import ComposedTransforms
from quad_nav.scenario.rules import SIMULATOR
from quad_nav.sim.localization import Localization
from quad_nav.sim.robot_state import RobotStates

_TOLERANCE_S = 0.5  # for a robot whose navigator is elsewhere


class TransformLocalization(Localization):
    """Places by `map -> odom{i}` on tf, of whoever publishes it; topics take and show the rest.

    Attributes:
        transforms: Transform tree of this process.
    """

    def __init__(
        self, transforms: ComposedTransforms, configurations: Mapping[int, Configuration]
    ) -> None:
        """Start without a transform."""
        self.transforms = transforms
        self._tolerances_s = {
            robot: one.global_costmap.transform_tolerance_s for robot, one in configurations.items()
        }
        self._believed: Optional[RobotStates] = None

    def note(self, believed: RobotStates) -> None:
        """Take the states as the robots believe them."""
        self._believed = believed

    def peer_places(self, robot: int) -> NDArray[np.float64]:
        """Return the places float64[k, 2] in `map` of the other robots that know theirs."""
        if self._believed is None:
            return np.empty((0, 2))
        known = [j for j in range(len(self._believed)) if j != robot and not self.is_lost(j)]
        return self._believed.poses[known, :2]

    def add_scan(
        self, robot: int, scan: Scan, odom_from_base: Pose3D, odom_from_lidar: Pose3D
    ) -> None:
        """Take a scan. Other nodes have it from its topic."""

    def map_from_odom(self, robot: int) -> Pose2D:
        """Return where a robot's odometry frame is, as far as it is known."""
        found = self.transforms.locate("map", f"odom{robot}", rospy.get_time(), math.inf)
        return Pose2D(0.0, 0.0) if found is None else found.pose.to_2d()

    def is_lost(self, robot: int) -> bool:
        """Return whether the transform is missing, or older than the navigator tolerates."""
        tolerance_s = self._tolerances_s.get(robot, _TOLERANCE_S)
        now_s = rospy.get_time()
        return self.transforms.locate("map", f"odom{robot}", now_s, tolerance_s) is None

    def reset(self) -> None:
        """Begin anew: the simulation is reset."""
        self.transforms.forget()


def localization_of(
    name: str,
    transforms: ComposedTransforms,
    configurations: Mapping[int, Configuration],
    robots: Sequence[int],
) -> Optional[TransformLocalization]:
    """Return the localization of a process's robots; None if the simulator tells their places."""
    if name == SIMULATOR:
        return None
    if name != "amcl":
        return TransformLocalization(transforms, configurations)
    made: TransformLocalization = importlib.import_module(
        "quad_localization.ros.composed"
    ).ComposedAmcl(transforms, configurations, robots)
    return made
