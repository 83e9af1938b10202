"""Compare where robots believe themselves with where they are, as far as a simulation tells."""

from __future__ import annotations

from typing import Any, Dict, List

import numpy as np
import rospy
from numpy.typing import NDArray

from quad_nav.mission.localization_errors import error_figures, pose_errors
from quad_nav.ros.common.packed_messages import StatesMessage
from quad_nav.ros.common.true_states import TrueStates
from quad_nav.ros.sequencer.odometry import Track
from quad_nav.topics.estimates import TRUTH_TOPIC


class TruthTopic:
    """Errors of the poses of a mission's robots, whose true ones are on ``/quad/truth``.

    The lock of the flight's record is held to use it.
    """

    def __init__(self) -> None:
        """Subscribe."""
        self._true = TrueStates()
        self._errors: List[NDArray[np.float32]] = []  # small: a mission may last for days
        self._topic = rospy.Subscriber(TRUTH_TOPIC, StatesMessage, self._true.add, queue_size=100)

    def forget(self) -> None:
        """Begin anew."""
        self._true.forget()
        self._errors = []

    def compare(self, robot: int, track: Track) -> None:
        """Add the errors of the poses that a robot believed, where the true ones are known."""
        true = [self._true.find(robot, stamp_s) for stamp_s in track.stamps_s.tolist()]
        pairs = [(pose, one) for pose, one in zip(track.planar, true) if one is not None]
        if pairs:
            errors = pose_errors(*map(np.array, zip(*pairs)))
            self._errors.append(errors.astype(np.float32))

    @property
    def facts(self) -> Dict[str, Any]:
        """The figures for the summary; {} if no errors are known."""
        return {"localization": error_figures(self._errors)} if self._errors else {}
