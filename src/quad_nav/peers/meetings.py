"""Meetings: where a robot comes too near to its peers if all fly straight to their goals."""

from __future__ import annotations

from typing import Tuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_HORIZON_S = 30.0
_NEARER_M = 0.05  # an approach by less does not count
_SAME_TIME_S = 3.0


def reach_m(speed_mps: float) -> float:
    """Return the distance up to which a peer can be met, in metres."""
    return 2.0 * speed_mps * _HORIZON_S


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
