"""Schedules of periodic work and timers of stalled robots. The caller passes the time."""

from __future__ import annotations

import math
from typing import Optional

from quad_nav.geometry import Pose2D

SAME_TIME_S = 1e-6
"""Times that differ by less are the same: clocks of whole nanoseconds are early, floats round."""


def is_due(due_s: float, now_s: float) -> bool:
    """Return whether a due time has come."""
    return now_s >= due_s - SAME_TIME_S


class Schedule:
    """The due times of a periodic task.

    Attributes:
        period_s: Seconds between two due times, +inf for a frequency of 0.
        due_s: The next due time, +inf if the task never runs.
    """

    def __init__(self, frequency_hz: float) -> None:
        """Create a schedule that has not started; a frequency of 0 means never."""
        self.due_s = math.inf
        self._set_frequency(frequency_hz)

    def _set_frequency(self, frequency_hz: float) -> None:
        self._frequency_hz = frequency_hz
        self.period_s = 1.0 / frequency_hz if frequency_hz > 0.0 else math.inf

    def set_frequency(self, frequency_hz: float, now_s: float) -> None:
        """Restart the schedule if the frequency differs from the current one."""
        if frequency_hz != self._frequency_hz:
            self._set_frequency(frequency_hz)
            self.start(now_s)

    def start(self, now_s: float) -> None:
        """Make the task due now, and periodically from now on."""
        self.due_s = now_s if math.isfinite(self.period_s) else math.inf

    def pop(self, now_s: float) -> bool:
        """Return whether the task is due, and if so advance to the next due time.

        Due times that have passed meanwhile are dropped.
        """
        if not is_due(self.due_s, now_s):
            return False
        missed = max(math.floor((now_s - self.due_s + SAME_TIME_S) / self.period_s), 0)
        self.due_s += (missed + 1) * self.period_s
        if is_due(self.due_s, now_s):  # by rounding
            self.due_s += self.period_s
        return True


class _Timer:
    """Measures a time."""

    def __init__(self) -> None:
        """Create a timer that does not run yet."""
        self._since_s = math.inf

    def restart(self, now_s: float) -> None:
        """Set the elapsed time to zero; what the robot has reached so far stays."""
        self._since_s = now_s

    def exceeds(self, now_s: float, timeout_s: float) -> bool:
        """Return whether the robot has stalled for longer than the timeout; 0 is no timeout."""
        return timeout_s > 0.0 and now_s > self._since_s + timeout_s


class StallTimer(_Timer):
    """Measures how long a robot has stayed near one place."""

    _reference: Optional[Pose2D] = None

    def has_moved(self, now_s: float, pose: Pose2D, distance_m: float) -> bool:
        """Return whether the robot has left the circle around the reference pose.

        If it has, or if there is no reference yet, ``pose`` becomes the reference and the
        timer restarts.
        """
        if self._reference is not None and pose.distance_to(self._reference) < distance_m:
            return False
        self._reference = pose
        self.restart(now_s)
        return True


class ApproachTimer(_Timer):
    """Measures how long a robot has come no nearer to the end of its plan than before.

    Attributes:
        detour_m: By how much the way left has been longer since then.
    """

    detour_m = 0.0
    _shortest_m = math.inf

    def has_approached(self, now_s: float, left_m: float, distance_m: float) -> bool:
        """Return whether less of the way is left than ever before, by a distance at least.

        If so, or at the first call, the timer restarts.
        """
        if left_m > self._shortest_m - distance_m:
            self.detour_m = max(self.detour_m, left_m - self._shortest_m)
            return False
        self._shortest_m, self.detour_m = left_m, 0.0
        self.restart(now_s)
        return True
