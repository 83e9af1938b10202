"""Hand the poses of all robots to their links, and wake the threads that have something to do.

A step of a robot's thread takes all poses since the step before. A message with the states of all
robots therefore wakes only the threads of robots that are at their goals, and of those whose next
step is due.
"""

from __future__ import annotations

import threading
from typing import List, Optional

import numpy as np

from quad_nav.ros.common.packed_messages import States
from quad_nav.ros.common.state_topics import StateTopics
from quad_nav.ros.common.transforms import Transforms
from quad_nav.ros.sequencer.robot_link import RobotLink

QUEUE_SIZE = 100


class StateFeed:
    """Receive the poses of all robots of a mission.

    Attributes:
        links: Links of the robots.
    """

    def __init__(self, robots: int) -> None:
        """Connect to the topics of some robots."""
        # x and y of the goal in map, distance from it and time at which the thread wakes up.
        self._wake = np.zeros((robots, 4))
        self.links: List[RobotLink] = [RobotLink(k, self._wake[k]) for k in range(robots)]
        self._topics = StateTopics(
            robots,
            self._on_states,
            lambda robot, message: self.links[robot].receive_odometry(message),
            queue_size=QUEUE_SIZE,
        )

        self._lock = threading.Lock()
        self._transforms: Optional[Transforms] = None

    def transforms(self) -> Transforms:
        """Return the transform tree, which is received from the first call on.

        Only odometry needs it: states are in `map`.
        """
        with self._lock:
            if self._transforms is None:
                self._transforms = Transforms()
            return self._transforms

    def check(self) -> None:
        """Hear robots that no state message carries from their odometry; call it often."""
        self._topics.check()

    def _on_states(self, states: States) -> bool:
        if states.frame.lstrip("/") != "map":
            return False
        robots = states.robots.tolist()
        for robot, pose in zip(robots, states.poses):
            self.links[robot].receive_state((states.stamp_s, pose))
        wake = self._wake[states.robots]
        offsets_m = states.poses[:, :2] - wake[:, :2]
        is_near = np.hypot(offsets_m[:, 0], offsets_m[:, 1]) <= wake[:, 2]
        for row in np.flatnonzero(is_near | (states.stamp_s >= wake[:, 3])).tolist():
            self.links[robots[row]].received.set()
        return True
