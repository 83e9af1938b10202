"""Names the topics that say nothing, with what is there instead."""

from __future__ import annotations

import time
from typing import Dict, List, Sequence

import rospy

SILENT_AFTER_S = 3.0  # wall time
REPEAT_S = 15.0


class TopicWatch:
    """Warns about subscriptions that have never brought a message.

    The times are wall times: a simulation that stands still is silent, too, and
    ``/clock`` itself is watched by ``check_clock``.
    """

    def __init__(self, subscribers: Sequence[rospy.Subscriber]):
        self._silent: Dict[str, rospy.Subscriber] = {s.resolved_name: s for s in subscribers}
        self._next_check = time.monotonic() + SILENT_AFTER_S
        for subscriber in subscribers:
            subscriber.impl.add_callback(self._heard, subscriber.resolved_name)

    def _heard(self, _, name: str) -> None:
        subscriber = self._silent.pop(name, None)
        if subscriber is not None:
            subscriber.impl.remove_callback(self._heard, name)

    def check_clock(self) -> None:
        """While the clock has not started."""
        if self._is_time():
            rospy.logwarn(
                "use_sim_time is set and nothing has come on /clock yet: is the simulator running?"
            )

    def check(self, now_s: float) -> None:
        if self._silent and self._is_time():
            for name, subscriber in list(self._silent.items()):
                rospy.logwarn("%s", self._sentence(name, subscriber.type))

    def _is_time(self) -> bool:
        now = time.monotonic()
        if now < self._next_check:
            return False
        self._next_check = now + REPEAT_S
        return True

    @staticmethod
    def _sentence(name: str, message_type: str) -> str:
        others: List[str] = [
            topic
            for topic, kind in rospy.get_published_topics()
            if kind == message_type and topic != name
        ]
        instead = (
            "of this type there is " + ", ".join(sorted(others))
            if others
            else "no topic of this type is published"
        )
        return f"nothing has come on {name} [{message_type}] yet; {instead}"
