"""Tools of every node: shutdown on signals, throttled warnings."""

from __future__ import annotations

import re
import signal
import threading
import time
from types import FrameType
from typing import Dict, Optional

import rospy

REPEAT_S = 5.0  # wall time
_NUMBER = re.compile(r"-?\d+(\.\d+)?")


def init_node(name: str) -> None:
    """Call `rospy.init_node` and let Ctrl-C and SIGTERM shut down from another thread.

    rospy's own handler closes the publishers in the thread that it interrupts. It deadlocks if
    that thread is publishing and holds the lock.
    """
    rospy.init_node(name, disable_signals=True)

    def shut_down(number: int, _frame: Optional[FrameType]) -> None:
        reason = signal.Signals(number).name
        threading.Thread(target=rospy.signal_shutdown, args=(reason,), daemon=True).start()

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, shut_down)


class ThrottledWarnings:
    """Log a repeated warning at once and then every `REPEAT_S` of wall time.

    Warnings that differ only in their numbers count as the same one.
    """

    def __init__(self) -> None:
        """Start without logged warnings."""
        self._logged_s: Dict[str, float] = {}

    def warn(self, text: str) -> None:
        """Log a warning unless the same one was logged a short time ago."""
        kind, now_s = _NUMBER.sub("#", text), time.monotonic()
        if now_s - self._logged_s.get(kind, -REPEAT_S) >= REPEAT_S:
            self._logged_s[kind] = now_s
            rospy.logwarn("%s", text)
