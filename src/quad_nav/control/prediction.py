"""Predictions of tracked obstacles, for the rollouts of local planners and for the evasion.

Obstacles keep their velocities. The standard deviation of a prediction grows linearly with time.
"""

from __future__ import annotations

import math
from typing import Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.control.moving_discs import MovingDiscs
from quad_nav.geometry import Pose2D
from quad_nav.tracking.tracks import Tracks

Floats = NDArray[np.float64]

_SIGMA_M, _SIGMA_MPS = 0.08, 0.05  # least uncertainty of a prediction, and its growth
_MAX_SIGMA_MPS = 0.1
_ROLLOUT_STEP_S = 0.05  # longest time between two predictions of a rollout

NO_DISCS = MovingDiscs(np.empty((1, 0, 4)), 0.0)


def predict(tracks: Tracks, times_s: Floats, origin: Tuple[float, float] = (0.0, 0.0)) -> Floats:
    """Return where obstacles will be.

    Args:
        tracks: The obstacles.
        times_s: float64[t], times after that of the tracks, increasing from 0.
        origin: Point that positions are relative to, in the tracks' frame, metres.

    Returns:
        float64[t, n, 4]: x and y relative to the origin, radius, standard deviation of the
        position.
    """
    discs = np.empty((len(times_s), len(tracks), 4))
    offsets = tracks.states[:, :2] - np.array(origin)
    discs[:, :, :2] = offsets + times_s[:, None, None] * tracks.states[:, 2:]
    discs[:, :, 2] = tracks.radii_m
    growth = np.clip(np.sqrt(tracks.velocity_variances), _SIGMA_MPS, _MAX_SIGMA_MPS)
    discs[:, :, 3] = np.sqrt(tracks.position_variances + _SIGMA_M**2) + times_s[:, None] * growth
    return discs


def join_discs(first: Floats, second: Floats) -> Floats:
    """Return the discs of both, float64[t, n + m, 4].

    They are in C order, for which kernels are compiled: an array indexed with a mask has another.
    """
    return np.ascontiguousarray(np.concatenate([first, second], axis=1))


def rollout_discs(
    tracks: Tracks, pose: Pose2D, radius_m: float, clearance_m: float, rollout_s: float
) -> MovingDiscs:
    """Return what the rollouts of a local planner are judged against.

    An obstacle that the robot's circle overlaps already counts as smaller, so that rollouts that
    lead away from it are legal.

    Args:
        tracks: The obstacles now, in the local costmap's frame.
        pose: Pose of the robot in the same frame.
        radius_m: Radius of the robot.
        clearance_m: Distance beyond it within which a pass costs most.
        rollout_s: Duration of the rollouts.
    """
    steps = max(math.ceil(rollout_s / _ROLLOUT_STEP_S), 1)
    discs = predict(tracks, np.linspace(0.0, rollout_s, steps + 1))
    apart = np.hypot(discs[0, :, 0] - pose.x_m, discs[0, :, 1] - pose.y_m)
    discs[:, :, 2] = np.minimum(discs[0, :, 2] + radius_m, apart)
    return MovingDiscs(discs, float(clearance_m))
