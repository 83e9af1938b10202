"""Resets of the simulation, after which a localization begins anew; the clock goes on."""

from __future__ import annotations

import math

import rospy
from std_msgs.msg import Time

from quad_nav.topics.flight_info import RESET_TOPIC
from quad_nav.topics.validation import MAX_LEAD_S


class ResetWatch:
    """Hears of resets since the first scan; a node that starts later hears of the last one, too."""

    def __init__(self) -> None:
        self._begun_s, self._reset_s, self._now_s = math.inf, 0.0, 0.0
        self._subscriber = rospy.Subscriber(RESET_TOPIC, Time, self._on_reset, queue_size=1)

    def _on_reset(self, message: Time) -> None:
        self._reset_s = message.data.to_sec()

    def begin(self, stamp_s: float) -> None:
        """Note the stamp of a scan."""
        self._begun_s = min(self._begun_s, stamp_s)

    def pop(self, now_s: float) -> bool:
        """Return whether there was a reset since the last call.

        On a busy machine a reset comes before `/clock` gets there: it waits.
        """
        if now_s < self._now_s:
            self._reset_s = 0.0  # of a clock that has jumped back
        self._now_s = now_s
        if not self._begun_s < self._reset_s <= now_s + MAX_LEAD_S:
            return False
        self._begun_s = self._reset_s
        return True
