"""Votes for the periods of motions.

``tracking/periodic_motion.py`` has the reasoning, ``periodic_motion.py`` the trails.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.files.kernel_cache import njit
from quad_nav.tracking.periodic_motion_kernel import NONE, Trails

_ASIDE_M = 0.15  # offset across the direction of motion, which no lag explains
_SAME_LAG_S = 0.12
_MOST = 64  # trails that one sample votes for
_RECENT_VOTES = 30  # a lag is the mean of about so many votes
NEAR, SUPPORT, ONE_TURN, ODD = range(4)
"""Rows of ``sums_of_turns``."""


class Votes(NamedTuple):
    """Lags after which trails repeat others, with the number of samples that vote for each.

    Attributes:
        lags: float64[c], seconds.
        counts: int64[c], number of samples.
        trails: int64[c], trail of each lag.
        following: int64[c], next lag of the same trail, or NONE.
        heads: int64[m], first lag of each trail, or NONE.
    """

    lags: NDArray[np.float64]
    counts: NDArray[np.int64]
    trails: NDArray[np.int64]
    following: NDArray[np.int64]
    heads: NDArray[np.int64]


@njit(cache=True, nogil=True)
def vote(
    trails: Trails,
    row: int,
    scales: Tuple[float, float],
    before_s: float,
    votes: Votes,
    count: int,
) -> int:
    """Add the votes of one sample: one for each trail that has a sample alike in the past.

    Both trails get the vote. The lag is corrected by the offset along the direction of motion.

    Args:
        trails: The trails.
        row: Index of the sample.
        scales: Differences in place and in velocity that count as 1.
        before_s: Samples of less than this before do not count.
        votes: The votes, changed in place.
        count: Number of lags in ``votes``.

    Returns:
        The number of lags, at most the room that there is.
    """
    samples, owners = trails.samples, trails.owners
    found, nearest, lags = np.empty(_MOST, np.int64), np.empty(_MOST), np.empty(_MOST)
    size = 0
    for k in range(row):
        if samples[k, 0] > samples[row, 0] - before_s:
            break
        apart, lag = _likeness(samples, k, row, scales)
        if apart >= 1.0:
            continue
        at = 0
        while at < size and found[at] != owners[k]:
            at += 1
        if at == _MOST or (at < size and apart >= nearest[at]):
            continue
        size = max(size, at + 1)
        found[at], nearest[at], lags[at] = owners[k], apart, lag
    for at in range(size):
        count = _add_vote(votes, count, owners[row], lags[at])
        if found[at] != owners[row]:
            count = _add_vote(votes, count, found[at], lags[at])
    return count


@njit(cache=True, nogil=True)
def _likeness(
    samples: NDArray[np.float64], a: int, b: int, scales: Tuple[float, float]
) -> Tuple[float, float]:
    """Return the squared difference of two samples in scales, 1 if unlike, and the lag of b."""
    dx, dy = samples[b, 1] - samples[a, 1], samples[b, 2] - samples[a, 2]
    if abs(dx) >= scales[0] or abs(dy) >= scales[0]:
        return 1.0, 0.0
    du, dv = samples[b, 3] - samples[a, 3], samples[b, 4] - samples[a, 4]
    apart = (dx * dx + dy * dy) / scales[0] ** 2 + (du * du + dv * dv) / scales[1] ** 2
    if apart >= 1.0:
        return 1.0, 0.0
    vx, vy = 0.5 * (samples[a, 3] + samples[b, 3]), 0.5 * (samples[a, 4] + samples[b, 4])
    squared = max(vx * vx + vy * vy, 1e-6)
    if abs(dx * vy - dy * vx) > _ASIDE_M * math.sqrt(squared):
        return 1.0, 0.0
    return apart, samples[b, 0] - samples[a, 0] - (dx * vx + dy * vy) / squared


@njit(cache=True, nogil=True)
def _add_vote(votes: Votes, count: int, trail: int, lag: float) -> int:
    """Add a vote to the lag of a trail that is the same, or to a new one; return the count."""
    at = votes.heads[trail]
    while at != NONE:
        if abs(votes.lags[at] - lag) < _SAME_LAG_S:
            votes.counts[at] += 1
            votes.lags[at] += (lag - votes.lags[at]) / min(votes.counts[at], _RECENT_VOTES)
            return count
        at = votes.following[at]
    if count < votes.lags.shape[0]:
        votes.lags[count], votes.counts[count], votes.trails[count] = lag, 1, trail
        votes.following[count] = votes.heads[trail]
        votes.heads[trail] = count
        return count + 1
    return count


@njit(cache=True, nogil=True)
def first_turns(
    votes: Votes, count: int, periods: NDArray[np.float64], tolerances: Tuple[float, float]
) -> Tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return how many lags are one turn of each period, int64[p], and each trail's votes for them.

    Args:
        votes: The votes.
        count: Number of lags in ``votes``.
        periods: float64[p].
        tolerances: By how much a lag may be off: in s, and more in s for each turn.

    Returns:
        int64[p] and float64[m, p].
    """
    lag_counts = np.zeros(len(periods), np.int64)
    by_trail = np.zeros((len(votes.heads), len(periods)))
    for c in range(count):
        for p in range(len(periods)):
            if _turns(votes.lags[c], periods[p], tolerances) == 1.0:
                lag_counts[p] += 1
                by_trail[votes.trails[c], p] += votes.counts[c]
    return lag_counts, by_trail


@njit(cache=True, nogil=True)
def sums_of_turns(
    votes: Votes, count: int, periods: NDArray[np.float64], tolerances: Tuple[float, float]
) -> NDArray[np.float64]:
    """Return sums over the votes of each trail for any number of turns of each period.

    Args:
        votes: The votes.
        count: Number of lags in ``votes``.
        periods: float64[p].
        tolerances: As for ``first_turns``.

    Returns:
        float64[4, m, p]: at ``NEAR`` each vote counts as the inverse of its number of turns, so
        that half a period has fewer; at ``SUPPORT`` as 1; at ``ONE_TURN`` as the time of one turn,
        in s; at ``ODD`` as 1 if the number of turns is odd.
    """
    sums = np.zeros((4, len(votes.heads), len(periods)))
    for c in range(count):
        trail, weight, lag = votes.trails[c], float(votes.counts[c]), votes.lags[c]
        for p in range(len(periods)):
            turns = _turns(lag, periods[p], tolerances)
            if turns > 0.0:
                sums[NEAR, trail, p] += weight / turns
                sums[SUPPORT, trail, p] += weight
                sums[ONE_TURN, trail, p] += weight * lag / turns
                sums[ODD, trail, p] += weight * (turns % 2.0)
    return sums


@njit(cache=True, nogil=True)
def _turns(lag: float, period: float, tolerances: Tuple[float, float]) -> float:
    """Return how many turns of a period a lag is, 0 if it is between two numbers of turns."""
    turns = max(np.rint(lag / period), 1.0)
    if abs(lag - turns * period) < tolerances[0] + tolerances[1] * turns:
        return turns
    return 0.0
