"""A page without a server, and its clock, for tests."""

from __future__ import annotations

from typing import Any, List

from quad_web.process import Batch
from quad_web.view.state import LAYERS, FleetState, Wanted

EVERYTHING = Wanted(frozenset(LAYERS), 0)


class Clock:
    """Wall clock that stands unless somebody waits or ``tick_s`` is set: the cost of a look."""

    def __init__(self, tick_s: float = 0.0) -> None:
        self.now_s, self.tick_s = 100.0, tick_s

    def __call__(self) -> float:
        self.now_s += self.tick_s
        return self.now_s


class FakePage:
    """Pages that show ``wanted``, and take batches while ``can_take`` is set."""

    def __init__(self, clock: Clock, wanted=(EVERYTHING,)) -> None:
        self.clock, self.wanted = clock, tuple(wanted)
        self.is_alive = self.can_take = True
        self.batches: List[Batch] = []
        self.times_s: List[float] = []
        self.answers: List[Any] = []
        self.on_wait = None
        self._calls: List[tuple] = []

    def send(self, batch: Batch) -> None:
        self.batches.append(batch)
        self.times_s.append(self.clock.now_s)

    def serve(self, actions) -> None:
        calls, self._calls = self._calls, []
        self.answers += [actions.call(*call) for call in calls]

    def wait(self, timeout_s: float) -> None:
        self.clock.now_s += timeout_s
        if self.on_wait is not None:
            self.on_wait(self)

    def do(self, name: str, *arguments) -> None:
        self._calls.append((name, *arguments))

    @property
    def state(self) -> FleetState:
        """The items after all batches."""
        state = FleetState()
        for batch in self.batches:
            state.put_all(batch.items, batch.removed)
        return state
