"""Stand-offs: a robot and a moving obstacle face each other in a narrow passage.

A moving obstacle tells nothing; it may be a peer whose link is lost. Where there is no room for
two, no plan leads past it once it stands, and it may wait for this robot as well. A robot that has
made no progress for a random time, with a moving obstacle ahead, backs out: it flies to a holding
point off the way by which it came, and lets the obstacle pass. Two robots that do so draw different
times, so that one of them sees the other leave before its own time is over.

Source: random times to break a tie without a word, as in R. M. Metcalfe, D. R. Boggs, "Ethernet:
distributed packet switching for local computer networks", Communications of the ACM 19(7), 1976.
"""

from __future__ import annotations

import math
from typing import List, Optional, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.costmap.layered import LayeredCostmap
from quad_nav.geometry import Pose2D
from quad_nav.peers.holding_point import find_holding_point
from quad_nav.peers.peer import resample
from quad_nav.peers.peer_tracker import TOLERANCE_M, PeerTracker
from quad_nav.peers.right_of_way import MOVING_OBSTACLE, Yield, YieldDecision
from quad_nav.timing import StallTimer

Floats = NDArray[np.float64]

_REACH_M = 3.0  # distance of moving obstacles that count
_REMEMBERED_S = 20.0  # for which a moving obstacle that has stopped is still one
_STALL_M = 0.4  # who has moved so far makes progress
_WAIT_S = (15.0, 30.0)  # at a holding point, for a moving obstacle that does not come
_ARRIVED_M = 0.3
_TRAVEL_S = 30.0  # longest time to the holding point
_TRAIL_M = 8.0
_SPACING_M = 0.1


class StandOff:
    """Ends stand-offs of one robot with moving obstacles.

    Attributes:
        obstacle: float64[2], place in ``map`` where the nearest obstacle was seen last, None if
            there is none.
    """

    def __init__(self, tracker: PeerTracker, global_costmap: LayeredCostmap, number: int) -> None:
        """Begin without moving obstacles; the robot's number is for its random times."""
        self._tracker = tracker
        self._global = global_costmap
        self._number = number
        self.restart()

    def restart(self) -> None:
        """Forget everything, after a jump of the clock."""
        self.obstacle: Optional[Floats] = None
        self._seen_s = -math.inf
        self._trail: List[Tuple[float, float]] = []
        self._assumed = np.zeros((0, 2))  # path that the obstacle is expected to take
        self._held_at = 0.0  # distance along it at which the robot leaves it
        self._until_s = -math.inf
        self._wait_s = 0.0
        self._has_arrived = False
        self.start_goal()

    @property
    def is_watching(self) -> bool:
        """True if moving obstacles were observed since the last ``restart``."""
        return bool(self._trail)

    def start_goal(self) -> None:
        """Count progress anew, for another goal."""
        self._stall = StallTimer()
        self._patience_s = math.inf

    def observe(self, now_s: float, pose: Pose2D, obstacles: Floats) -> None:
        """Update the obstacle.

        Args:
            now_s: Time of the update.
            pose: Pose of the robot in ``map``.
            obstacles: float64[n, 2], places in ``map`` of what moves now.
        """
        at = (pose.x_m, pose.y_m)
        if not self._trail or math.dist(at, self._trail[-1]) >= _SPACING_M:
            self._trail.append(at)
            del self._trail[: -int(_TRAIL_M / _SPACING_M)]
        near = obstacles
        if len(obstacles):
            near = obstacles[np.hypot(*(obstacles - at).T) < _REACH_M]
        if len(near):
            from_m = np.hypot(*(near - (at if self.obstacle is None else self.obstacle)).T)
            self.obstacle, self._seen_s = near[int(from_m.argmin())], now_s
        elif self.obstacle is not None and (
            self._is_known() or now_s > max(self._seen_s + _REMEMBERED_S, self._until_s)
        ):
            self.obstacle = None

    def _is_known(self) -> bool:
        """Return whether the obstacle is a peer that is heard now."""
        limit_m = self._tracker.min_separation_m
        return self.obstacle is not None and any(
            math.dist(peer.position, self.obstacle) < limit_m for peer in self._tracker.peers
        )

    def decide(
        self,
        now_s: float,
        pose: Pose2D,
        path: Floats,
        current: Optional[YieldDecision],
        patience_s: float,
    ) -> Optional[YieldDecision]:
        """Decide whether to make room for the obstacle.

        The robot follows a path, float64[n, 2] in ``map``. The decision in force is None if it does
        not make room for an obstacle. The shortest time without progress is ``patience_s``, the
        longest three times that.

        Returns:
            The decision from now on, None to go on.
        """
        if current is not None:
            if self._keeps_out(now_s, pose, current.holding_point):
                return current
            self.start_goal()
            return None
        if not self.is_watching:
            return None
        if self._stall.has_moved(now_s, pose, _STALL_M) or not math.isfinite(self._patience_s):
            self._patience_s = patience_s * (1.0 + 2.0 * self._draw(pose))
        if self.obstacle is None or not _is_ahead(pose, path, self.obstacle):
            self._stall.restart(now_s)
        if not self._stall.exceeds(now_s, self._patience_s):
            return None
        self.start_goal()
        return self._make_room(now_s, pose, self._obstacle_path(pose))

    def _draw(self, pose: Pose2D) -> float:
        """Return a random number below 1, another one for each robot and place."""
        place = [int(1000.0 * abs(value)) for value in (pose.x_m, pose.y_m)]
        return float(np.random.default_rng([self._number, *place]).random())

    def _obstacle_path(self, pose: Pose2D) -> Floats:
        """Return the path by which an obstacle passes: to the robot, and on where it came from."""
        assert self.obstacle is not None
        points = [self.obstacle, (pose.x_m, pose.y_m), *self._trail[::-1]]
        return resample(np.array(points), _SPACING_M)

    def _make_room(self, now_s: float, pose: Pose2D, path: Floats) -> Optional[YieldDecision]:
        assert self.obstacle is not None
        separation_m = self._tracker.min_separation_m
        point = find_holding_point(
            self._global,
            pose,
            [path],
            self.obstacle.reshape(1, 2),
            separation_m + 2.0 * TOLERANCE_M,
        )
        if point is None:
            return None
        self._assumed = path
        self._held_at = self._distance_along(np.array([point.x_m, point.y_m]))
        low_s, high_s = _WAIT_S
        self._wait_s = low_s + (high_s - low_s) * self._draw(pose)
        self._until_s = now_s + _TRAVEL_S + self._wait_s
        self._has_arrived = False
        return YieldDecision(MOVING_OBSTACLE, Yield.MAKE_ROOM, point)

    def _keeps_out(self, now_s: float, pose: Pose2D, point: Optional[Pose2D]) -> bool:
        """Return whether the obstacle has not passed, and may still come."""
        is_there = point is None or pose.distance_to(point) < _ARRIVED_M
        if is_there and not self._has_arrived:
            self._has_arrived = True
            self._until_s = now_s + self._wait_s
        if self.obstacle is None or now_s >= self._until_s:
            return False
        passed_m = self._distance_along(self.obstacle) - self._held_at
        return passed_m < self._tracker.min_separation_m

    def _distance_along(self, place: Floats) -> float:
        """Return the distance along the obstacle's path at which it is nearest to a place."""
        return _SPACING_M * int(np.hypot(*(self._assumed - place).T).argmin())


def _is_ahead(pose: Pose2D, path: Floats, place: Floats) -> bool:
    """Return whether a place is on the side of the robot to which its path leads."""
    if not len(path):
        return False
    away_m = np.hypot(path[:, 0] - pose.x_m, path[:, 1] - pose.y_m)
    nearest = int(away_m.argmin())
    ahead = np.flatnonzero(away_m[nearest:] >= 1.0)
    x_m, y_m = path[nearest + int(ahead[0]) if len(ahead) else -1].tolist()
    dx_m, dy_m = place[0] - pose.x_m, place[1] - pose.y_m
    return bool((x_m - pose.x_m) * dx_m + (y_m - pose.y_m) * dy_m > 0.0)
