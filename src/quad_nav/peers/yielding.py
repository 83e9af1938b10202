"""Yielding: wait for a peer of higher priority, or make room for it at a holding point."""

from __future__ import annotations

import math
from typing import Optional

import numpy as np
from numpy.typing import NDArray

from quad_nav.costmap.layered import LayeredCostmap
from quad_nav.geometry import Pose2D
from quad_nav.peers.holding_point import find_holding_point, is_reachable
from quad_nav.peers.peer import Peer
from quad_nav.peers.peer_tracker import TOLERANCE_M, PeerTracker
from quad_nav.peers.right_of_way import (
    Yield,
    YieldDecision,
    approaches,
    ends_at,
    find_conflict,
    meets,
    predict_peer,
)
from quad_nav.peers.roundabout import Roundabout

_MIN_WAIT_S = 1.0
_CHECK_PERIOD_S = 1.0  # of whether a holding point can still be reached
_PATH_AHEAD_M = 8.0  # length of a peer's path that a holding point keeps clear


class YieldRules:
    """Decides whether one robot yields, to which peer and how."""

    def __init__(
        self, tracker: PeerTracker, roundabout: Roundabout, global_costmap: LayeredCostmap
    ) -> None:
        """Decide for the robot whose peers ``tracker`` tracks.

        Args:
            tracker: The peers and their distances.
            roundabout: The robot does not yield to its members, unless they stand.
            global_costmap: Costmap in which holding points are searched.
        """
        self._tracker, self._roundabout = tracker, roundabout
        self._global = global_costmap
        self.restart()

    def restart(self) -> None:
        """Forget all times, after a jump of the clock."""
        self._wait_until_s = -math.inf
        self._next_check_s = -math.inf

    def decide(
        self,
        now_s: float,
        pose: Pose2D,
        path: NDArray[np.float64],
        goal_path: NDArray[np.float64],
        priority: float,
        current: Optional[YieldDecision],
    ) -> Optional[YieldDecision]:
        """Decide what to do now.

        Args:
            now_s: Time of the decision.
            pose: Pose of the robot in ``map``.
            path: Path that the robot follows, float64[n, 2], metres in ``map``: to its holding
                point if it flies to one.
            goal_path: Path on which it would go on to its goal, float64[n, 2], in ``map``.
            priority: Priority of the robot.
            current: The decision in force, None if the robot does not yield.

        Returns:
            The decision from now on, None to go on.
        """
        if current is not None and current.holding_point is not None:
            kept = self._keep_making_room(now_s, pose, goal_path, priority, current)
            if kept is not None:
                return kept
            path = goal_path
        elif current is not None and now_s < self._wait_until_s:
            return current
        decision = self._decide_anew(now_s, pose, path, priority)
        if decision is not None and decision.action is Yield.WAIT:
            self._wait_until_s = now_s + _MIN_WAIT_S
        return decision

    def is_free(self, pose: Pose2D) -> bool:
        """Return whether no peer is at a place or will pass it."""
        at = np.array([pose.x_m, pose.y_m])
        paths = [
            np.vstack((peer.position[None, :], peer.intention.path)) for peer in self._tracker.peers
        ]
        separation_m = self._tracker.min_separation_m
        return all(np.hypot(*(path - at).T).min() > separation_m for path in paths)

    def _passes(self, peer: Peer) -> bool:
        """Return whether a peer passes in a roundabout, where nobody yields."""
        return peer.name in self._roundabout.members and peer.name not in self._tracker.stationary

    def _decide_anew(
        self, now_s: float, pose: Pose2D, path: NDArray[np.float64], priority: float
    ) -> Optional[YieldDecision]:
        tracker = self._tracker
        conflict = find_conflict(
            np.array([pose.x_m, pose.y_m]),
            path,
            priority,
            [peer for peer in tracker.peers if not self._passes(peer)],
            tracker.min_separation_m,
            tracker.cruise_mps,
            tracker.stationary,
        )
        if conflict is None:
            return None
        peer, action = conflict
        if action is Yield.WAIT:
            return YieldDecision(peer.name, action)
        return self._make_room(now_s, peer, pose, priority)

    def _keep_making_room(
        self,
        now_s: float,
        pose: Pose2D,
        goal_path: NDArray[np.float64],
        priority: float,
        current: YieldDecision,
    ) -> Optional[YieldDecision]:
        """Return the decision to make room until the way is clear or the peer parks, then None."""
        peer = next((p for p in self._tracker.peers if p.name == current.peer), None)
        if peer is None or peer.intention.priority <= priority or peer.is_parked:
            return None
        if self._passes(peer):
            return None
        ahead = _path_ahead(peer)
        separation_m = self._tracker.min_separation_m + TOLERANCE_M
        waits_for_place = peer.name in self._tracker.stationary and ends_at(
            peer, goal_path[-1], separation_m
        )
        if not waits_for_place and not meets(
            pose, goal_path, peer, separation_m, self._tracker.cruise_mps
        ):
            return None
        nearest_m = float(np.hypot(*(ahead - (pose.x_m, pose.y_m)).T).min())
        if nearest_m > separation_m or not approaches(
            np.array([pose.x_m, pose.y_m]), ahead, separation_m
        ):
            return None
        if self._holding_point_blocked(now_s, pose, current, ahead):
            return self._make_room(now_s, peer, pose, priority)
        return current

    def _holding_point_blocked(
        self, now_s: float, pose: Pose2D, current: YieldDecision, ahead: NDArray[np.float64]
    ) -> bool:
        """Return whether the holding point is taken, on the peer's path or out of reach."""
        assert current.holding_point is not None
        tracker = self._tracker
        point = np.array([current.holding_point.x_m, current.holding_point.y_m])
        others = np.array(
            [peer.position for peer in tracker.peers if peer.name != current.peer]
        ).reshape(-1, 2)
        nearest_m = np.hypot(*(np.vstack((others, ahead)) - point).T).min()
        if nearest_m < tracker.min_separation_m - TOLERANCE_M:
            return True
        if now_s < self._next_check_s:
            return False
        self._next_check_s = now_s + _CHECK_PERIOD_S
        return not is_reachable(
            self._global,
            pose,
            current.holding_point,
            np.array([peer.position for peer in tracker.peers]),
            tracker.min_separation_m,
        )

    def _make_room(self, now_s: float, peer: Peer, pose: Pose2D, priority: float) -> YieldDecision:
        """Choose the nearest place off the peer's whole path, else off its next stretch."""
        self._next_check_s = now_s + _CHECK_PERIOD_S
        tracker = self._tracker
        positions = np.array([p.position for p in tracker.peers])
        others = [
            predict_peer(p, tracker.cruise_mps)
            for p in tracker.peers
            if p.intention.priority > priority and not p.is_parked and p is not peer
        ]
        for path in (_path_ahead(peer), predict_peer(peer, tracker.cruise_mps)):
            holding_point = find_holding_point(
                self._global,
                pose,
                [path, *others],
                positions,
                tracker.min_separation_m + 2.0 * TOLERANCE_M,
            )
            if holding_point is not None:
                return YieldDecision(peer.name, Yield.MAKE_ROOM, holding_point)
        return YieldDecision(peer.name, Yield.WAIT)


def _path_ahead(peer: Peer) -> NDArray[np.float64]:
    """Return the position of a peer and the path that is still ahead of it, float64[k, 2]."""
    return predict_peer(peer, 1.0, np.arange(0.0, _PATH_AHEAD_M, 0.1))
