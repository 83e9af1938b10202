"""Roundabouts: where the ways of four robots or more meet, all of them keep right.

Of two robots that meet, one goes first and the other one goes round it. Where many meet at one
place, that takes long: each goes round all those before it. So a robot whose straight way to its
goal meets those of three peers or more keeps right of a circle around the place, with room for all.
Its peers do the same for the same reason, and so all fly round the place in one direction. None
yields to another one there: Voronoi cells keep them apart. A robot leaves the circle when its
straight way to the goal does not cross it. One that makes no progress falls back to the right of
way until it has another goal.

Source: the common sense of rotation of the roundabouts in L. Pallottino, V. G. Scordio, A. Bicchi,
E. Frazzoli, "Decentralized cooperative policy for conflict resolution in multivehicle systems",
IEEE Transactions on Robotics 23(6), 2007. There each vehicle has a circle of its own.
"""

from __future__ import annotations

import math
from typing import FrozenSet, List, Optional, Sequence, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.costmap.layered import LayeredCostmap
from quad_nav.geometry import Pose2D
from quad_nav.peers.holding_point import COMFORTABLE
from quad_nav.peers.peer import HIGHEST_PRIORITY, Peer
from quad_nav.peers.peer_tracker import TOLERANCE_M, PeerTracker
from quad_nav.timing import StallTimer

Floats = NDArray[np.float64]

_HORIZON_S = 30.0  # of meetings
_NEARER_M = 0.05  # an approach by less does not count
_SAME_TIME_S = 3.0
_FEWEST_PEERS = 3
_PERIOD_S = 1.0  # of looking for meetings
_REACTION_S = 0.6  # for which the cells expect a robot to go on: period, latency and coasting
_INSIDE_M = 0.4  # a start or goal is so far outside of the circle
_DISCS = 4  # of the barrier to the left
_PASSED_M = 0.2
_CLEAR_FACTOR = 0.95  # a way at this part of the radius from the centre does not cross the circle
_STALL_M, _STALL_S = 0.2, 6.0
_NO_PLACES = np.zeros((0, 2))


class Roundabout:
    """The roundabout of one robot.

    Attributes:
        centre: float64[2] in ``map``, None if the robot is in no roundabout.
        radius_m: Radius of the circle.
        members: Names of the peers that the robot has met in roundabouts since its goal was set;
            it does not yield to them.
    """

    def __init__(self, tracker: PeerTracker, global_costmap: LayeredCostmap) -> None:
        """Create no roundabout yet; a circle has to be free in the global costmap."""
        self._tracker = tracker
        self._global = global_costmap
        self.start(None)

    def start(self, goal: Optional[Pose2D]) -> None:
        """Forget everything, for another goal in ``map``; a robot without one meets nobody."""
        self._goal = goal
        self.centre: Optional[Floats] = None
        self.radius_m = 0.0
        self._count = 0  # of the peers that are met there
        self.members: FrozenSet[str] = frozenset()
        self._stall = StallTimer()
        self._next_s = -math.inf
        self._is_due = False

    @property
    def reach_m(self) -> float:
        """Distance up to which peers matter to the next update."""
        return 2.0 * self._tracker.cruise_mps * _HORIZON_S if self._is_due else 0.0

    def restart(self) -> None:
        """Forget everything but the goal, after a jump of the clock."""
        self.start(self._goal)

    def update(
        self, now_s: float, pose: Pose2D, peers: Sequence[Peer], timeout_s: float
    ) -> List[str]:
        """Enter, keep or leave a roundabout, by all peers within ``reach_m`` with a known pose.

        Returns:
            Messages for the log.
        """
        if self._goal is None or not self._is_due:
            self._is_due = self._goal is not None and now_s >= self._next_s
            return []
        self._stall.has_moved(now_s, pose, _STALL_M)
        if self.centre is not None and self._stall.exceeds(now_s, _STALL_S):
            self.start(None)
            return [f"no progress in the roundabout for {_STALL_S:g} s, yielding to peers again"]
        self._is_due, self._next_s = False, now_s + _PERIOD_S
        at, to = np.array([pose.x_m, pose.y_m]), np.array([self._goal.x_m, self._goal.y_m])
        had_members = bool(self.members)
        self._enter(
            now_s, at, to, [peer for peer in peers if abs(now_s - peer.stamp_s) <= timeout_s]
        )
        if self.centre is not None and not _crosses(at, to, self.centre, self.radius_m):
            self.centre, self._count = None, 0
        if had_members or self.centre is None:
            return []
        x_m, y_m = self.centre.tolist()
        text = f"keeping right of ({x_m:.2f}, {y_m:.2f}) by {self.radius_m:.2f} m"
        return [f"{text}, as do {len(self.members)} peers"]

    def barrier(self, pose: Pose2D) -> Floats:
        """Return discs of ``radius_m`` that plans avoid, so that they keep right.

        Returns:
            float64[k, 2], centres in ``map``: the circle and what is to the left of it.
        """
        if self.centre is None or self._goal is None:
            return _NO_PLACES
        left = np.array([pose.y_m - self._goal.y_m, self._goal.x_m - pose.x_m])
        left *= self.radius_m / max(1e-9, math.hypot(*left))
        return self.centre + np.arange(_DISCS)[:, None] * left

    def _enter(self, now_s: float, at: Floats, to: Floats, peers: Sequence[Peer]) -> None:
        """Enter a roundabout if enough peers are met, or one for more of them."""
        under_way = [
            peer
            for peer in peers
            if not peer.is_parked and peer.intention.priority < HIGHEST_PRIORITY
        ]
        if len(under_way) < _FEWEST_PEERS or self._tracker.cruise_mps <= 0.0:
            return
        met, places = find_meetings(
            at,
            to,
            np.array([(peer.x_m, peer.y_m) for peer in under_way]),
            np.array([peer.intention.path[-1] for peer in under_way]),
            self._tracker.cruise_mps,
            self._tracker.min_separation_m + TOLERANCE_M,
        )
        if len(met) < max(_FEWEST_PEERS, self._count + 1):
            return
        centre = places.mean(axis=0)
        radius_m = self._radius_m(len(met) + 1, centre, at, to)
        if self._is_free(centre, radius_m, under_way):
            if self.centre is None:
                self._stall.restart(now_s)
            self.centre, self.radius_m, self._count = centre, radius_m, len(met)
            self.members |= {under_way[k].name for k in met.tolist()}

    def _radius_m(self, robots: int, centre: Floats, at: Floats, to: Floats) -> float:
        """Return the radius of a circle with room for robots, without start and goal in it."""
        tracker = self._tracker
        spacing_m = 2.0 * (tracker.safety_radius_m + tracker.cruise_mps * _REACTION_S)
        outside_m = min(math.dist(centre, at), math.dist(centre, to)) - _INSIDE_M
        return min(robots * spacing_m / (2.0 * math.pi), outside_m)

    def _is_free(self, centre: Floats, radius_m: float, under_way: List[Peer]) -> bool:
        """Return whether a circle is on the map and a robot has room to turn all along it.

        Places at peers do not count: they leave.
        """
        if radius_m < 0.5 * self._tracker.min_separation_m:
            return False
        spec = self._global.spec
        angles = np.arange(0.0, 2.0 * math.pi, spec.resolution_m / radius_m)
        circle = centre + radius_m * np.column_stack((np.cos(angles), np.sin(angles)))
        peers = np.array([(peer.x_m, peer.y_m) for peer in under_way])
        away_m = np.hypot(*(circle[:, None] - peers).T).min(axis=0)
        circle = circle[away_m > self._tracker.min_separation_m]
        if not len(circle):
            return True
        cells = np.floor((circle - (spec.origin_x_m, spec.origin_y_m)) / spec.resolution_m)
        height, width = spec.shape
        if cells.min() < 0 or cells[:, 0].max() >= width or cells[:, 1].max() >= height:
            return False
        x, y = cells.astype(np.int64).T
        return bool(self._global.costs[y, x].max() < COMFORTABLE)


def _crosses(at: Floats, to: Floats, centre: Floats, radius_m: float) -> bool:
    """Return whether a straight way still leads through a circle or right of it."""
    length_m = math.dist(at, to)
    if length_m < _INSIDE_M:
        return False
    along = (to - at) / length_m
    ahead_m = float((centre - at) @ along)
    left_m = float((centre - at) @ (-along[1], along[0]))
    return ahead_m > -_PASSED_M and left_m < _CLEAR_FACTOR * radius_m


def find_meetings(
    start: Floats, goal: Floats, starts: Floats, goals: Floats, speed_mps: float, distance_m: float
) -> Tuple[NDArray[np.int64], Floats]:
    """Find the place where a robot meets most of its peers at about the same time.

    Args:
        start: float64[2], position of the robot, metres.
        goal: float64[2], its goal.
        starts: float64[n, 2], positions of the peers.
        goals: float64[n, 2], their goals.
        speed_mps: Speed of all of them.
        distance_m: Robots that come nearer than this, and nearer than they are, meet.

    Returns:
        Indices of the peers that are met there, int64[m], and the places half-way between robot
        and peer where each is nearest, float64[m, 2], metres.
    """
    own_mps, own_s = _straight(start, goal, speed_mps)
    their_mps, their_s = _straight(starts, goals, speed_mps)
    offsets_m, closing_mps = starts - start, their_mps - own_mps
    closing2 = np.maximum(1e-9, (closing_mps**2).sum(axis=1))
    times_s = -(offsets_m * closing_mps).sum(axis=1) / closing2
    times_s = np.clip(times_s, 0.0, np.minimum(np.minimum(own_s, their_s), _HORIZON_S))
    nearest_m = np.hypot(*(offsets_m + closing_mps * times_s[:, None]).T)
    meets = nearest_m < np.minimum(distance_m, np.hypot(*offsets_m.T) - _NEARER_M)
    places = 0.5 * (start + starts + (own_mps + their_mps) * times_s[:, None])
    met = np.flatnonzero(meets)
    met = met[_largest_group(places[met], times_s[met], distance_m)]
    return met, places[met]


def _straight(start: Floats, goal: Floats, speed_mps: float) -> Tuple[Floats, Floats]:
    """Return velocities of straight ways, float64[..., 2], and how long they take, float64[...]."""
    way = goal - start
    length_m = np.maximum(1e-9, np.hypot(way[..., 0], way[..., 1]))
    return way * (speed_mps / length_m)[..., None], length_m / speed_mps


def _largest_group(places: Floats, times_s: Floats, distance_m: float) -> NDArray[np.int64]:
    """Return the indices of the most places that are near one of them, at about the same time."""
    if not len(places):
        return np.zeros(0, np.int64)
    apart_m = np.hypot(*(places[:, None] - places).T)
    apart_s = np.abs(times_s[:, None] - times_s)
    together = (apart_m < distance_m) & (apart_s < _SAME_TIME_S)
    return np.flatnonzero(together[together.sum(axis=1).argmax()])
