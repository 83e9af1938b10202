"""Moving obstacles of the scene, as the simulator tells of them."""

from __future__ import annotations

from collections import deque
from typing import Deque, Dict, List, Optional, Tuple

import numpy as np
from geometry_msgs.msg import PoseArray
from numpy.typing import NDArray

from quad_nav.ros.common.diagnostics import ThrottledWarnings
from quad_nav.sim.movers import moving_distances_m
from quad_nav.sim.scene import Scene
from quad_nav.topics.obstacle_poses import POSES_TOPIC, moving_poses
from quad_web.ros.intake import Newest, Topic
from quad_web.view.items import ObstacleItems
from quad_web.view.state import Item

_KEPT = 200
"""Messages of 0.1 s each: more than a page's samples last at full speed."""

Floats = NDArray[np.float64]


class Obstacles:
    """The last poses of the obstacles that move."""

    def __init__(self) -> None:
        """Start without obstacles."""
        self._newest = Newest(POSES_TOPIC, PoseArray, _KEPT)
        self._items = ObstacleItems()
        self._scene: Optional[Scene] = None
        self._poses: Deque[Tuple[float, Floats]] = deque(maxlen=_KEPT)  # with their times
        self._warnings = ThrottledWarnings()

    def start(self) -> None:
        """Forget where they were: the first client has come."""
        self._newest.clear()
        self._items.clear()
        self._poses.clear()

    def topics(self, scene: Optional[Scene]) -> Dict[str, Topic]:
        """Return the topic to subscribe to; none without moving obstacles in the scene."""
        if scene is None or not scene.moving_shapes:
            return {}
        return {POSES_TOPIC: self._newest.topic}

    def items(self, scene: Optional[Scene]) -> List[Item]:
        """Return the item if the obstacles of the scene have moved."""
        if scene is not self._scene:
            self._scene = scene
            self._poses.clear()
        try:
            messages = self._newest.take_all()
            if scene is None or not messages:
                return []
            for one in messages:
                poses = moving_poses(one.poses, len(scene.moving_shapes))
                self._poses.append((one.header.stamp.to_sec(), poses))
        except ValueError as error:
            self._warnings.warn(f"web: {POSES_TOPIC}: message dropped: {error}")
            return []
        return self._items.items(scene, self._poses[-1][1])

    def distances_m(self, scene: Scene, positions: Floats, times_s: Floats) -> Floats:
        """Return the distances of points float64[k, 2] at times to the nearest surface.

        What moves is where the message of the nearest time has it; without one it is left out.
        """
        distances_m = scene.flight_surface_distances_m(positions)
        if scene is not self._scene or not self._poses:
            return distances_m
        stamps_s = np.array([stamp_s for stamp_s, _ in self._poses])
        nearest = np.abs(stamps_s - times_s[:, None]).argmin(axis=1)
        poses = np.array([poses for _, poses in self._poses])[nearest]
        return np.minimum(distances_m, moving_distances_m(scene, poses, positions))
