"""One robot among its peers: its rank, what it does for whom, and where it belongs.

The navigator asks ``decide`` in each control cycle and obeys ``now``: None to fly on, or
to wait, or to fly to a refuge first. A robot without a goal makes room on an errand:
it flies to a refuge and then back to its home, with nobody to report to.
"""

from __future__ import annotations

from typing import List, Optional

import numpy as np

from quad_nav.geometry import Pose2D
from quad_nav.peers.params import PeerParams
from quad_nav.peers.peer import IDLE_RANK_S, NO_WAY_POINTS, Intention, rank_of, thinned
from quad_nav.peers.right_of_way import Manner, YieldDecision
from quad_nav.peers.traffic import Traffic
from quad_nav.timing import StallTimer

TURN_AFTER_S = 15.0  # one that gets no farther for so long lets the others go first
REPLAN_AFTER_S = 3.0  # one that is slowed down on the spot looks for another plan
_FARTHER_M = 0.2
_AT_REFUGE_M = 0.15
_SPACING_M = 0.1  # of the way that peers are told


class Yielding:
    """Readable: ``now``, what is done for a peer; ``is_errand``; ``home``, None if it is there."""

    def __init__(self, traffic: Traffic, number: int):
        self.traffic = traffic
        self._number = number
        self.now: Optional[YieldDecision] = None
        self.home: Optional[Pose2D] = None
        self.is_errand = False
        self._since_s = IDLE_RANK_S
        self._way = NO_WAY_POINTS
        self._progress = StallTimer()
        self._held_up = StallTimer()

    # -- what it is up to --------------------------------------------------------------

    @property
    def intention(self) -> Intention:
        """What the peers may know."""
        return Intention(self.rank_s, self._way)

    @property
    def rank_s(self) -> float:
        return rank_of(self._since_s, self._number)

    def target(self, goal: Optional[Pose2D]) -> Optional[Pose2D]:
        """Where it flies just now: to a refuge, or to its goal."""
        return self.refuge or goal

    @property
    def refuge(self) -> Optional[Pose2D]:
        return self.now.refuge if self.now is not None else None

    def set_out(self, goal: Pose2D, now_s: float) -> None:
        """Somebody has given it a goal: from now on it has a rank."""
        self.stand()
        self.home = None
        self._since_s = now_s
        self._way = _straight_to(goal)
        self._progress = StallTimer()
        self._held_up = StallTimer()

    def set_out_on_errand(self, now: Optional[YieldDecision], home: Pose2D) -> None:
        """To a refuge or, without one, home."""
        self.stand()
        self.now, self.home, self.is_errand = now, home, True
        self._way = _straight_to(home)

    def follow(self, plan: np.ndarray) -> None:
        """The plan that is flown, float64[n, 3]."""
        self._way = thinned(plan[:, :2], _SPACING_M)

    def stand(self) -> None:
        """It has no goal any more. A home that it has not reached stays its home."""
        self.now, self.is_errand = None, False
        self._since_s = IDLE_RANK_S
        self._way = NO_WAY_POINTS

    # -- what it does ------------------------------------------------------------------

    @property
    def concerns(self) -> bool:
        """Whether there is anybody to give way to."""
        return bool(self.traffic.peers) or self.now is not None

    def decide(self, now_s: float, here: Pose2D, goal: Pose2D) -> List[str]:
        """Sets ``now`` for a robot with a goal; returns what is to be said about it."""
        notes = self._take_turns(now_s, here)
        before = self.now
        self.now = self.traffic.give_way(
            now_s, here, self._way, _straight_to(goal), self.rank_s, before
        )
        if self.now != before:
            notes.append(str(self.now) if self.now is not None else "goes on")
        return notes

    def waits_at(self, here: Pose2D) -> bool:
        """Whether it stands still for a peer, under way or at its refuge."""
        if self.now is None:
            return False
        return self.refuge is None or here.distance_to(self.refuge) <= _AT_REFUGE_M

    def refuse_refuge(self) -> None:
        """There is no way to the refuge."""
        if self.now is not None:
            self.now = YieldDecision(self.now.to, Manner.WAIT)

    def errand(self, now_s: float, here: Pose2D, params: PeerParams) -> Optional[Pose2D]:
        """For a robot without a goal: the home of an errand that it sets out on, if any."""
        if not params.yield_when_idle or not self.traffic.peers:
            return None
        now = self.traffic.give_way(now_s, here, NO_WAY_POINTS, NO_WAY_POINTS, self.rank_s, None)
        home = self.home
        if now is not None and now.refuge is not None:
            home = home or here
        elif home is None or now is not None or not self.traffic.is_free(home):
            return None
        self.set_out_on_errand(now, home)
        return home

    def is_held_up(self, now_s: float, here: Pose2D) -> bool:
        """For a command that was slowed down: whether that goes on; then it begins anew."""
        self._held_up.has_moved(now_s, here, _FARTHER_M)
        if not self._held_up.exceeds(now_s, REPLAN_AFTER_S):
            return False
        self._held_up.restart(now_s)
        return True

    def _take_turns(self, now_s: float, here: Pose2D) -> List[str]:
        """One that goes first and gets nowhere becomes the last of those under way."""
        self._progress.has_moved(now_s, here, _FARTHER_M)
        if self.now is not None or self.is_errand:
            self._progress.restart(now_s)
        if not self._progress.exceeds(now_s, TURN_AFTER_S):
            return []
        self._progress.restart(now_s)
        self._since_s = now_s
        return [f"no way for {TURN_AFTER_S:g} s: lets the others go first"]


def _straight_to(goal: Pose2D) -> np.ndarray:
    return np.array([[goal.x_m, goal.y_m]])
