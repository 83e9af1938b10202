"""Warnings that are true in every cycle, said now and then."""

from __future__ import annotations

import re
import time
from typing import Dict

import rospy

AGAIN_S = 5.0  # wall time
_NUMBER = re.compile(r"-?\d+(\.\d+)?")


class ThrottledWarnings:
    """Each is logged when it comes up and then every ``AGAIN_S``.

    Those that differ in their numbers are one: ``nothing from scan0 for 0.5 s``.
    """

    def __init__(self) -> None:
        self._said_s: Dict[str, float] = {}

    def say(self, text: str) -> None:
        kind, now_s = _NUMBER.sub("#", text), time.monotonic()
        if now_s - self._said_s.get(kind, -AGAIN_S) >= AGAIN_S:
            self._said_s[kind] = now_s
            rospy.logwarn("%s", text)
