"""Moving obstacles of the scene, as the simulator tells of them."""

from __future__ import annotations

from typing import Dict, List, Optional

import numpy as np
from geometry_msgs.msg import PoseArray
from numpy.typing import NDArray

from quad_nav.ros.common.diagnostics import ThrottledWarnings
from quad_nav.sim.obstacles import Obstacle
from quad_nav.sim.scene import Scene
from quad_nav.topics.obstacle_poses import POSES_TOPIC, moving_poses
from quad_web.ros.intake import Newest, Topic
from quad_web.view.items import ObstacleItems
from quad_web.view.state import Item

_NO_POSES: NDArray[np.float64] = np.zeros((0, 3))


class Obstacles:
    """The newest poses of the obstacles that move."""

    def __init__(self) -> None:
        """Start without obstacles."""
        self._newest = Newest(POSES_TOPIC, PoseArray)
        self._items = ObstacleItems()
        self._scene: Optional[Scene] = None
        self._poses = _NO_POSES
        self._warnings = ThrottledWarnings()

    def start(self) -> None:
        """Forget where they were: the first client has come."""
        self._newest.take_bytes()
        self._items.clear()
        self._poses = _NO_POSES

    def topics(self, scene: Optional[Scene]) -> Dict[str, Topic]:
        """Return the topic to subscribe to; none without moving obstacles in the scene."""
        if scene is None or not scene.moving_shapes:
            return {}
        return {POSES_TOPIC: self._newest.topic}

    def items(self, scene: Optional[Scene]) -> List[Item]:
        """Return the item if the obstacles of the scene have moved."""
        if scene is not self._scene:
            self._scene, self._poses = scene, _NO_POSES
        try:
            message = self._newest.take()
            if scene is None or message is None:
                return []
            self._poses = moving_poses(message.poses, len(scene.moving_shapes))
        except ValueError as error:
            self._warnings.warn(f"web: {POSES_TOPIC}: message dropped: {error}")
            return []
        return self._items.items(scene, self._poses)

    def solids(self) -> List[Obstacle]:
        """Return the obstacles where they are; none before the first message."""
        if self._scene is None or not len(self._poses):
            return []
        return self._scene.moving_solids(self._poses)
