"""Right of way: which robot yields in a conflict, and how.

Two robots are in conflict if their predicted positions come nearer to each other than the
minimum separation. The robot of lower priority yields. It waits where it is if the other can
pass it there; otherwise it makes room. Every robot knows the priorities of its peers, and
priorities differ. So of two robots exactly one yields, and of any number one goes on.

Positions are predicted at constant cruise speed. Robots also turn and slow down, so two are
in conflict if they pass the same place within ``TIME_TOLERANCE_S`` of each other.
"""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass
from typing import Container, List, Optional, Sequence, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.files.kernel_cache import njit
from quad_nav.geometry import Pose2D
from quad_nav.peers.peer import Peer

MOVING_OBSTACLE = "a moving obstacle"
"""Name of what moves and has no name, and that a robot makes room for."""
HORIZON_S = 7.0
TIME_TOLERANCE_S = 1.5
_STEP_S = 0.25
_TIMES_S = np.arange(0.0, HORIZON_S + 1e-9, _STEP_S)
_STEPS_APART = int(TIME_TOLERANCE_S / _STEP_S + 1e-9)
_NEARER_M = 0.05  # an approach by less does not count
_BLOCKING_FACTOR = 2.0  # a robot beyond this times the separation does not block a peer


class Yield(enum.Enum):
    """Ways to yield; the value begins the log line."""

    WAIT = "waiting for"
    MAKE_ROOM = "making room for"


@dataclass(frozen=True)
class YieldDecision:
    """Decision to yield to a peer: wait, or move to ``holding_point`` first.

    Attributes:
        peer: Name of the peer that goes first.
        action: Way to yield.
        holding_point: Where to make room, in ``map``; None to wait where the robot is.
    """

    peer: str
    action: Yield
    holding_point: Optional[Pose2D] = None

    def __str__(self) -> str:
        text = f"{self.action.value} {self.peer}"
        if self.peer != MOVING_OBSTACLE:
            text += " (higher priority)"
        if self.holding_point is None:
            return f"{text} to pass"
        return f"{text} at ({self.holding_point.x_m:.2f}, {self.holding_point.y_m:.2f})"


def find_conflict(
    position: NDArray[np.float64],
    path: NDArray[np.float64],
    priority: float,
    peers: Sequence[Peer],
    min_separation_m: float,
    cruise_mps: float,
    stationary: Container[str] = (),
) -> Optional[Tuple[Peer, Yield]]:
    """Find the peer of highest priority that the robot has to yield to.

    A robot goes on if that takes it out of the peer's way in time. It does not wait for a
    stationary peer, but leaves its path; if the peer is far, only if parked on the peer's goal.

    Args:
        position: Position of the robot, float64[2], metres in ``map``.
        path: Path of the robot, float64[n, 2], metres in ``map``; empty for a parked robot.
        priority: Priority of the robot.
        peers: Peers whose state is fresh.
        min_separation_m: Minimum separation of two robots' centres.
        cruise_mps: Speed at which positions are predicted.
        stationary: Names of the peers that do not move.

    Returns:
        The peer and how to yield to it, None to go on.
    """
    before = _before(priority, peers)
    own = predict_positions(position, path, cruise_mps, _TIMES_S) if before else path
    for peer in before:
        stands = peer.name in stationary
        if stands and _distance_m(peer, position) > _BLOCKING_FACTOR * min_separation_m:
            if not len(path) and ends_at(peer, position, min_separation_m):
                return peer, Yield.MAKE_ROOM
            continue
        theirs = predict_peer(peer, cruise_mps)
        if stands or _conflict(own, theirs, min_separation_m):
            is_on_path = approaches(position, theirs, min_separation_m)
            if is_on_path or not stands:
                return peer, Yield.MAKE_ROOM if is_on_path else Yield.WAIT
    return None


def _before(priority: float, peers: Sequence[Peer]) -> List[Peer]:
    """Return the peers with a higher priority that are not parked, the highest first."""
    before = [p for p in peers if p.intention.priority > priority and not p.is_parked]
    return sorted(before, key=lambda peer: -peer.intention.priority)


def _distance_m(peer: Peer, position: NDArray[np.float64]) -> float:
    return float(np.hypot(*(peer.position - position)))


def ends_at(peer: Peer, position: NDArray[np.float64], min_separation_m: float) -> bool:
    """Return whether the path of a peer ends nearer to a position, float64[2], than it may."""
    path = peer.intention.path
    return bool(len(path)) and bool(np.hypot(*(path[-1] - position)) < min_separation_m)


def meets(
    pose: Pose2D,
    path: NDArray[np.float64],
    peer: Peer,
    min_separation_m: float,
    cruise_mps: float,
) -> bool:
    """Return whether a robot that goes on along a path, float64[n, 2], conflicts with a peer."""
    position = np.array([pose.x_m, pose.y_m])
    own = predict_positions(position, path, cruise_mps, _TIMES_S)
    return _conflict(own, predict_peer(peer, cruise_mps), min_separation_m)


def predict_peer(
    peer: Peer, cruise_mps: float, times_s: NDArray[np.float64] = _TIMES_S
) -> NDArray[np.float64]:
    """Predict the positions of a peer, float64[k, 2], at times from now, float64[k]."""
    return predict_positions(
        peer.position, peer.intention.path, max(cruise_mps, peer.speed_mps), times_s
    )


def predict_positions(
    start: NDArray[np.float64],
    path: NDArray[np.float64],
    speed_mps: float,
    times_s: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Predict the positions, float64[k, 2], of a robot that follows a path at constant speed.

    The robot moves from ``start`` to the nearest point of the path, float64[n, 2] in ``map``, and
    along it; it stays at the end. Times from now are float64[k].
    """
    if not len(path):
        return np.repeat(start[None, :], len(times_s), axis=0)
    return sample_path(start, path, speed_mps * times_s)


def approaches(
    position: NDArray[np.float64], track: NDArray[np.float64], min_separation_m: float
) -> bool:
    """Return whether a track, float64[k, 2], comes nearer to a position than it may."""
    place = position.reshape(1, 2)
    now_m = nearest_in_time(place, track[:1], 0)
    nearest_m = nearest_in_time(place, track, len(track))
    return bool(nearest_m < min(min_separation_m, now_m - _NEARER_M))


def _conflict(
    own: NDArray[np.float64], theirs: NDArray[np.float64], min_separation_m: float
) -> bool:
    """Return whether two tracks come nearer than they may, and nearer than they are now."""
    now_m = nearest_in_time(own[:1], theirs[:1], 0)
    nearest_m = nearest_in_time(own, theirs, _STEPS_APART)
    return bool(nearest_m < min(min_separation_m, now_m - _NEARER_M))


@njit(cache=True, nogil=True)
def sample_path(
    start: NDArray[np.float64], path: NDArray[np.float64], travelled: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the points, float64[k, 2], of a path after distances travelled from a start.

    The path, float64[n, 2], n >= 1, joins at the point after the nearest one. Beyond its end every
    point is the end.
    """
    nearest, nearest2 = 0, np.inf
    for k in range(path.shape[0]):
        distance2 = (path[k, 0] - start[0]) ** 2 + (path[k, 1] - start[1]) ** 2
        if distance2 < nearest2:
            nearest, nearest2 = k, distance2
    first = min(nearest + 1, path.shape[0] - 1)
    lengths = np.empty(path.shape[0])  # of the stretch to each point
    x, y = start[0], start[1]
    for k in range(first, path.shape[0]):
        dx, dy = path[k, 0] - x, path[k, 1] - y
        lengths[k] = math.sqrt(dx * dx + dy * dy)
        x, y = path[k, 0], path[k, 1]
    points = np.empty((travelled.shape[0], 2))
    for i in range(travelled.shape[0]):
        left = travelled[i]
        x, y = start[0], start[1]
        for k in range(first, path.shape[0]):
            if left < lengths[k]:
                x += (path[k, 0] - x) * (left / lengths[k])
                y += (path[k, 1] - y) * (left / lengths[k])
                break
            left -= lengths[k]
            x, y = path[k, 0], path[k, 1]
        points[i, 0], points[i, 1] = x, y
    return points


@njit(cache=True, nogil=True)
def nearest_in_time(
    one: NDArray[np.float64], other: NDArray[np.float64], steps_apart: int
) -> float:
    """Return the least distance of two tracks, float64[k, 2], at about the same time.

    Positions are at equal steps of time; so many steps apart they still count.
    """
    nearest_m = np.inf
    for i in range(one.shape[0]):
        for j in range(max(0, i - steps_apart), min(other.shape[0], i + steps_apart + 1)):
            distance_m = math.hypot(one[i, 0] - other[j, 0], one[i, 1] - other[j, 1])
            nearest_m = min(nearest_m, distance_m)
    return nearest_m


@njit(cache=True, nogil=True)
def places_reached(
    path: NDArray[np.float64],
    times: NDArray[np.float64],
    robot: Tuple[float, float],
    radius: float,
    speed: float,
    tolerance: float,
) -> NDArray[np.float64]:
    """Return the positions of a peer that a robot can reach until the peer has passed them.

    The peer is at float64[k, 2] at times from now, float64[k], and has passed a tolerance later.
    The robot is at a place within a radius of it.
    """
    reached, m = np.empty_like(path), 0
    for k in range(path.shape[0]):
        away = math.hypot(path[k, 0] - robot[0], path[k, 1] - robot[1]) - radius
        if away <= speed * (times[k] + tolerance):
            reached[m, 0], reached[m, 1] = path[k, 0], path[k, 1]
            m += 1
    return reached[:m]
