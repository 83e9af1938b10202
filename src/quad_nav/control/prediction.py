"""Predictions of tracked obstacles, for the rollouts of local planners and for the evasion.

An obstacle keeps its acceleration of the last half second for another half second, then its
velocity. Where the memory of this flight recalls one that moved alike, it goes where that one
went. Obstacles with a periodic motion are where they were a period ago, seen or hidden. Where most
obstacles have one, a track without a period is of an obstacle on a way that was not seen before,
and it turns soon: it is predicted for a second while it is seen, and not while it is hidden or
while an obstacle with a period is in its disc. The standard deviation of a prediction grows
linearly with time.
"""

from __future__ import annotations

import math
from typing import Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.control.moving_discs import MovingDiscs
from quad_nav.geometry import Pose2D
from quad_nav.tracking.motion_memory import SEEN_M, MotionMemory
from quad_nav.tracking.periodic_motion_kernel import follow_replays, forget_after
from quad_nav.tracking.tracks import Tracks

Floats = NDArray[np.float64]

_SIGMA_M, _SIGMA_MPS = 0.08, 0.05  # least uncertainty of a prediction, and its growth
_MAX_SIGMA_MPS = 0.1
_RECALLED_SIGMA_M, _RECALLED_SIGMA_MPS = 0.12, 0.03
_REPLAYED_SIGMA_M = 0.08  # of periodic motions; it does not grow
_SAME = 0.4, 0.8, 0.6  # differences of a track and its replay in m and m/s, later ones in m
_UNKNOWN_S = 1.0  # for which others are known where most repeat their motion
_NEAR_M = 8.0  # replays farther away are of no interest
_ACCELERATES_S = 0.5  # for which an obstacle keeps its acceleration
_ROLLOUT_STEP_S = 0.05  # longest time between two predictions of a rollout

FAR_M = 1e6
"""Coordinates of a disc that is nowhere at a time."""
NO_DISCS = MovingDiscs(np.empty((1, 0, 4)), 0.0)


def predict(
    tracks: Tracks, memory: MotionMemory, times_s: Floats, origin: Tuple[float, float] = (0.0, 0.0)
) -> Floats:
    """Return where obstacles will be.

    Args:
        tracks: The obstacles.
        memory: The memory of how obstacles have moved; it holds these tracks already.
        times_s: float64[t], times after that of the tracks, increasing from 0.
        origin: Point that positions are relative to, in the tracks' frame, metres.

    Returns:
        float64[t, n, 4]: x and y relative to the origin, radius, standard deviation of the
        position. The discs of periodic motions follow those of the tracks. A disc is out of reach,
        ``FAR_M`` away, at times at which nothing is known of it or another disc has its place.
    """
    discs = extrapolate(tracks, memory, times_s, origin)
    return remember(discs, tracks, memory, times_s, origin)


def extrapolate(
    tracks: Tracks, memory: MotionMemory, times_s: Floats, origin: Tuple[float, float] = (0.0, 0.0)
) -> Floats:
    """Return where obstacles will be by their acceleration and velocity alone.

    Arguments and result are those of ``predict``, with one disc for each track.
    """
    discs = np.empty((len(times_s), len(tracks), 4))
    offsets = tracks.states[:, :2] - np.array(origin)
    discs[:, :, :2] = offsets + times_s[:, None, None] * tracks.states[:, 2:]
    during = np.minimum(times_s, _ACCELERATES_S)
    turned = during * (times_s - 0.5 * during)
    for k, number in enumerate(tracks.numbers.tolist()):
        discs[:, k, :2] += turned[:, None] * memory.acceleration(number)
    discs[:, :, 2] = tracks.radii_m
    growth = np.clip(np.sqrt(tracks.velocity_variances), _SIGMA_MPS, _MAX_SIGMA_MPS)
    discs[:, :, 3] = np.sqrt(tracks.position_variances + _SIGMA_M**2) + times_s[:, None] * growth
    return discs


def remember(
    extrapolated: Floats,
    tracks: Tracks,
    memory: MotionMemory,
    times_s: Floats,
    origin: Tuple[float, float],
) -> Floats:
    """Return extrapolated discs, moved to where the memory knows better.

    Arguments and result are those of ``predict``; the discs are those of ``extrapolate``.
    """
    discs = extrapolated.copy()
    _recall(memory, tracks.numbers, times_s, discs)
    replays = memory.replay(tracks.time_s + times_s)
    if not len(replays.radii_m):
        return discs
    places, velocities = replays.places - np.array(origin), replays.velocities
    follow_replays(discs, tracks.states[:, 2:], places, velocities, times_s, _SAME, FAR_M)
    if memory.most_repeat:  # most of those that are hidden are not there: they have turned
        is_hidden = tracks.position_variances > SEEN_M**2
        holds_replay = _holds_any(
            tracks.states[:, :2] - np.array(origin), tracks.radii_m, places[0]
        )
        discs[:, (is_hidden | holds_replay) & (discs[0, :, 0] != FAR_M), :2] = FAR_M
        forget_after(discs, times_s, _UNKNOWN_S, FAR_M)
    return join_discs(discs, _replayed(places, replays.radii_m, times_s))


def join_discs(first: Floats, second: Floats) -> Floats:
    """Return the discs of both, float64[t, n + m, 4].

    They are in C order, for which kernels are compiled: an array indexed with a mask has another.
    """
    return np.ascontiguousarray(np.concatenate([first, second], axis=1))


def _holds_any(centres: Floats, radii_m: Floats, places: Floats) -> NDArray[np.bool_]:
    """Return which discs, float64[n, 2] and float64[n], hold any of the places, float64[m, 2].

    Where places of replays are in the disc of a track that has no replay, obstacles pass each other
    there and look like one, whose velocity is none of theirs.
    """
    apart = np.hypot(*(centres[:, None] - places).transpose(2, 0, 1))
    holds: NDArray[np.bool_] = (apart < radii_m[:, None]).any(axis=1)
    return holds


def _replayed(places: Floats, radii_m: Floats, times_s: Floats) -> Floats:
    """Return the discs of replays, float64[t, m, 4]."""
    discs = np.empty((*places.shape[:2], 4))
    discs[:, :, :2] = np.where(np.isfinite(places), places, FAR_M)
    discs[:, :, 2] = radii_m
    discs[:, :, 3] = _REPLAYED_SIGMA_M
    near = np.hypot(discs[:, :, 0], discs[:, :, 1]).min(axis=0) < _NEAR_M
    return discs[:, near]


def _recall(
    memory: MotionMemory, numbers: NDArray[np.int64], times_s: Floats, discs: Floats
) -> None:
    """Move the discs of obstacles that the memory recalls."""
    for k, number in enumerate(numbers.tolist()):
        recalled = memory.recall(number, times_s)
        if recalled.known:
            discs[:, k, :2] = discs[0, k, :2] + recalled.moves
            known = min(discs[0, k, 3], _RECALLED_SIGMA_M) + times_s * _RECALLED_SIGMA_MPS
            discs[: recalled.known, k, 3] = known[: recalled.known]


def rollout_discs(
    tracks: Tracks,
    memory: MotionMemory,
    pose: Pose2D,
    radius_m: float,
    clearance_m: float,
    rollout_s: float,
) -> MovingDiscs:
    """Return what the rollouts of a local planner are judged against.

    An obstacle that the robot's circle overlaps already counts as smaller, so that rollouts that
    lead away from it are legal.

    Args:
        tracks: The obstacles now, in the local costmap's frame.
        memory: The memory of how obstacles have moved; it holds these tracks already.
        pose: Pose of the robot in the same frame.
        radius_m: Radius of the robot.
        clearance_m: Distance beyond it within which a pass costs most.
        rollout_s: Duration of the rollouts.
    """
    steps = max(math.ceil(rollout_s / _ROLLOUT_STEP_S), 1)
    discs = predict(tracks, memory, np.linspace(0.0, rollout_s, steps + 1))
    apart = np.hypot(discs[0, :, 0] - pose.x_m, discs[0, :, 1] - pose.y_m)
    discs[:, :, 2] = np.minimum(discs[0, :, 2] + radius_m, apart)
    return MovingDiscs(discs, float(clearance_m))
