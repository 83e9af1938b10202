"""Who steers a quadcopter: one node at a time.

Two that send velocities to one quadcopter would fly it where neither wants to. The first to
come keeps it until it has said nothing for as long as its last word counts.
"""

from __future__ import annotations

from typing import Dict, Tuple


class CommandLease:
    """``valid_s`` is how long a command counts."""

    def __init__(self, valid_s: float):
        self._valid_s = valid_s
        self._held: Dict[int, Tuple[str, float]] = {}  # who, and until when

    def holder(self, robot: int, node: str, now_s: float) -> str:
        """Who steers a quadcopter now that ``node`` has sent it a command; mostly ``node``."""
        limited_by, until_s = self._held.get(robot, (node, now_s))
        if limited_by != node and now_s < until_s:
            return limited_by
        self._held[robot] = node, now_s + self._valid_s
        return node

    def clear(self) -> None:
        self._held.clear()
