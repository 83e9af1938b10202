"""Which cluster belongs to which track: gates and global nearest neighbours, greedily.

Source: S. Blackman, R. Popoli, "Design and Analysis of Modern Tracking Systems", 1999, section 6.4.
The nearest pair is taken first, then the nearest of those that are left: at the distances of people
and robots, its result is mostly that of the best assignment, and needs no other library.
"""

from __future__ import annotations

from typing import List, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_moving.discs import EDGE_M, FIRST_RADIUS_M, Outlines

Floats = NDArray[np.float64]

GATE = 13.8
"""Squared Mahalanobis distance, chi-square with 2 degrees of freedom, 0.1 %."""


def assign(
    states: Floats,
    covariances: Floats,
    seen: Outlines,
    usable: NDArray[np.bool_],
    part_far_m: float,
) -> List[Tuple[int, int]]:
    """Return pairs of tracks and clusters, each of them at most once.

    A cluster of which an edge is hidden is paired only with a track near it, where its disc is
    fitted.

    Args:
        states: float64[m, 4] of the tracks, predicted.
        covariances: float64[m, 4, 4] of the states.
        seen: First guesses of the clusters' discs.
        usable: bool[k], clusters that may be obstacles that move.
        part_far_m: Greatest distance from its track of a cluster of which an edge is hidden.
    """
    rows = np.flatnonzero(usable)
    if not len(states) or not len(rows):
        return []
    distances = _distances(states, covariances, seen.centres[rows], seen.is_whole[rows])
    pairs: List[Tuple[int, int]] = []
    away_m = np.hypot(*(states[:, None, :2] - seen.centres[rows]).transpose(2, 0, 1))
    is_near = seen.is_whole[rows] | (away_m < part_far_m)
    tracks, columns = np.nonzero((distances < GATE) & is_near)
    order = np.argsort(distances[tracks, columns], kind="stable")
    free_tracks, free_columns = np.ones(len(states), bool), np.ones(len(rows), bool)
    for track, column in zip(tracks[order].tolist(), columns[order].tolist()):
        if free_tracks[track] and free_columns[column]:
            free_tracks[track] = free_columns[column] = False
            pairs.append((track, int(rows[column])))
    return sorted(pairs)


def _distances(
    states: Floats, covariances: Floats, centres: Floats, is_whole: NDArray[np.bool_]
) -> Floats:
    """Return squared Mahalanobis distances, float64[m, k]."""
    dx = centres[None, :, 0] - states[:, None, 0]
    dy = centres[None, :, 1] - states[:, None, 1]
    own = np.where(is_whole, EDGE_M, FIRST_RADIUS_M)[None, :] ** 2
    xx = covariances[:, 0, 0, None] + own
    yy = covariances[:, 1, 1, None] + own
    xy = covariances[:, 0, 1, None]
    squares: Floats = (yy * dx * dx - 2.0 * xy * dx * dy + xx * dy * dy) / (xx * yy - xy * xy)
    return squares
