"""Moving obstacles of a recorded flight at any time."""

from __future__ import annotations

from pathlib import Path
from typing import List, Optional, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.errors import InputError
from quad_nav.recording.bag_file import FlightClock, read_messages
from quad_nav.recording.bag_index import RecordingIndex
from quad_nav.sim.crowd_record import CrowdRecord
from quad_nav.sim.movers import Movers
from quad_nav.sim.scene import Obstacle, Scene
from quad_nav.topics.markers import (
    OBSTACLES_PERIOD_S,
    OBSTACLES_TOPIC,
    moving_poses,
    people_positions,
)
from quad_web.view.items import ObstacleItems, moving_solids
from quad_web.view.state import Item

Floats = NDArray[np.float64]

_PERIOD_S = 1.5 * OBSTACLES_PERIOD_S  # at most, on a loaded machine


class ObstacleTrack:
    """Where the moving obstacles of a scene are.

    As the recording has them on ``/simulation/obstacles``. Without that topic, and before its first
    message, they are computed from scene and seed, which does not tell where people are who react
    to quadcopters.
    """

    def __init__(
        self,
        scene: Optional[Scene],
        seed: Optional[int],
        index: RecordingIndex,
        times_s: Optional[Floats],
    ) -> None:
        """Look up obstacles.

        Args:
            scene: The scene; without one there are no obstacles.
            seed: The flight's seed.
            index: The recording.
            times_s: Times of the topic's messages, float64[n]; None without the topic.
        """
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
            message = self._index.read(OBSTACLES_TOPIC, number).content
            try:
                poses = moving_poses(message.markers, count)
            except ValueError as error:
                raise InputError([f"{OBSTACLES_TOPIC}: message {number}: {error}"]) from error
            self._last = number, poses
        return self._last[1]

    def items(self, time_s: float) -> List[Item]:
        """Return the item ``obstacles`` at a time, unless it is as the last one."""
        return [] if self._scene is None else self._items.items(self._scene, self.poses(time_s))

    def solids(self, time_s: float) -> List[Obstacle]:
        """Return the obstacles where they are, without those of which it is unknown."""
        return [] if self._scene is None else moving_solids(self._scene, self.poses(time_s))


def read_people(
    path: Path, scene: Scene, clock: FlightClock, end_s: float
) -> Optional[CrowdRecord]:
    """Read the places of people who react from ``/simulation/obstacles``; None without such people.

    Args:
        path: The recording.
        scene: The scene.
        clock: The clock of the flight.
        end_s: Time of the last pose of a robot: up to then people stand where they were seen last,
            if that was in the topic's last period.

    Raises:
        InputError: The file is damaged, or a message is not of this scene.
    """
    record = CrowdRecord.of(scene)
    if record is None:
        return None
    stamps_ns: List[int] = []
    positions: List[Floats] = []
    for message in read_messages(path, _is_wanted):
        try:
            positions.append(people_positions(message.content.markers, scene))
        except ValueError as error:
            raise InputError([f"{path}: {OBSTACLES_TOPIC}: {error}"]) from error
        stamps_ns.append(message.stamp_ns)
    times_s = clock.times_s(np.array(stamps_ns, np.int64)).tolist()
    if times_s and 0.0 < end_s - times_s[-1] <= _PERIOD_S:
        times_s.append(end_s)
        positions.append(positions[-1])
    for time_s, places in zip(times_s, positions):
        record.add(time_s, places)
    return record


def _is_wanted(topic: str, kind: str) -> bool:
    return (topic, kind) == (OBSTACLES_TOPIC, "visualization_msgs/MarkerArray")
