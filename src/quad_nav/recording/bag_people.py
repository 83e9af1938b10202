"""Read the places of people who react to quadcopters from a recording."""

from __future__ import annotations

from pathlib import Path
from typing import List, Optional

import numpy as np
from numpy.typing import NDArray

from quad_nav.errors import InputError
from quad_nav.recording.bag_file import FlightClock, read_messages
from quad_nav.sim.crowd_record import CrowdRecord
from quad_nav.sim.scene import Scene
from quad_nav.topics.obstacle_poses import (
    OBSTACLES_PERIOD_S,
    POSES_KIND,
    POSES_TOPIC,
    people_positions,
)

_PERIOD_S = 1.5 * OBSTACLES_PERIOD_S  # at most, on a loaded machine


def read_people(
    path: Path, scene: Scene, clock: FlightClock, end_s: float
) -> Optional[CrowdRecord]:
    """Read the places of people who react from ``POSES_TOPIC``; None without such people.

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
    positions: List[NDArray[np.float64]] = []
    for message in read_messages(path, _is_wanted):
        try:
            positions.append(people_positions(message.content.poses, scene))
        except ValueError as error:
            raise InputError([f"{path}: {POSES_TOPIC}: {error}"]) from error
        stamps_ns.append(message.stamp_ns)
    times_s = clock.times_s(np.array(stamps_ns, np.int64)).tolist()
    if times_s and 0.0 < end_s - times_s[-1] <= _PERIOD_S:
        times_s.append(end_s)
        positions.append(positions[-1])
    for time_s, places in zip(times_s, positions):
        record.add(time_s, places)
    return record


def _is_wanted(topic: str, kind: str) -> bool:
    return (topic, kind) == (POSES_TOPIC, POSES_KIND)
