"""Transforms of a composed fleet: those of other nodes, and the frames of the simulated robots."""

from __future__ import annotations

from typing import Optional, Tuple

import rospy
from geometry_msgs.msg import TransformStamped

from quad_nav.geometry import Pose3D
from quad_nav.ros.common.conversions import time_message, transform_message
from quad_nav.ros.common.transforms import Transforms
from quad_nav.sim.lidar import base_from_lidar
from quad_nav.sim.odometry import pose_in
from quad_nav.sim.robot_state import RobotStates


class ComposedTransforms(Transforms):
    """Transform tree to which the robots' frames are added when a lookup needs them.

    Few lookups are needed: a robot's own poses come from the loop.
    """

    def __init__(self, localizes: bool = True) -> None:
        """Subscribe; without ``localizes`` somebody else knows the odometry frames in `map`."""
        super().__init__()
        self._localizes = localizes
        self._present: Optional[Tuple[float, RobotStates]] = None
        self._stored_s = -1.0

    def update(self, now_s: float, states: RobotStates) -> None:
        """Take the states of all robots at a simulated time."""
        self._present = now_s, states

    def add(self, transform: TransformStamped) -> None:
        """Add a transform of this process."""
        with self._lock:
            self._update_time()
            self._store(transform, is_static=False)

    def forget(self) -> None:
        """Forget the transforms so far, after a reset."""
        with self._lock:
            self._filter.clear()

    def store(self) -> None:
        """Add the frames of all robots as they are now, once for each time."""
        present = self._present
        if present is None or present[0] == self._stored_s:
            return
        now_s, states = present
        self._stored_s = now_s
        stamp = time_message(now_s)
        with self._lock:
            self._update_time()
            for robot, state in enumerate(states):
                map_from_odom = states.frames.map_from_odom(robot)
                odom_from_base = pose_in(map_from_odom, state.map_from_base)
                odom, base, lidar = f"odom{robot}", f"base_link{robot}", f"Lidar{robot}"
                transforms = (
                    (map_from_odom.to_3d(), "map", odom),
                    (odom_from_base, odom, base),
                    (base_from_lidar, base, lidar),
                )
                for pose, parent, child in transforms[0 if self._localizes else 1 :]:
                    self._store(transform_message(pose, parent, child, stamp), is_static=False)

    def _lookup(
        self, to_frame: str, from_frame: str, stamp: Optional[rospy.Time]
    ) -> Tuple[Pose3D, float]:
        self.store()
        return super()._lookup(to_frame, from_frame, stamp)
