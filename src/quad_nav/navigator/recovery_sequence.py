"""Recovery sequence: which recovery behaviour runs, which is next, and why."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Optional, Sequence

from quad_nav.costmap.layered import LayeredCostmap
from quad_nav.navigator.parameter_limiter import ParameterLimiter
from quad_nav.navigator.tick import RecoveryStart, RobotPoses, Tick, Trigger
from quad_nav.recovery import Recovery, RecoveryContext
from quad_nav.timing import is_due


@dataclass(frozen=True)
class NamedRecovery:
    """A recovery behaviour with the name that the configuration gives it."""

    name: str
    behaviour: Recovery


class RecoverySequence:
    """Runs the behaviours one after the other until what failed succeeds again.

    Attributes:
        recoveries: The behaviours in order.
        trigger: Why the last behaviour was started.
        due_s: Time of the running behaviour's next step, +inf if none runs.
    """

    def __init__(
        self,
        recoveries: Sequence[NamedRecovery],
        global_costmap: LayeredCostmap,
        local_costmap: LayeredCostmap,
    ) -> None:
        """Create a sequence of which no behaviour runs; behaviours may change the costmaps."""
        self.recoveries = tuple(recoveries)
        self._costmaps = (global_costmap, local_costmap)
        self.reset()

    def reset(self) -> None:
        """Start with the first behaviour again, for another goal."""
        self._index = 0
        self.trigger: Optional[Trigger] = None
        self.stop()

    def stop(self) -> None:
        """Stop the running behaviour."""
        self._active: Optional[Recovery] = None
        self.due_s = math.inf

    @property
    def is_running(self) -> bool:
        """True while a behaviour runs."""
        return self._active is not None

    @property
    def done(self) -> int:
        """Number of behaviours that have run for what fails now."""
        return self._index

    def reset_after(self, trigger: Trigger) -> None:
        """Start with the first behaviour again if what triggered the last one has succeeded."""
        if self.trigger is trigger:
            self._index = 0

    def start(self, tick: Tick, poses: RobotPoses) -> bool:
        """Start the next behaviour; return False if all have run."""
        assert self.trigger is not None
        if self._index >= len(self.recoveries):
            return False
        named = self.recoveries[self._index]
        self._active = named.behaviour
        self.due_s = tick.now_s
        named.behaviour.start(self._context(tick, poses))
        tick.recovery = RecoveryStart(named.name, self._index, len(self.recoveries), self.trigger)
        return True

    def step(self, tick: Tick, poses: RobotPoses, limiter: ParameterLimiter) -> bool:
        """Run the behaviour's step if it is due; return whether the behaviour is done.

        The command and the message of the step go into the tick, its limit to ``limiter``.
        """
        assert self._active is not None
        if not is_due(self.due_s, tick.now_s):
            return False
        step = self._active.step(self._context(tick, poses))
        self.due_s = tick.now_s + self._active.period_s
        if step.command is not None:
            tick.steer(step.command)
        if step.message:
            tick.warnings.append(step.message)
        if step.limit is not None and poses.in_global is not None:
            limiter.impose(step.limit, poses.in_global, tick.now_s)
        if step.done:
            self._index += 1
            self.stop()
        return step.done

    def pause(self, now_s: float) -> None:
        """Skip the running behaviour's step if it is due."""
        assert self._active is not None
        if is_due(self.due_s, now_s):
            self.due_s = now_s + self._active.period_s

    def _context(self, tick: Tick, poses: RobotPoses) -> RecoveryContext:
        return RecoveryContext(tick.now_s, *self._costmaps, poses.in_global, poses.in_local)
