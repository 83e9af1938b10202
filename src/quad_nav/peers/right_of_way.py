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
from dataclasses import dataclass
from typing import Container, Optional, Sequence, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.geometry import Pose2D
from quad_nav.peers.peer import Peer
from quad_nav.peers.predicted_paths import nearest_in_time, sample_path

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
    stationary peer, but makes room on its path, because it may be the reason why the peer stands.

    Args:
        position: Position of the robot, float64[2], metres in ``map``.
        path: Path of the robot, float64[n, 2], metres in ``map``.
        priority: Priority of the robot.
        peers: Peers whose state is fresh.
        min_separation_m: Minimum separation of two robots' centres.
        cruise_mps: Speed at which positions are predicted.
        stationary: Names of the peers that do not move.

    Returns:
        The peer and how to yield to it, None to go on.
    """
    before = [p for p in peers if p.intention.priority > priority and not p.is_parked]
    if not before:
        return None
    own = predict_positions(position, path, cruise_mps, _TIMES_S)
    for peer in sorted(before, key=lambda peer: -peer.intention.priority):
        stands = peer.name in stationary
        if stands and np.hypot(*(peer.position - position)) > _BLOCKING_FACTOR * min_separation_m:
            continue
        theirs = predict_peer(peer, cruise_mps)
        if stands or _conflict(own, theirs, min_separation_m):
            is_on_path = approaches(position, theirs, min_separation_m)
            if is_on_path or not stands:
                return peer, Yield.MAKE_ROOM if is_on_path else Yield.WAIT
    return None


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
    """Predict the positions of a robot that follows a path at constant speed.

    The robot moves from ``start`` to the nearest point of the path and along it; it stays at
    the end.

    Args:
        start: float64[2], metres in ``map``.
        path: float64[n, 2], metres in ``map``.
        speed_mps: Speed along the path.
        times_s: float64[k], times from now.

    Returns:
        float64[k, 2], metres in ``map``.
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
