"""Match the ids of action goals with the goals that a sequencer sends.

The sequencer publishes poses on ``move_base_simple/goal``, as RViz does. The navigator gives each
of them an id when it receives it, and names the goal by this id in every status and result. A goal
of the sequencer has the first id that is new after it was sent. A result of any other id does not
end this goal, no matter how late it arrives.
"""

from __future__ import annotations

import enum
import math
from collections import deque
from typing import Deque, Hashable, Optional

CLOCK_LAG_S = 0.5
"""The navigator stamps an id when it receives the goal; its clock may lag behind ours."""
TAKEN_WITHIN_S = 5.0
"""A navigator takes a goal within this time after it is sent, or after it subscribes."""
MAX_IDS = 1000
"""Ids that are remembered: a navigator names a goal for a few seconds after its end."""


class Owner(enum.Enum):
    """Sender of a goal."""

    ACTIVE = "the sequencer, its last goal"
    EARLIER = "the sequencer, a goal before"
    OTHER = "another node"


class GoalIds:
    """Ids of the goals of one robot's navigator.

    An id is any hashable value, such as a hash of the text and the stamp of an
    ``actionlib_msgs/GoalID``.
    """

    def __init__(self) -> None:
        self._sent_s = math.inf
        self._active: Optional[Hashable] = None
        self._earlier: Deque[Hashable] = deque(maxlen=MAX_IDS)
        self._other: Deque[Hashable] = deque(maxlen=MAX_IDS)
        self._renames_until_s = -math.inf
        self._nameless_s = math.inf  # when a goal was sent that has ended before its id was known

    def send(self, now_s: float) -> None:
        """Register that a goal is sent: its id is one that has not been seen yet."""
        self.clear()
        self._sent_s = now_s

    def resend(self, now_s: float) -> None:
        """Register that a new subscriber gets the active goal.

        A navigator that has been restarted gives it another id. Any other subscriber gives none.
        """
        self._sent_s, self._renames_until_s = now_s, now_s + TAKEN_WITHIN_S

    def clear(self) -> None:
        """Register that the active goal has ended."""
        if self._active is not None:
            self._earlier.append(self._active)
        self._nameless_s = self._sent_s if self._active is None else math.inf
        self._active, self._sent_s, self._renames_until_s = None, math.inf, -math.inf

    def see(self, goal_id: Hashable, stamp_s: float) -> Owner:
        """Return the sender of a goal that the navigator reports.

        Args:
            goal_id: Its id.
            stamp_s: Time of the navigator's clock at which it received the goal.
        """
        if goal_id == self._active and self._active is not None:
            return Owner.ACTIVE
        if goal_id in self._earlier:
            return Owner.EARLIER
        if goal_id in self._other:
            return Owner.OTHER
        since_s = stamp_s - (self._nameless_s - CLOCK_LAG_S)
        if self._sent_s == math.inf and 0.0 <= since_s < TAKEN_WITHIN_S:  # a stop has overtaken it
            self._nameless_s = math.inf
            self._earlier.append(goal_id)
            return Owner.EARLIER
        is_free = self._active is None or stamp_s <= self._renames_until_s
        if is_free and stamp_s >= self._sent_s - CLOCK_LAG_S:
            if self._active is not None:
                self._earlier.append(self._active)
            self._active, self._renames_until_s = goal_id, -math.inf
            return Owner.ACTIVE
        self._other.append(goal_id)
        return Owner.OTHER

    def see_replaced(self, goal_id: Hashable, stamp_s: float) -> Owner:
        """Return the sender of a goal that another goal has replaced.

        Such a goal cannot be the last one if the one before it never got an id.
        """
        is_known = goal_id in self._earlier or goal_id in self._other
        if self._nameless_s < math.inf and self._active is None and not is_known:
            self._nameless_s = math.inf
            self._earlier.append(goal_id)
        return self.see(goal_id, stamp_s)
