"""Pace of simulated time relative to wall time."""

from __future__ import annotations

_MAX_LAG_S = 0.1
"""Wall time that a slow simulation catches up at most."""
_MAX_BURST = 24
"""Number of steps that are due at once at most."""


class Pacer:
    """Schedule of simulation steps on the wall clock.

    A simulation that cannot keep up falls behind its rate.

    Args:
        rate: Simulated seconds per second of wall time.
        step_s: Simulated duration of a step.
    """

    def __init__(self, rate: float, step_s: float) -> None:
        self._wall_per_step_s = step_s / rate
        self._next_step_s = 0.0

    def start(self, wall_s: float) -> None:
        """Start, or resume after a pause."""
        self._next_step_s = wall_s + self._wall_per_step_s

    def pop_due(self, wall_s: float) -> int:
        """Return the number of steps to run now, and count them as run.

        There are at most ``_MAX_BURST``, and no more than ``_MAX_LAG_S`` of wall time is caught
        up.
        """
        self._next_step_s = max(self._next_step_s, wall_s - _MAX_LAG_S)
        if wall_s < self._next_step_s:
            return 0
        due = min(1 + int((wall_s - self._next_step_s) / self._wall_per_step_s), _MAX_BURST)
        self._next_step_s += due * self._wall_per_step_s
        return due

    def wait_s(self, wall_s: float, steps: int) -> float:
        """Return the wall time until a number of steps is due, 0 if they are due."""
        return max(0.0, self._next_step_s + (steps - 1) * self._wall_per_step_s - wall_s)


class RateMeter:
    """Real-time factor: simulated seconds per second of wall time between two readings."""

    def __init__(self) -> None:
        self._wall_s = 0.0
        self._sim_s = 0.0

    def start(self, wall_s: float, sim_s: float) -> None:
        """Start a measurement."""
        self._wall_s, self._sim_s = wall_s, sim_s

    def read(self, wall_s: float, sim_s: float) -> float:
        """Return the factor since the last reading or start, 0 if no time has passed."""
        wall, sim = wall_s - self._wall_s, sim_s - self._sim_s
        self.start(wall_s, sim_s)
        return sim / wall if wall > 0.0 else 0.0
