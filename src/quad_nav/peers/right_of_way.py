"""Who goes and who makes room.

Two robots that follow their plans come too near to each other: the one of the higher
rank number (``peers.rank_of``) gives way. It waits where it is, if the other passes it
there; if not it leaves the other's way. All know all ranks and ranks differ, so of two
exactly one gives way, and of any number one goes.

Where robots will be is reckoned at an even cruising speed. They turn and slow down
besides, so two count as meeting when they are at one place within ``EARLIER_LATER_S``
of each other.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import Container, Optional, Sequence, Tuple

import numpy as np

from quad_nav.geometry import Pose2D
from quad_nav.kernels.paths import sample_path
from quad_nav.peers.peer import Peer

HORIZON_S = 7.0
EARLIER_LATER_S = 1.5
_STEP_S = 0.25
_TIMES_S = np.arange(0.0, HORIZON_S + 1e-9, _STEP_S)
_STEPS_APART = np.abs(np.subtract.outer(np.arange(len(_TIMES_S)), np.arange(len(_TIMES_S))))
_MEETING = _STEPS_APART * _STEP_S <= EARLIER_LATER_S + 1e-9
_NEARER_M = 0.05  # what counts as coming nearer
_WHY_IT_STANDS = 2.0  # times min_separation_m: who is farther away cannot be what a peer stands for


class Manner(enum.Enum):
    """How a robot gives way."""

    WAIT = "waits for"
    LEAVE = "makes room for"


@dataclass(frozen=True)
class YieldDecision:
    """What a robot does for a peer: wait, or go to ``refuge`` first."""

    to: str
    manner: Manner
    refuge: Optional[Pose2D] = None

    def __str__(self) -> str:
        where = (
            f" at ({self.refuge.x_m:.2f}, {self.refuge.y_m:.2f})" if self.refuge is not None else ""
        )
        return f"{self.manner.value} {self.to}{where}"


def gives_way(
    position: np.ndarray,
    way: np.ndarray,
    rank_s: float,
    peers: Sequence[Peer],
    min_separation_m: float,
    speed_mps: float,
    standing: Container[str] = (),
) -> Optional[Tuple[Peer, Manner]]:
    """To whom a robot gives way, and how; None when it goes.

    The robot is at ``position``, float64[2], and follows ``way``, float64[n, 2]; centres
    are to stay ``min_separation_m`` from each other. Of several peers the first in rank counts.
    Nobody waits for those ``standing``, by name; but who is near and in their way makes
    room, for it may be why they stand.
    """
    own = positions_ahead(position, way, speed_mps, _TIMES_S)
    for peer in sorted(peers, key=lambda peer: peer.intention.rank_s):
        if peer.intention.rank_s >= rank_s or peer.is_parked:
            continue
        stands = peer.name in standing
        if stands and np.hypot(*(peer.position - position)) > _WHY_IT_STANDS * min_separation_m:
            continue
        theirs = track(peer, speed_mps)
        if comes_near(position, theirs, min_separation_m):
            return peer, Manner.LEAVE
        if not stands and _meet(own, theirs, min_separation_m):
            return peer, Manner.WAIT
    return None


def track(peer: Peer, speed_mps: float, times_s: np.ndarray = _TIMES_S) -> np.ndarray:
    """Where a peer will be, float64[k, 2]."""
    return positions_ahead(
        peer.position, peer.intention.way, max(speed_mps, peer.speed_mps), times_s
    )


def comes_near(position: np.ndarray, theirs: np.ndarray, min_separation_m: float) -> bool:
    """Whether a track, float64[k, 2], comes nearer to a place than it may."""
    distances = np.hypot(*(theirs - position).T)
    return bool(distances.min() < min(min_separation_m, distances[0] - _NEARER_M))


def _meet(own: np.ndarray, theirs: np.ndarray, min_separation_m: float) -> bool:
    """Whether two tracks come nearer than they may, and nearer than they are now."""
    distances = np.hypot(*np.moveaxis(own[:, None] - theirs[None], 2, 0))
    nearest = distances[_MEETING].min()
    return bool(nearest < min(min_separation_m, distances[0, 0] - _NEARER_M))


def positions_ahead(
    start: np.ndarray, way: np.ndarray, speed_mps: float, times_s: np.ndarray
) -> np.ndarray:
    """Where a robot will be at times from now, float64[k, 2].

    It goes from ``start``, float64[2], to the nearest point of its ``way``,
    float64[n, 2], and along it at an even speed; at the end it stays.
    """
    if not len(way):
        return np.repeat(start[None, :], len(times_s), axis=0)
    return sample_path(start, way, speed_mps * times_s)
