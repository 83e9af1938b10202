"""Moving obstacles of a recorded flight at any time."""

from __future__ import annotations

from typing import List, Optional, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.errors import InputError
from quad_nav.sim.movers import Movers
from quad_nav.sim.obstacles import Obstacle
from quad_nav.sim.scene import Scene
from quad_nav.topics.obstacle_poses import POSES_TOPIC, moving_poses
from quad_web.replay.recording_index import RecordingIndex
from quad_web.view.items import ObstacleItems
from quad_web.view.state import Item

Floats = NDArray[np.float64]


class ObstacleTrack:
    """Where the moving obstacles of a scene are.

    As the recording has them on ``POSES_TOPIC``. Without that topic, and before its first message,
    they are computed from scene and seed, which does not tell where people are who react to
    quadcopters.
    """

    def __init__(
        self,
        scene: Optional[Scene],
        seed: Optional[int],
        index: RecordingIndex,
        times_s: Optional[Floats],
    ) -> None:
        """Look up obstacles; ``times_s`` are those of the topic's messages, None without it."""
        self._scene = scene if scene is not None and scene.moving_shapes else None
        self._index = index
        self._times_s = np.zeros(0) if times_s is None else times_s
        self._seed = seed
        self._movers: Optional[Movers] = None  # until it is needed
        self._items = ObstacleItems()
        self._last: Tuple[int, Floats] = (-1, np.zeros((0, 3)))

    def poses(self, time_s: float) -> Floats:
        """Return the poses (x_m, y_m, yaw_rad) in ``map``, float64[m, 3]; NaN where unknown.

        Raises:
            InputError: The recording is damaged there.
        """
        if self._scene is None:
            return np.zeros((0, 3))
        number = int(np.searchsorted(self._times_s, time_s, side="right")) - 1
        if number >= 0:
            return self._recorded(number, len(self._scene.moving_shapes))
        if self._movers is None:
            self._movers = Movers(self._scene, self._seed)
        return self._movers.poses(time_s)

    def _recorded(self, number: int, count: int) -> Floats:
        if self._last[0] != number:
            message = self._index.read(POSES_TOPIC, number).content
            try:
                poses = moving_poses(message.poses, count)
            except ValueError as error:
                raise InputError([f"{POSES_TOPIC}: message {number}: {error}"]) from error
            self._last = number, poses
        return self._last[1]

    def items(self, time_s: float) -> List[Item]:
        """Return the item ``obstacles`` at a time, unless it is as the last one."""
        return [] if self._scene is None else self._items.items(self._scene, self.poses(time_s))

    def solids(self, time_s: float) -> List[Obstacle]:
        """Return the obstacles where they are, without those of which it is unknown."""
        return [] if self._scene is None else self._scene.moving_solids(self.poses(time_s))
