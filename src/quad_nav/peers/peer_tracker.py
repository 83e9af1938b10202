"""Peer tracker: the peers around one robot whose state is fresh, and their motion."""

from __future__ import annotations

import math
from typing import Dict, List, Optional, Sequence, Set

from quad_nav.costmap.layered import LayeredCostmap
from quad_nav.costmap.obstacle import ObstacleLayer, ObstacleLayerParams
from quad_nav.geometry import Pose2D
from quad_nav.peers.peer import Peer
from quad_nav.peers.right_of_way import HORIZON_S
from quad_nav.timing import StallTimer

CRUISE_MPS = 0.3  # of a robot whose local planner has no max_vel_x
STATIONARY_AFTER_S = 8.0  # a peer that stays in place for so long counts as stationary
TOLERANCE_M = 0.1  # added to distances that a robot can choose
SILENT_S = 1.0  # for which a peer that went silent keeps its cell: by then it is tracked
_MOVED_M = 0.1


class PeerTracker:
    """Tracks the peers around one robot.

    Attributes:
        peers: Peers within reach whose state is fresh, extrapolated to now.
        silent: Peers that went silent a moment ago, extrapolated to now.
        newcomers: Names of peers that came into reach and are not yet in the costmaps.
        stationary: Names of peers that stay: they intend to, or have not moved for long.
        cruise_mps: Speed at which robots are expected to fly.
        margin_m: Distance from footprint to bisector; 0 until a peer is observed.
    """

    def __init__(self, global_costmap: LayeredCostmap, local_costmap: LayeredCostmap) -> None:
        """Create a tracker without peers.

        Obstacle layers of both costmaps extend its reach; the local one has the robot's footprint.
        """
        self._local = local_costmap
        self._obstacle_layers = [
            layer
            for costmap in (global_costmap, local_costmap)
            for layer in costmap.layers.values()
            if isinstance(layer, ObstacleLayer)
        ]
        self._compared: List[ObstacleLayerParams] = []  # whose longest range is known
        self._longest_m = 0.0
        self.cruise_mps = CRUISE_MPS
        self.margin_m = 0.0
        self.restart()

    def restart(self) -> None:
        """Forget all peers, after a jump of the clock."""
        self.peers: List[Peer] = []
        self.silent: List[Peer] = []
        self.newcomers: List[str] = []
        self.stationary: Set[str] = set()
        self._lost: List[str] = []
        self._stall_timers: Dict[str, StallTimer] = {}

    def observe(
        self,
        now_s: float,
        pose: Optional[Pose2D],
        peers: Sequence[Peer],
        margin_m: float,
        timeout_s: float,
    ) -> List[str]:
        """Update the peers from all with a known pose; those older than a time-out are lost.

        Returns:
            Messages about peers that were lost or came back.
        """
        if not peers and not self.peers and not self._lost:
            self.silent = []
            return []
        if pose is None:
            peers = ()
        fresh = [peer for peer in peers if abs(now_s - peer.stamp_s) <= timeout_s]
        lost = [peer.name for peer in peers if abs(now_s - peer.stamp_s) > timeout_s]
        messages = self._update_lost(lost, {peer.name for peer in fresh}, timeout_s)
        self.margin_m = margin_m
        self.peers = self._in_reach(now_s, pose, fresh)
        silent = [peer for peer in peers if 0.0 < now_s - peer.stamp_s - timeout_s <= SILENT_S]
        self.silent = self._in_reach(now_s, pose, silent)
        self._update_stall_timers(now_s)
        return messages

    def _in_reach(self, now_s: float, pose: Optional[Pose2D], peers: Sequence[Peer]) -> List[Peer]:
        if pose is None or not peers:
            return []
        reach_m = self.reach_m
        return [
            peer.extrapolated(now_s)
            for peer in peers
            if math.hypot(peer.x_m - pose.x_m, peer.y_m - pose.y_m) < reach_m
        ]

    def _update_lost(self, lost: List[str], fresh: Set[str], timeout_s: float) -> List[str]:
        """Keep the names of lost peers; return messages about changes."""
        messages = [
            f"no data from {name} for {timeout_s:g} s, avoiding it by LIDAR only"
            for name in lost
            if name not in self._lost
        ]
        messages += [f"receiving data from {name} again" for name in self._lost if name in fresh]
        self._lost = lost
        return messages

    def _update_stall_timers(self, now_s: float) -> None:
        before, self._stall_timers, self.stationary = self._stall_timers, {}, set()
        for peer in self.peers:
            timer = before.get(peer.name)
            if timer is None:
                self.newcomers.append(peer.name)
                timer = StallTimer()
            self._stall_timers[peer.name] = timer
            timer.has_moved(now_s, Pose2D(peer.x_m, peer.y_m), _MOVED_M)
            if peer.is_parked or timer.exceeds(now_s, STATIONARY_AFTER_S):
                self.stationary.add(peer.name)

    @property
    def radius_m(self) -> float:
        """Circumscribed radius of the footprint."""
        return self._local.circumscribed_radius_m

    @property
    def safety_radius_m(self) -> float:
        """Robot radius plus margin."""
        return self.radius_m + self.margin_m

    @property
    def min_separation_m(self) -> float:
        """Minimum separation of two robots' centres where a robot can choose."""
        return 2.0 * self.safety_radius_m + TOLERANCE_M

    @property
    def reach_m(self) -> float:
        """Distance up to which a peer matters: to meet it, or to see it by LIDAR."""
        meeting_m = 2.0 * (self.cruise_mps * HORIZON_S + self.min_separation_m)
        return max(meeting_m, self._obstacle_range_m() + self.min_separation_m)

    def _obstacle_range_m(self) -> float:
        """Return the largest range at which an obstacle layer marks points."""
        params = [layer.params for layer in self._obstacle_layers]
        if params != self._compared:  # mostly the same objects
            self._compared = params
            own_m = [(source.obstacle_range_m, one) for one in params for source in one.sources]
            self._longest_m = max(
                (one.obstacle_range_m if range_m is None else range_m for range_m, one in own_m),
                default=0.0,
            )
        return self._longest_m
