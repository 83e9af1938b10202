"""Peers: state, intention and priority of the other robots.

All positions are in the frame of the global costmap, here called ``map``. Each robot tells its
peers its intention: its priority and the path that it follows.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from quad_nav.geometry import Pose2D, Twist2D

NO_PATH = np.zeros((0, 2))
HIGHEST_PRIORITY = 1.0  # above that of every goal
IDLE_PRIORITY = -4.0e9  # below that of every goal; a ROS stamp can still hold 4.0e9 s
_NUMBER_S = 0.01
_STATIONARY_MPS = 0.05
_EXTRAPOLATION_S = 5.0


def priority_of(goal_set_s: float, number: int) -> float:
    """Return the priority of a robot with a goal; the higher one goes first.

    The robot with the older goal goes first. A hundredth of a second for each robot number decides
    between goals that are set together.
    """
    return -(goal_set_s + _NUMBER_S * number)


def idle_priority(number: int) -> float:
    """Return the priority of a robot without a goal."""
    return priority_of(-IDLE_PRIORITY, number)


@dataclass(frozen=True)
class Intention:
    """Message of a robot to its peers.

    Attributes:
        priority: See ``priority_of``; the higher one goes first.
        path: float64[n, 2], metres in ``map``: the whole plan, with what is flown of it; empty
            for a robot that stays where it is.
    """

    priority: float = IDLE_PRIORITY
    path: NDArray[np.float64] = field(default_factory=lambda: NO_PATH)

    def is_same(self, other: Intention) -> bool:
        """Return whether two intentions are equal."""
        return self.priority == other.priority and (
            self.path is other.path or np.array_equal(self.path, other.path)
        )

    def transformed(self, a_from_b: Pose2D) -> Intention:
        """Return an intention in frame b in frame a."""
        return replace(self, path=a_from_b.transform_points(self.path))


@dataclass(frozen=True)
class Peer:
    """State of another robot at ``stamp_s``; position and velocity in ``map``."""

    name: str
    x_m: float
    y_m: float
    vx_mps: float
    vy_mps: float
    stamp_s: float
    intention: Intention = Intention()

    @property
    def position(self) -> NDArray[np.float64]:
        """Position in metres, float64[2]."""
        return np.array([self.x_m, self.y_m])

    @property
    def speed_mps(self) -> float:
        """Speed over ground."""
        return math.hypot(self.vx_mps, self.vy_mps)

    @property
    def is_parked(self) -> bool:
        """True if the peer intends to stay where it is."""
        return not len(self.intention.path)

    def extrapolated(self, now_s: float) -> Peer:
        """Return the peer at another time, moved at its velocity."""
        age_s = now_s - self.stamp_s
        if age_s == 0.0:
            return self
        x_m, y_m = self.x_m + self.vx_mps * age_s, self.y_m + self.vy_mps * age_s
        return Peer(self.name, x_m, y_m, self.vx_mps, self.vy_mps, now_s, self.intention)

    def relative_to(self, map_from_frame: Pose2D) -> Peer:
        """Return a peer and its intention in ``map`` in another frame, as if that stood still."""
        frame_from_map = map_from_frame.inverse()
        x_m, y_m = map_from_frame.inverse_transform(self.x_m, self.y_m)
        vx_mps, vy_mps = frame_from_map.rotate(self.vx_mps, self.vy_mps)
        return Peer(
            self.name,
            x_m,
            y_m,
            vx_mps,
            vy_mps,
            self.stamp_s,
            self.intention.transformed(frame_from_map),
        )

    def with_intention(self, intention: Intention) -> Peer:
        """Return the same peer with another intention."""
        return replace(self, intention=intention)


def peer_at(
    name: str, pose: Pose2D, velocity: Twist2D, stamp_s: float, intention: Intention = Intention()
) -> Peer:
    """Make a peer from its pose in ``map`` and its velocity in its own frame."""
    vx_mps, vy_mps = pose.rotate(velocity.vx_mps, velocity.vy_mps)
    return Peer(name, pose.x_m, pose.y_m, vx_mps, vy_mps, stamp_s, intention)


def assumed_intention(peer: Peer) -> Intention:
    """Return the intention assumed of a peer that sends none.

    A moving peer is expected to fly straight on and to go first; a stationary one is parked.
    """
    if peer.speed_mps < _STATIONARY_MPS:
        return Intention()
    ahead = peer.position + _EXTRAPOLATION_S * np.array([peer.vx_mps, peer.vy_mps])
    return Intention(HIGHEST_PRIORITY, np.array([peer.position, ahead]))


def resample(path: NDArray[np.float64], spacing_m: float) -> NDArray[np.float64]:
    """Resample a path, float64[n, 2], with a point about every ``spacing_m``; both ends stay."""
    if len(path) < 2:
        return path
    lengths = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))))
    at = np.linspace(0.0, lengths[-1], 2 + int(lengths[-1] / spacing_m))
    return np.column_stack((np.interp(at, lengths, path[:, 0]), np.interp(at, lengths, path[:, 1])))
