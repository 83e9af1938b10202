"""How fast simulated time runs against the clock on the wall."""

from __future__ import annotations

_MAX_LAG_S = 0.1
_MAX_BURST = 24


class Pacer:
    """Tells how many steps are due, as a function of the wall time it is given.

    A simulation that cannot keep up falls behind its rate: no more than
    ``_MAX_LAG_S`` of wall time is ever caught up, and no more than ``_MAX_BURST``
    steps are due at once.
    """

    def __init__(self, rate: float, step_s: float):
        self._wall_per_step_s = step_s / rate
        self._next_step_s = 0.0

    def start(self, wall_s: float) -> None:
        """Begin, or go on after a pause."""
        self._next_step_s = wall_s + self._wall_per_step_s

    def take_due(self, wall_s: float) -> int:
        """Steps to do now; they count as done."""
        self._next_step_s = max(self._next_step_s, wall_s - _MAX_LAG_S)
        if wall_s < self._next_step_s:
            return 0
        due = min(1 + int((wall_s - self._next_step_s) / self._wall_per_step_s), _MAX_BURST)
        self._next_step_s += due * self._wall_per_step_s
        return due

    def wait_s(self, wall_s: float, steps: int) -> float:
        """How long until that many steps are due."""
        return max(0.0, self._next_step_s + (steps - 1) * self._wall_per_step_s - wall_s)


class RateMeter:
    """Simulated seconds per wall second, over the time between two readings."""

    def __init__(self) -> None:
        self._wall_s = 0.0
        self._sim_s = 0.0

    def start(self, wall_s: float, sim_s: float) -> None:
        self._wall_s, self._sim_s = wall_s, sim_s

    def read(self, wall_s: float, sim_s: float) -> float:
        """The factor since the last reading or start; 0 when no time has passed."""
        wall, sim = wall_s - self._wall_s, sim_s - self._sim_s
        self.start(wall_s, sim_s)
        return sim / wall if wall > 0.0 else 0.0
