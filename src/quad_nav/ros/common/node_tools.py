"""Tools of every node: shutdown on signals, names of topics, throttled warnings."""

from __future__ import annotations

import re
import signal
import threading
import time
from types import FrameType
from typing import Callable, Dict, Optional

import rospy

Names = Callable[[str], str]
"""Maps the name that move_base uses for a topic, service or parameter to the actual one."""

_ACTION = ("goal", "cancel", "status", "feedback", "result", "recovery_status")
_NUMBERED = ("clicked_point", "cmd_vel", "initialpose", "odom", "scan", "move_base_simple/goal")

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


def own_node(name: str) -> str:
    """Return the name unchanged, for the only robot of a node: rospy resolves and remaps it."""
    return name


def in_fleet(number: int) -> Names:
    """Return the names of a robot that shares its node with others.

    A launch file cannot remap these, and the node has only one private namespace. The names are
    those that the remaps of `launch/quad.launch` lead to.
    """
    node = f"/move_base{number}"
    remaps = {f"/{name}": f"/{name}{number}" for name in _NUMBERED}
    remaps.update({f"/move_base/{name}": f"{node}/{name}" for name in _ACTION})
    remaps["/move_base"] = node

    def resolved(name: str) -> str:
        if name.startswith("~"):
            return f"{node}/{name[1:]}".rstrip("/")
        absolute = name if name.startswith("/") else f"/{name}"
        return remaps.get(absolute, absolute)

    return resolved


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
