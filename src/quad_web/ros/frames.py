"""Transforms that change slowly, looked up from time to time while somebody uses them.

Hearing all of `/tf` and `/clock` of a fleet would cost more than all the rest. The time is that of
the newest poses.
"""

from __future__ import annotations

import threading
import time
from typing import Dict, Optional, Set, Tuple

import rospy
from rosgraph_msgs.msg import Clock

from quad_nav.geometry import Pose3D
from quad_nav.ros.common.diagnostics import ThrottledWarnings
from quad_nav.ros.common.rospy_repairs import ClockSource
from quad_nav.ros.common.transforms import Transforms, TransformUnavailable

REFRESH_S = 3.0  # wall time, as the others
USED_WITHIN_S = 10.0
PATIENCE_S = 1.0
_POLL_S = 0.02
_SAME = Pose3D(0.0, 0.0, 0.0)


class Frames:
    """Transforms that are in use, looked up every `REFRESH_S` in a thread."""

    def __init__(self, robots: int) -> None:
        self._robots = robots
        self._found: Dict[Tuple[str, str], Pose3D] = {}
        self._used_s: Dict[Tuple[str, str], float] = {}
        self._asked = threading.Event()
        self._warnings = ThrottledWarnings()
        threading.Thread(target=self._run, name="frames", daemon=True).start()

    def find(self, to_frame: str, from_frame: str) -> Optional[Pose3D]:
        """Return the pose of a frame in another one as of some seconds ago; None if unknown yet."""
        pair = to_frame.lstrip("/"), from_frame.lstrip("/")
        if pair[0] == pair[1]:
            return _SAME
        self._used_s[pair] = time.monotonic()
        found = self._found.get(pair)
        if found is None:
            self._asked.set()
        return found

    def _run(self) -> None:
        while not rospy.is_shutdown():
            self._asked.wait(REFRESH_S)
            since_s = time.monotonic() - USED_WITHIN_S
            used = {pair for pair, at_s in list(self._used_s.items()) if at_s > since_s}
            if used:
                self._look_up(used)
            self._asked.clear()
            if not used <= self._found.keys():
                time.sleep(REFRESH_S)  # a transform that is missing is asked for all the time

    def _look_up(self, pairs: Set[Tuple[str, str]]) -> None:
        """Hear transforms until all are known, at most for `PATIENCE_S`."""
        clock = rospy.Subscriber("/clock", Clock, ClockSource())
        transforms = Transforms(range(self._robots))
        end_s, missing, problem = time.monotonic() + PATIENCE_S, set(pairs), ""
        try:
            while missing and time.monotonic() < end_s and not rospy.is_shutdown():
                time.sleep(_POLL_S)
                for pair in list(missing):
                    try:
                        self._found[pair] = transforms.lookup(*pair)
                        missing.discard(pair)
                    except TransformUnavailable as error:
                        problem = str(error)
        finally:
            transforms.close()
            clock.unregister()
        if missing:
            self._warnings.warn(f"web: /tf: {problem}", kind="tf")
