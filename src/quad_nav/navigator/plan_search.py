"""Plan search: when to search for a global plan, and for how long the search may fail."""

from __future__ import annotations

import math
from typing import Optional

import numpy as np
from numpy.typing import NDArray

from quad_nav.navigator.params import NavigatorParams
from quad_nav.navigator.tick import State
from quad_nav.timing import Schedule, is_due


class PlannerThread:
    """Times at which upstream's planner thread searches.

    A control cycle wakes the thread, which searches while the cycle ends: the next cycle is the
    first to follow the plan. With a planner frequency the thread also wakes by itself, one
    planner period after the start of its last search.

    Attributes:
        is_running: The thread searches when it wakes; upstream's ``runPlanner_``.
    """

    def __init__(self) -> None:
        """Create a thread that waits."""
        self.stop()

    def stop(self) -> None:
        """Let the thread wait until a cycle wakes it."""
        self.is_running = self._is_woken = False
        self._due_s = math.inf

    def wake(self) -> None:
        """Make a search due now."""
        self.is_running = self._is_woken = True

    def start_search(self, now_s: float, period_s: float) -> None:
        """Start a search; the next one is due in a planner period, +inf for none."""
        self._is_woken = False
        self._due_s = now_s + period_s

    @property
    def due_s(self) -> float:
        """Time at which the thread wakes by itself, +inf for never."""
        return self._due_s if self.is_running else math.inf

    def is_due(self, now_s: float) -> bool:
        """Return whether the thread searches now."""
        return self.is_running and (self._is_woken or is_due(self._due_s, now_s))


class PlanSearch:
    """Schedules the search for a global plan and keeps the newest plan.

    A failed search is repeated once for each control cycle: the costs that it depends on
    change no faster. With a plan, the search runs at the planner frequency.

    Attributes:
        thread: Times of the search in the order of upstream, which plans after control.
    """

    def __init__(self, frequency_hz: float) -> None:
        """Create a search that has not begun."""
        self.thread = PlannerThread()
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

    def begin(self, now_s: float, wakes_thread: bool = True) -> None:
        """Begin the search for a plan; patience and retries count from now."""
        if wakes_thread:
            self.thread.wake()
        self._plan = None
        self._last_valid_s = now_s
        self._failures = 0
        self._schedule.start(now_s)

    def is_due(self, state: State, now_s: float, cycle_due_s: float) -> bool:
        """Return whether to search now; ``cycle_due_s`` is the time of the next control cycle."""
        if state is State.PLANNING:
            return is_due(cycle_due_s, now_s)
        return state is State.CONTROLLING and self._schedule.pop(now_s)

    def is_retry_due(self, state: State, now_s: float, cycle_due_s: float) -> bool:
        """Return whether upstream's thread, which repeats a failed search, has searched by now.

        Without a planner frequency it repeats the search without a pause. Here the last of these
        searches stands for all, the one right before a control cycle.
        """
        repeats = self.thread.is_running and self._failures > 0 and not self._is_periodic
        return repeats and state is State.PLANNING and is_due(cycle_due_s, now_s)

    def notify_thread(self) -> None:
        """Wake upstream's thread in a control cycle without a plan, unless it searches anyway."""
        if self._is_periodic or not self.thread.is_running:
            self.thread.wake()

    @property
    def _is_periodic(self) -> bool:
        return math.isfinite(self._schedule.period_s)

    def start(self, now_s: float) -> None:
        """Start a search."""
        self.thread.start_search(now_s, self._schedule.period_s)

    def succeed(self, plan: NDArray[np.float64], state: State, now_s: float) -> None:
        """Keep a plan that was found, float64[n, 3] of (x_m, y_m, yaw_rad)."""
        self._plan = plan
        self._last_valid_s = now_s
        self._failures = 0
        if state is State.PLANNING:
            self._schedule.pop(now_s)
        if not self._is_periodic:
            self.thread.stop()

    def fail(self, now_s: float, params: NavigatorParams) -> bool:
        """Count a failed search; return whether patience or retries are exhausted.

        Upstream's thread needs no time for its retries, unless it has a planner frequency.
        """
        self._failures += 1
        too_long = now_s > self._last_valid_s + params.planner_patience_s
        failures = self._failures
        if not params.command_in_first_cycle and not self._is_periodic:
            failures = max(failures, params.max_planning_retries + 1)
        too_often = 0 <= params.max_planning_retries < failures
        return too_long or too_often

    def pop_plan(self) -> Optional[NDArray[np.float64]]:
        """Return the newest plan once, then None until the next one."""
        plan, self._plan = self._plan, None
        return plan

    def drop(self) -> None:
        """Drop the newest plan and search for no other."""
        self._plan = None
        self.thread.stop()
