"""The other quadcopters: where they are, how they move and what they are up to.

All positions are in ``map``, the global costmap's frame. A peer says of itself where
it is going (``Intention``); from that and its velocity follows where it will be.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from quad_nav.geometry import Pose2D, Twist2D

NO_WAY_POINTS = np.zeros((0, 2))
IDLE_RANK_S = 4.0e9  # later than any time; a ROS stamp can still hold it
_NUMBER_S = 0.01
_STANDS_MPS = 0.05
_GOES_ON_S = 5.0


def rank_of(since_s: float, number: int) -> float:
    """Who goes first: the lower rank, who has been under way to its goal for longer.

    ``since_s`` is when the goal was set, ``IDLE_RANK_S`` without one. A hundredth of a
    second for each robot's ``number`` orders those that set out together.
    """
    return since_s + _NUMBER_S * number


@dataclass(frozen=True)
class Intention:
    """What a robot tells its peers.

    ``way`` float64[n, 2] is what is left of its plan, empty when it is to stay where it
    is; ``rank_s`` as ``rank_of``.
    """

    rank_s: float = IDLE_RANK_S
    way: np.ndarray = field(default_factory=lambda: NO_WAY_POINTS)


@dataclass(frozen=True)
class Peer:
    """Another robot as it was seen at ``stamp_s``."""

    name: str
    x_m: float
    y_m: float
    vx_mps: float
    vy_mps: float
    stamp_s: float
    intention: Intention = Intention()

    @property
    def position(self) -> np.ndarray:
        """float64[2]"""
        return np.array([self.x_m, self.y_m])

    @property
    def speed_mps(self) -> float:
        return math.hypot(self.vx_mps, self.vy_mps)

    @property
    def is_parked(self) -> bool:
        """Whether it means to stay where it is."""
        return not len(self.intention.way)

    def moved_to(self, now_s: float) -> Peer:
        """The peer now, if it has kept its velocity."""
        age_s = now_s - self.stamp_s
        return replace(
            self,
            x_m=self.x_m + self.vx_mps * age_s,
            y_m=self.y_m + self.vy_mps * age_s,
            stamp_s=now_s,
        )

    def intending(self, intention: Intention) -> Peer:
        """The same with another intention."""
        return replace(self, intention=intention)


def peer_at(
    name: str, pose: Pose2D, velocity: Twist2D, stamp_s: float, intention: Intention = Intention()
) -> Peer:
    """A peer from its pose in ``map`` and its odometry's velocity, in its own frame."""
    vx_mps, vy_mps = pose.rotate(velocity.vx_mps, velocity.vy_mps)
    return Peer(
        name,
        pose.x_m,
        pose.y_m,
        vx_mps,
        vy_mps,
        stamp_s,
        intention,
    )


def unknown_intention(peer: Peer) -> Intention:
    """Of one that tells nothing: it goes on as it does, and before everybody else."""
    if peer.speed_mps < _STANDS_MPS:
        return Intention()
    ahead = peer.position + _GOES_ON_S * np.array([peer.vx_mps, peer.vy_mps])
    return Intention(0.0, np.array([peer.position, ahead]))


def thinned(way: np.ndarray, spacing_m: float) -> np.ndarray:
    """A way, float64[n, 2], with a point about every ``spacing_m`` and both of its ends."""
    if len(way) < 2:
        return way
    lengths = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(way, axis=0).T))))
    at = np.linspace(0.0, lengths[-1], 2 + int(lengths[-1] / spacing_m))
    return np.column_stack((np.interp(at, lengths, way[:, 0]), np.interp(at, lengths, way[:, 1])))
