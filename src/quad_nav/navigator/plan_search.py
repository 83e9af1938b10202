"""Plan search: when to search for a global plan, and for how long the search may fail."""

from __future__ import annotations

import math
from typing import Optional

import numpy as np
from numpy.typing import NDArray

from quad_nav.navigator.params import NavigatorParams
from quad_nav.navigator.tick import State
from quad_nav.timing import Schedule


class PlanSearch:
    """Schedules the search for a global plan and keeps the newest plan.

    A failed search is repeated once for each control cycle: the costs that it depends on
    change no faster. With a plan, the search runs at the planner frequency.
    """

    def __init__(self, frequency_hz: float) -> None:
        """Create a search that has not begun."""
        self._schedule = Schedule(frequency_hz)
        self._plan: Optional[NDArray[np.float64]] = None
        self._last_valid_s = -math.inf
        self._failures = 0

    @property
    def due_s(self) -> float:
        """Time of the next search of a robot that has a plan."""
        return self._schedule.due_s

    def set_frequency(self, frequency_hz: float, now_s: float) -> None:
        """Change the planner frequency; 0 means one search for each goal."""
        self._schedule.set_frequency(frequency_hz, now_s)

    def begin(self, now_s: float) -> None:
        """Begin the search for a plan; patience and retries count from now."""
        self._plan = None
        self._last_valid_s = now_s
        self._failures = 0
        self._schedule.start(now_s)

    def is_due(self, state: State, now_s: float, cycle_due_s: float) -> bool:
        """Return whether to search now; ``cycle_due_s`` is the time of the next control cycle."""
        if state is State.PLANNING:
            return now_s >= cycle_due_s - 1e-9
        return state is State.CONTROLLING and self._schedule.pop(now_s)

    def succeed(self, plan: NDArray[np.float64], state: State, now_s: float) -> None:
        """Keep a plan that was found, float64[n, 3] of (x_m, y_m, yaw_rad)."""
        self._plan = plan
        self._last_valid_s = now_s
        self._failures = 0
        if state is State.PLANNING:
            self._schedule.pop(now_s)

    def fail(self, now_s: float, params: NavigatorParams) -> bool:
        """Count a failed search; return whether patience or retries are exhausted."""
        self._failures += 1
        too_long = now_s > self._last_valid_s + params.planner_patience_s
        too_often = 0 <= params.max_planning_retries < self._failures
        return too_long or too_often

    def pop_plan(self) -> Optional[NDArray[np.float64]]:
        """Return the newest plan once, then None until the next one."""
        plan, self._plan = self._plan, None
        return plan

    def drop(self) -> None:
        """Drop the newest plan."""
        self._plan = None
