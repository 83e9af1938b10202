"""What one robot knows of its peers, and how it gives way to them.

The navigator asks in each control cycle what to do and obeys: fly on, wait, or fly to
a refuge first. The rules themselves are in ``right_of_way``, ``refuge`` and
``separation``.
"""

from __future__ import annotations

import math
from typing import Dict, List, Optional, Sequence

import numpy as np

from quad_nav.costmap.layered import LayeredCostmap
from quad_nav.costmap.obstacle import ObstacleLayer
from quad_nav.costmap.peer_layer import PeerArea, PeerLayer
from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.grid import LETHAL
from quad_nav.peers.holding_point import can_be_reached, find_holding_point
from quad_nav.peers.params import PeerParams
from quad_nav.peers.peer import Peer
from quad_nav.peers.right_of_way import (
    EARLIER_LATER_S,
    HORIZON_S,
    Manner,
    YieldDecision,
    comes_near,
    gives_way,
    track,
)
from quad_nav.peers.voronoi_cell import LimitedCommand, limit_to_cell
from quad_nav.timing import StallTimer

CRUISING_MPS = 0.3  # of a robot whose controller names no max_vel_x
LATENCY_S = 0.15  # how much later than due the next command may come
PARKED_AFTER_S = 8.0  # one that does not get on is gone round, whatever its plan
_SPARE_M = 0.1
_SEEN_AROUND_M = 0.15  # a LIDAR's point so far from a peer's circle is the peer's
_STOOD_M = 0.1
_OUTSIDE_M = 0.05
_WAIT_AT_LEAST_S = 1.0
_LOOK_AGAIN_S = 1.0  # how often it is looked whether a refuge can still be reached
_PARKED_COST, _WAY_COST = 120, 100
_WAY_AHEAD_S = np.arange(0.0, HORIZON_S + EARLIER_LATER_S, 0.25)
_BEHIND_M = 8.0  # how far a peer's plan is kept clear of when a refuge is looked for


class Traffic:
    """The peers around one robot. Readable: ``peers``, fresh ones only.

    ``cruising_mps`` is the speed that robots are expected to fly at.
    """

    def __init__(self, global_costmap: LayeredCostmap, local_costmap: LayeredCostmap):
        self.peers: List[Peer] = []
        self._global, self._local = global_costmap, local_costmap
        self.cruising_mps = CRUISING_MPS
        self._margin_m = 0.0
        self._wait_until_s = -math.inf
        self._look_again_s = -math.inf
        self._lost: List[str] = []
        self._newcomers: List[str] = []
        self._standing: Dict[str, StallTimer] = {}

    def restart(self) -> None:
        """For a clock that has jumped: forgets what it has seen."""
        self.peers, self._lost, self._newcomers, self._standing = [], [], [], {}
        self._wait_until_s = self._look_again_s = -math.inf

    # -- what is seen ----------------------------------------------------------------

    def see(
        self, now_s: float, here: Optional[Pose2D], peers: Sequence[Peer], params: PeerParams
    ) -> List[str]:
        """Takes what is known of the peers; returns what is to be said about it."""
        if not peers and not self.peers and not self._lost:
            return []
        if not params.avoid_peers or here is None:
            peers = ()
        fresh = [p for p in peers if abs(now_s - p.stamp_s) <= params.timeout_s]
        lost = [p.name for p in peers if abs(now_s - p.stamp_s) > params.timeout_s]
        news = [
            f"nothing from {name} for {params.timeout_s:g} s: only the LIDAR sees it"
            for name in lost
            if name not in self._lost
        ]
        news += [
            f"{name} is heard of again" for name in self._lost if any(p.name == name for p in fresh)
        ]
        self._lost = lost
        self._margin_m = params.margin_m
        reach_m = self.reach_m
        self.peers = [
            peer.moved_to(now_s)
            for peer in fresh
            if here is not None and math.hypot(peer.x_m - here.x_m, peer.y_m - here.y_m) < reach_m
        ]
        self._newcomers += [p.name for p in self.peers if p.name not in self._standing]
        self._standing = {p.name: self._standing.get(p.name, StallTimer()) for p in self.peers}
        for peer in self.peers:
            self._standing[peer.name].has_moved(now_s, Pose2D(peer.x_m, peer.y_m), _STOOD_M)
        return news

    @property
    def reach_m(self) -> float:
        """How far away a peer may be and still matter: to meet it, or to see it by LIDAR."""
        meeting_m = 2.0 * (self.cruising_mps * HORIZON_S + self.min_separation_m)
        return max(meeting_m, self._marked_up_to_m() + self.min_separation_m)

    @property
    def _radius_m(self) -> float:
        return self._local.circumscribed_radius_m

    @property
    def safety_radius_m(self) -> float:
        return self._radius_m + self._margin_m

    @property
    def min_separation_m(self) -> float:
        """How far centres are to be from each other where a robot can choose."""
        return 2.0 * self.safety_radius_m + _SPARE_M

    def is_parked(self, peer: Peer, now_s: float) -> bool:
        return peer.is_parked or self._standing[peer.name].exceeds(now_s, PARKED_AFTER_S)

    # -- costmaps --------------------------------------------------------------------

    def tell_costmaps(
        self, now_s: float, here: Pose2D, local_from_global: Pose2D, rank_s: float
    ) -> None:
        """The peers, for the layers: who stays, who goes first and where."""
        positions = np.array([peer.position for peer in self.peers]).reshape(-1, 2)
        areas: List[PeerArea] = []
        for peer in self.peers:
            if self.is_parked(peer, now_s):
                areas.append(
                    PeerArea(peer.position[None, :], self.min_separation_m + _SPARE_M, _PARKED_COST)
                )
            elif peer.intention.rank_s < rank_s:
                areas.append(
                    PeerArea(
                        track(peer, self.cruising_mps, _WAY_AHEAD_S),
                        self.min_separation_m + _SPARE_M,
                        _WAY_COST,
                    )
                )
        seen_m = self._radius_m + _SEEN_AROUND_M
        new = [k for k, peer in enumerate(self.peers) if peer.name in self._newcomers]
        self._newcomers = []
        for costmap, points, shown in (
            (self._global, positions, areas),
            (
                self._local,
                local_from_global.transform_points(positions),
                self._solid(now_s, here, local_from_global),
            ),
        ):
            for layer in costmap.layers.values():
                if isinstance(layer, PeerLayer):
                    layer.see(shown)
                elif isinstance(layer, ObstacleLayer):
                    layer.left_out = np.column_stack((points, np.full(len(points), seen_m)))
                    for x_m, y_m in points[new]:  # until now the LIDAR took it for an obstacle
                        layer.free_square(float(x_m), float(y_m), 2.0 * seen_m)

    def _marked_up_to_m(self) -> float:
        """How far away a LIDAR's point may be and still be marked."""
        layers = [
            layer.params
            for costmap in (self._global, self._local)
            for layer in costmap.layers.values()
            if isinstance(layer, ObstacleLayer)
        ]
        return max(
            (
                layer.obstacle_range_m
                if source.obstacle_range_m is None
                else source.obstacle_range_m
                for layer in layers
                for source in layer.sources
            ),
            default=0.0,
        )

    def _solid(self, now_s: float, here: Pose2D, local_from_global: Pose2D) -> List[PeerArea]:
        """Obstacles for the rollouts: who stays, as wide as they are to keep off.

        Never so wide that the robot itself is in one, because then nothing is legal.
        """
        solid = []
        for peer in self.peers:
            away_m = math.hypot(peer.x_m - here.x_m, peer.y_m - here.y_m)
            radius_m = min(2.0 * self.safety_radius_m, away_m - _OUTSIDE_M) - self._radius_m
            if self.is_parked(peer, now_s) and radius_m > 0.0:
                solid.append(
                    PeerArea(
                        local_from_global.transform_points(peer.position[None, :]), radius_m, LETHAL
                    )
                )
        return solid

    # -- what to do ------------------------------------------------------------------

    def held(
        self, pose: Pose2D, velocity: Twist2D, command: Twist2D, period_s: float
    ) -> LimitedCommand:
        """The command, slowed down so that it comes near nobody."""
        return limit_to_cell(
            pose, velocity, command, self.peers, self.safety_radius_m, period_s + LATENCY_S
        )

    def give_way(
        self,
        now_s: float,
        here: Pose2D,
        way: np.ndarray,
        goal_way: np.ndarray,
        rank_s: float,
        current: Optional[YieldDecision],
    ) -> Optional[YieldDecision]:
        """What to do now for whom; ``current`` is what was decided last, None to fly on.

        ``way``, float64[n, 2], is the robot's own plan, to a refuge if it flies to one;
        ``goal_way`` is how it would go on to its goal.
        """
        if current is not None and current.refuge is not None:
            going = self._still_leaving(now_s, here, rank_s, current)
            if going is not None:
                return going
            way = goal_way
        elif current is not None and now_s < self._wait_until_s:
            return current
        decision = self._decide(now_s, here, way, rank_s)
        if decision is not None and decision.manner is Manner.WAIT:
            self._wait_until_s = now_s + _WAIT_AT_LEAST_S
        return decision

    def _decide(
        self, now_s: float, here: Pose2D, way: np.ndarray, rank_s: float
    ) -> Optional[YieldDecision]:
        position = np.array([here.x_m, here.y_m])
        standing = {peer.name for peer in self.peers if self.is_parked(peer, now_s)}
        to = gives_way(
            position, way, rank_s, self.peers, self.min_separation_m, self.cruising_mps, standing
        )
        if to is None:
            return None
        peer, manner = to
        if manner is Manner.WAIT:
            return YieldDecision(peer.name, manner)
        return self._leave(now_s, peer, here, rank_s)

    def is_free(self, place: Pose2D) -> bool:
        """Whether no peer is at a place or will come through."""
        at = np.array([place.x_m, place.y_m])
        points = [np.vstack((peer.position[None, :], peer.intention.way)) for peer in self.peers]
        return all(np.hypot(*(p - at).T).min() > self.min_separation_m for p in points)

    def _still_leaving(
        self, now_s: float, here: Pose2D, rank_s: float, current: YieldDecision
    ) -> Optional[YieldDecision]:
        """The way to a refuge goes on until the peer is past or means to stay."""
        assert current.refuge is not None
        peer = next((p for p in self.peers if p.name == current.to), None)
        if peer is None or peer.intention.rank_s >= rank_s or peer.is_parked:
            return None
        ahead = _ahead(peer)
        nearest_m = float(np.hypot(*(ahead - (here.x_m, here.y_m)).T).min())
        if nearest_m > self.min_separation_m + _SPARE_M or not comes_near(
            np.array([here.x_m, here.y_m]), ahead, self.min_separation_m + _SPARE_M
        ):
            return None
        if self._is_spoilt(now_s, here, current, ahead):
            return self._leave(now_s, peer, here, rank_s)
        return current

    def _is_spoilt(
        self, now_s: float, here: Pose2D, current: YieldDecision, ahead: np.ndarray
    ) -> bool:
        """Whether a refuge is taken, in the way by now, or cut off by what was seen since."""
        assert current.refuge is not None
        refuge = np.array([current.refuge.x_m, current.refuge.y_m])
        others = np.array([p.position for p in self.peers if p.name != current.to]).reshape(-1, 2)
        nearest_m = np.hypot(*(np.vstack((others, ahead)) - refuge).T).min()
        if nearest_m < self.min_separation_m - _SPARE_M:
            return True
        if now_s < self._look_again_s:
            return False
        self._look_again_s = now_s + _LOOK_AGAIN_S
        return not can_be_reached(
            self._global.spec,
            self._global.costs,
            here,
            current.refuge,
            np.array([p.position for p in self.peers]),
            self.min_separation_m,
        )

    def _leave(self, now_s: float, peer: Peer, here: Pose2D, rank_s: float) -> YieldDecision:
        """To the nearest place off all the peer's way; failing that, off its next stretch."""
        self._look_again_s = now_s + _LOOK_AGAIN_S
        first = [p for p in self.peers if p.intention.rank_s < rank_s and not p.is_parked]
        others = np.array([p.position for p in self.peers])
        nearby = [track(p, self.cruising_mps) for p in first if p is not peer]
        for way in (_ahead(peer), track(peer, self.cruising_mps)):
            refuge = find_holding_point(
                self._global.spec,
                self._global.costs,
                here,
                [way, *nearby],
                others,
                self.min_separation_m + 2.0 * _SPARE_M,
            )
            if refuge is not None:
                return YieldDecision(peer.name, Manner.LEAVE, refuge)
        return YieldDecision(peer.name, Manner.WAIT)


def _ahead(peer: Peer) -> np.ndarray:
    """Where a peer is and what of its plan is still before it, float64[k, 2]."""
    return track(peer, 1.0, np.arange(0.0, _BEHIND_M, 0.1))
