"""amcl of robots whose navigators share the simulator's process: scans and odometry by calls."""

from __future__ import annotations

from typing import Mapping, Sequence

import numpy as np
import rospy
from geometry_msgs.msg import TransformStamped

from quad_localization.localizer import Observation
from quad_localization.ros.amcl_robot import AmclRobot
from quad_localization.ros.transform_topic import TransformTopic
from quad_localization.warm_up import warm_up_amcl
from quad_nav.config import Configuration
from quad_nav.files.kernel_cache import COMPILING, announced
from quad_nav.geometry import Pose3D, Scan
from quad_nav.ros.common.conversions import time_message
from quad_nav.ros.common.diagnostics import publish_health
from quad_nav.ros.composed.localization import TransformLocalization
from quad_nav.ros.composed.transforms import ComposedTransforms
from quad_nav.topics.publishing import Names

_NUMBERED = ("initialpose", "amcl_pose", "particlecloud")
_OWN = ("global_localization", "request_nomotion_update", "set_map")


class ComposedAmcl(TransformLocalization):
    """One amcl for each robot of the process. What it finds goes the way of every transform."""

    def __init__(
        self,
        transforms: ComposedTransforms,
        configurations: Mapping[int, Configuration],
        robots: Sequence[int],
    ) -> None:
        super().__init__(transforms, configurations)
        with announced(lambda: rospy.loginfo("%s", COMPILING)):
            warm_up_amcl()
        self._topic = TransformTopic()
        self._amcls = {i: AmclRobot(transforms, self._send, _in_fleet(i)) for i in robots}
        publish_health(lambda: [one.health() for one in self._amcls.values()])

    def _send(self, transform: TransformStamped) -> None:
        self.transforms.add(transform)
        self._topic.send(transform)

    def add_scan(
        self, robot: int, scan: Scan, odom_from_base: Pose3D, odom_from_lidar: Pose3D
    ) -> None:
        """Take a scan."""
        amcl, mount = self._amcls[robot], odom_from_base.inverse().compose(odom_from_lidar)
        peers = self.peer_places(robot) if amcl.leaves_out_peers else np.empty((0, 2))
        seen = Observation(f"Lidar{robot}", scan, mount, odom_from_base, peers)
        amcl.localise(time_message(scan.stamp_s), seen)

    def reset(self) -> None:
        """Begin anew at the start poses: the simulation is reset."""
        super().reset()
        self._topic.forget()
        for amcl in self._amcls.values():
            amcl.reset()


def _in_fleet(number: int) -> Names:
    """Return the names that the remaps of `launch/amcl.launch` lead to."""
    node = f"/amcl{number}"

    def resolved(name: str) -> str:
        if name.startswith("~"):
            return f"{node}/{name[1:]}".rstrip("/")
        if name in _NUMBERED:
            return f"/{name}{number}"
        return f"{node}/{name}" if name in _OWN else f"/{name}"

    return resolved
