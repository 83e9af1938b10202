"""Positions of peers: amcl leaves out the beams that end on them."""

from __future__ import annotations

from typing import Dict, Tuple

import numpy as np
from nav_msgs.msg import Odometry
from numpy.typing import NDArray

from quad_nav.ros.common.conversions import pose_from_message, time_message
from quad_nav.ros.common.packed_messages import States
from quad_nav.ros.common.state_topics import StateTopics
from quad_nav.ros.common.transforms import Transforms, TransformUnavailable
from quad_nav.ros.navigator.robot_identity import MAX_ROBOTS
from quad_nav.topics.validation import pose_problem

_FORGET_S = 1.0


class PeerPlaces:
    """Places of the other robots that publish their states or their odometry."""

    def __init__(self, robot: int, transforms: Transforms) -> None:
        """Listen to all robots but one."""
        self._robot, self._transforms = robot, transforms
        self._places: Dict[int, Tuple[str, float, float, float]] = {}  # frame, stamp, x, y
        self._topics = StateTopics(
            MAX_ROBOTS, self._on_states, self._on_odometry, only_published=True
        )

    def _on_states(self, states: States) -> bool:
        for robot, pose in zip(states.robots.tolist(), states.poses.tolist()):
            self._places[robot] = (states.frame, states.stamp_s, pose[0], pose[1])
        return True

    def _on_odometry(self, robot: int, message: Odometry) -> None:
        pose, header = pose_from_message(message.pose.pose), message.header
        if not pose_problem(pose):
            place = (header.frame_id, header.stamp.to_sec(), pose.x_m, pose.y_m)
            self._places[robot] = place

    def check(self) -> None:
        """Find robots that have come; call it often."""
        self._topics.check()

    def at(self, stamp_s: float, frame: str) -> NDArray[np.float64]:
        """Return the places float64[k, 2] of peers in a frame that are known at a time."""
        self._topics.read()
        found = []
        for robot, (source, seen_s, x_m, y_m) in list(self._places.items()):
            if robot == self._robot or abs(stamp_s - seen_s) > _FORGET_S:
                continue
            try:
                pose = self._transforms.lookup_near(frame, source, time_message(seen_s))
            except TransformUnavailable:
                continue  # a robot that is not localised
            found.append(pose.to_2d().transform(x_m, y_m))
        return np.array(found, np.float64).reshape(-1, 2)
