"""When something periodic is due."""
from __future__ import annotations

import math


class Schedule:
    """When something periodic is due; a frequency of 0 means never."""

    def __init__(self, frequency_hz: float):
        self.due_s = math.inf
        self._set_frequency(frequency_hz)

    def _set_frequency(self, frequency_hz: float) -> None:
        self._frequency_hz = frequency_hz
        self.period_s = 1.0 / frequency_hz if frequency_hz > 0.0 else math.inf

    def follow(self, frequency_hz: float, now_s: float) -> None:
        """Starts anew if the frequency was changed."""
        if frequency_hz != self._frequency_hz:
            self._set_frequency(frequency_hz)
            self.start(now_s)

    def start(self, now_s: float) -> None:
        self.due_s = now_s if math.isfinite(self.period_s) else math.inf

    def take(self, now_s: float) -> bool:
        """Whether it is due; if so the next time is set, and missed turns are dropped."""
        if now_s < self.due_s - 1e-9:
            return False
        missed = math.floor((now_s - self.due_s + 1e-9) / self.period_s)
        self.due_s += (missed + 1) * self.period_s
        return True
