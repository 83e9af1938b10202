"""Which recovery behaviour is on, which is next, and why."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Optional, Sequence

from quad_nav.navigator.tick import RecoveryStart, Trigger
from quad_nav.recovery import Recovery, RecoveryContext, Step


@dataclass(frozen=True)
class NamedRecovery:
    name: str
    behaviour: Recovery


class RecoverySequence:
    """Goes through the behaviours, one after the other, until what failed works again.

    Readable: ``trigger``, why the last one was begun, and ``due_s``, when the running one
    wants its next step (+inf without one).
    """

    def __init__(self, recoveries: Sequence[NamedRecovery]):
        self.recoveries = tuple(recoveries)
        self.reset()

    def reset(self) -> None:
        """For another goal: from the first behaviour on."""
        self._index = 0
        self.trigger: Optional[Trigger] = None
        self.stop()

    def stop(self) -> None:
        """Leaves the running behaviour."""
        self._active: Optional[Recovery] = None
        self.due_s = math.inf

    @property
    def is_running(self) -> bool:
        return self._active is not None

    def works_again(self, trigger: Trigger) -> None:
        """What failed has worked: if that was the reason, the next time begins anew."""
        if self.trigger is trigger:
            self._index = 0

    def start(self, context: RecoveryContext) -> Optional[RecoveryStart]:
        """Begins the next behaviour; None when they are used up."""
        assert self.trigger is not None
        if self._index >= len(self.recoveries):
            return None
        named = self.recoveries[self._index]
        self._active = named.behaviour
        self.due_s = context.now_s
        named.behaviour.start(context)
        return RecoveryStart(named.name, self._index, len(self.recoveries), self.trigger)

    def step(self, context: RecoveryContext) -> Optional[Step]:
        """The running behaviour's step; None before it is due."""
        assert self._active is not None
        if context.now_s < self.due_s - 1e-9:
            return None
        step = self._active.step(context)
        self.due_s = context.now_s + self._active.period_s
        if step.done:
            self._index += 1
            self.stop()
        return step
