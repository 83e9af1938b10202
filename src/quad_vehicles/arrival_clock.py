"""Times of a vehicle that counts milliseconds and answers no question about its clock."""

from __future__ import annotations

import math

WINDOW_S = 1.0
_WRAP_MS = 1 << 24


class ArrivalClock:
    """Converts a counter of milliseconds modulo 2^24 to our clock.

    A message is never received before it is sent. So the smallest difference between arrival and
    stamp, of the last 1 to 2 s, is the offset between the clocks, with the shortest delay of the
    link in it. The window lets the offset follow a clock that drifts or steps.
    """

    def __init__(self) -> None:
        """Start without messages."""
        self._last_ms = 0
        self._turns = 0
        self._begin_s = -math.inf  # of the present window
        self._present_s = self._before_s = math.inf  # smallest differences of two windows

    def ours_s(self, stamp_ms: int, now_s: float) -> float:
        """Return a stamp on our clock; never later than now.

        Args:
            stamp_ms: The vehicle's counter, 0 to 2^24 - 1.
            now_s: Time of the arrival.
        """
        if stamp_ms < self._last_ms - _WRAP_MS // 2:
            self._turns += 1
        self._last_ms = stamp_ms
        stamp_s = (self._turns * _WRAP_MS + stamp_ms) / 1e3
        difference_s = now_s - stamp_s
        if now_s - self._begin_s > WINDOW_S:
            self._begin_s = now_s
            self._before_s, self._present_s = self._present_s, difference_s
        self._present_s = min(self._present_s, difference_s)
        return stamp_s + min(self._present_s, self._before_s)
