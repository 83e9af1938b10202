"""True poses of robots that the simulator does not localize, from ``/quad/truth``."""

from __future__ import annotations

from typing import Dict, Optional

import numpy as np
from numpy.typing import NDArray

from quad_nav.errors import excerpt
from quad_nav.geometry import yaws_from_quaternions
from quad_nav.ros.common.diagnostics import ThrottledWarnings
from quad_nav.ros.common.packed_messages import StatesMessage, StatesReader
from quad_nav.topics.estimates import TRUTH_TOPIC
from quad_nav.topics.validation import valid_states

_KEPT = 400
"""Messages, of ten seconds: what robots believed is compared with them some time later."""
_WITHIN_S = 0.0126
"""Half a period of the topic: scans, and what is found by them, may have stamps between."""
Poses = Dict[int, NDArray[np.float64]]
"""Poses float64[3] of (x_m, y_m, yaw_rad) in ``map``, by the robots' numbers."""


class TrueStates:
    """The last poses on ``/quad/truth``, by their stamps. One thread calls ``add``."""

    def __init__(self) -> None:
        """Start without poses."""
        self._poses: Dict[float, Poses] = {}
        self._reader, self._warnings = StatesReader(), ThrottledWarnings()

    def add(self, message: StatesMessage) -> None:
        """Take a message."""
        try:
            states = self._reader.read(message)
            if states.frame.lstrip("/") != "map":
                raise ValueError(f"frame '{excerpt(states.frame)}', expected 'map'")
        except ValueError as error:
            self._warnings.warn(f"{TRUTH_TOPIC}: message dropped: {error}", kind=TRUTH_TOPIC)
            return
        states, kept = states.of(valid_states(states.poses, states.twists)[0]), self._poses
        yaws_rad = yaws_from_quaternions(states.poses[:, 3:])
        poses = np.column_stack([states.poses[:, :2], yaws_rad])
        kept[states.stamp_s] = dict(zip(states.robots.tolist(), poses))
        while len(kept) > _KEPT:
            del kept[next(iter(kept))]

    def find(self, robot: int, stamp_s: float) -> Optional[NDArray[np.float64]]:
        """Return where a robot was, float64[3] of (x_m, y_m, yaw_rad); None if that is unknown."""
        kept = self._poses
        if stamp_s not in kept:
            nearest_s = min(list(kept), key=lambda at_s: abs(at_s - stamp_s), default=stamp_s)
            stamp_s = nearest_s if abs(nearest_s - stamp_s) <= _WITHIN_S else stamp_s
        return kept.get(stamp_s, {}).get(robot)

    def forget(self) -> None:
        """Begin anew."""
        self._poses = {}
