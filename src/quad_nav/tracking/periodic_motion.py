"""Periodic motion: obstacles that repeat their motion after a fixed time are known beforehand.

Shuttles, conveyors, swing doors and the obstacles of benchmarks repeat their motion after a period.
Tracks alone do not show it: they break whenever something hides an obstacle. So each sample of a
track votes: for every trail, an uninterrupted piece of a track, that was once in the same place
with the same velocity, it votes for the time since then. Chance votes have lags of any length;
those of a period add up. A lag for which many samples of more trails vote than chance explains is a
period. Each trail has the period that most of its own votes are for, or twice that if nothing was
there after one, three or five of them: then it is the period of other obstacles. A trail that
nothing votes for, because it was hidden before, has that of the trail that it continues, or that
continues it.

A trail with a period is replayed: the obstacle is where it was a whole number of periods ago,
whether it is seen now or hidden.

Source: the voting is that of P. V. C. Hough, "Method and Means for Recognizing Complex Patterns",
US patent 3069654, 1962, with one parameter, the period.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Dict

import numpy as np
from numpy.typing import NDArray

from quad_nav.tracking.period_votes import (
    NEAR,
    ODD,
    ONE_TURN,
    SUPPORT,
    Votes,
    first_turns,
    sums_of_turns,
    vote,
)
from quad_nav.tracking.periodic_motion_kernel import NONE, Trails, drop_repeats, replay_all
from quad_nav.tracking.trail_links import continued_trails, link

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

_CAPACITY = 60_000  # samples, 300 s of 20 tracks; then it learns anew
_SCALE_M, _SCALE_MPS = 0.3, 0.6  # differences that count as 1
_SHORTEST_S = 9.0  # period
_BREAK_M, _BREAK_MPS = 0.15, 0.25  # by how much a sample may be off the last one's motion
_MIN_SAMPLES = 3  # of a trail, before its samples vote
_MAX_SAMPLES = 20  # longer tracks are cut: some pass from one obstacle to another
_STRONG = 12  # votes for one lag of one trail that propose a period
_LAGS, _VOTES = 6, 40  # of trails and of samples that make a proposed period one
_CHANCE_SIGMAS = 10.0  # standard deviations above the mean number of lags that chance explains
_OWN_VOTES, _OWN_SHARE = 3, 0.1  # of a trail for its period, and their part of all possible ones
_EXACT_VOTES = 8  # of a trail, from which on its own lags are more exact than the common period
_ODD_SHARE = 0.1  # of a trail's votes that odd multiples of its period have at least
_SHARED = 0.4  # part of a multiple's trails that vote for the period as well
_TOLERANCE_S, _TOLERANCE_PER_TURN_S = 0.05, 0.02
_JOIN_TURNS = 2  # a trail that nothing has voted for in so many turns is of something else
_JOINS = 5  # trails in a row that have their period from others
_JOIN_S, _JOIN_M, _JOIN_MPS = 1.5, 0.2, 0.25  # gap at a join, offset and its growth
_LABEL_PERIOD_S = 1.0
_SAME_S, _GAP_S = 0.12, 3.0  # difference of the periods of one obstacle, longest gap of its trails
_LINK_M, _LINK_SPEED = 0.4, 1.2  # offset, and mean speed in a gap in times of the faster end
_BEYOND_S = 0.3
_SAME_M = 0.4  # two replays of one obstacle are nearer
_COLUMNS = 400  # replays at a time
_ROOM = 128  # new lags for each sample: two for each trail that it votes for


@dataclass(frozen=True)
class Replays:
    """Places of obstacles with a period; each column is one replayed trail.

    Attributes:
        places: float64[t, n, 2], m; NaN where a trail is not known.
        velocities: float64[t, n, 2], m/s.
        radii_m: float64[n].
    """

    places: Floats
    velocities: Floats
    radii_m: Floats


NO_REPLAYS = Replays(np.empty((0, 0, 2)), np.empty((0, 0, 2)), np.empty(0))


class PeriodicMotion:
    """Trails of tracked obstacles and their periods."""

    def __init__(self) -> None:
        """Know nothing yet."""
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self._samples = np.empty((1024, 5))
        self._later, self._owners = np.empty(1024, np.int64), np.empty(1024, np.int64)
        self._count = 0
        self._spans = np.empty((0, 2), np.int64)
        self._radii_m, self._periods = np.empty(0), np.empty(0)
        self._nexts, self._gaps = np.empty(0, np.int64), np.empty(0)
        self._sizes = np.empty(0, np.int64)
        self._votes = Votes(np.empty(0), *(np.empty(0, np.int64) for _ in range(4)))
        self._lags = 0
        self._trails: Dict[int, int] = {}  # of the tracks that were seen last
        self._labelled_s = -math.inf

    @property
    def is_empty(self) -> bool:
        """True while no trail has a period."""
        return not self._periods.any()

    @property
    def most_repeat(self) -> bool:
        """True while most trails have a period."""
        whole = self._sizes >= _MIN_SAMPLES
        return bool(2 * np.count_nonzero(self._periods[whole]) > np.count_nonzero(whole))

    def add(self, now_s: float, numbers: Integers, states: Floats, radii_m: Floats) -> None:
        """Take the states of the tracks that are seen well now, at increasing times.

        Args:
            now_s: The time.
            numbers: int64[n], numbers of the tracks.
            states: float64[n, 4], positions and velocities.
            radii_m: float64[n].
        """
        seen = numbers.tolist()
        self._reserve(len(seen))
        trails = {}
        for number, state, radius_m in zip(seen, states, radii_m.tolist()):
            trail = self._trails.get(number, NONE)
            if trail == NONE or not self._continues(trail, now_s, state):
                trail = self._begin()
            trails[number] = trail
            self._add(trail, now_s, state)
            self._radii_m[trail] = min(self._radii_m[trail], radius_m)
        self._trails = trails
        if now_s >= self._labelled_s + _LABEL_PERIOD_S:
            self._labelled_s = now_s
            self._label()
            link(self._view(), _SAME_S, _GAP_S, (_LINK_M, _LINK_SPEED))

    def _continues(self, trail: int, now_s: float, state: Floats) -> bool:
        """Return whether a state follows from a short trail, as if the velocity changed evenly."""
        if self._sizes[trail] >= _MAX_SAMPLES:
            return False
        time_s, x_m, y_m, vx_mps, vy_mps = self._samples[self._spans[trail, 1]].tolist()
        gap_s, mean = now_s - time_s, 0.5 * (state[2:] + (vx_mps, vy_mps))
        off_m = math.hypot(*(state[:2] - (x_m, y_m) - gap_s * mean))
        return off_m <= _BREAK_M + _BREAK_MPS * gap_s

    def _begin(self) -> int:
        """Begin a trail and return its index."""
        self._spans = np.append(self._spans, [[NONE, NONE]], axis=0)
        self._radii_m = np.append(self._radii_m, math.inf)
        self._periods, self._sizes = np.append(self._periods, 0.0), np.append(self._sizes, 0)
        self._nexts, self._gaps = np.append(self._nexts, NONE), np.append(self._gaps, 0.0)
        self._votes = self._votes._replace(heads=np.append(self._votes.heads, NONE))
        return len(self._spans) - 1

    def _add(self, trail: int, now_s: float, state: Floats) -> None:
        row = self._count
        self._count += 1
        self._samples[row, 0], self._samples[row, 1:] = now_s, state
        self._later[row], self._owners[row] = NONE, trail
        if self._spans[trail, 0] == NONE:
            self._spans[trail, 0] = row
        else:
            self._later[self._spans[trail, 1]] = row
        self._spans[trail, 1] = row
        self._sizes[trail] += 1
        if self._sizes[trail] >= _MIN_SAMPLES:
            scales = _SCALE_M, _SCALE_MPS
            self._lags = vote(self._view(), row, scales, _SHORTEST_S, self._votes, self._lags)

    def _view(self) -> Trails:
        rows = slice(self._count)
        return Trails(
            self._samples[rows],
            self._later[rows],
            self._owners[rows],
            self._spans,
            self._periods,
            self._nexts,
            self._gaps,
        )

    def _label(self) -> None:
        """Find the periods, and the one of each trail."""
        lags, counts = self._votes.lags[: self._lags], self._votes.counts[: self._lags]
        periods = _proposed(lags[counts >= _STRONG], counts[counts >= _STRONG])
        self._periods = np.zeros(len(self._spans))
        if not len(periods):
            return
        tolerances = _TOLERANCE_S, _TOLERANCE_PER_TURN_S
        lag_counts, firsts = first_turns(self._votes, self._lags, periods, tolerances)
        is_sound = (lag_counts >= _LAGS) & (firsts.sum(axis=0) >= _VOTES)
        is_sound &= lag_counts >= self._chance_lags(periods)
        periods, firsts = periods[is_sound], firsts[:, is_sound]
        periods = periods[~multiples(periods, firsts > 0.0)]
        if not len(periods):
            return
        sums = sums_of_turns(self._votes, self._lags, periods, tolerances)
        rows, best = np.arange(len(self._spans)), sums[NEAR].argmax(axis=1)
        support, lag_sums, odd = (sums[kind, rows, best] for kind in (SUPPORT, ONE_TURN, ODD))
        own = lag_sums / np.maximum(support, 1.0)
        found = np.where(support >= _EXACT_VOTES, own, periods[best])
        is_half = (support >= _EXACT_VOTES) & (odd < _ODD_SHARE * support)
        found = np.where(is_half, 2.0 * found, found)
        wanted = np.maximum(_OWN_SHARE * self._possible_votes(found), _OWN_VOTES)
        self._periods = np.where(support >= wanted, found, 0.0)
        for _ in range(_JOINS):
            if not self._join():
                break

    def _chance_lags(self, periods: Floats) -> Floats:
        """Return how many lags periods, float64[p], have at most by chance, float64[p].

        If all lags are chance, the part 2 (T - lag) / T^2 of those that are observed in a time T is
        in each second, and their number varies as that of independent events.
        """
        time_s = self._samples[self._count - 1, 0] - self._samples[0, 0]
        width_s = 2.0 * (_TOLERANCE_S + _TOLERANCE_PER_TURN_S)
        part = width_s * 2.0 * np.maximum(time_s - periods, 0.0) / time_s**2
        most: Floats = self._lags * part + _CHANCE_SIGMAS * np.sqrt(self._lags * part)
        return most

    def _possible_votes(self, periods: Floats) -> Floats:
        """Return how many votes each trail would have had of an obstacle that is always seen.

        Args:
            periods: float64[m], a period for each trail.
        """
        times_s = self._samples[np.maximum(self._spans[:, 1], 0), 0]
        before = np.floor((times_s - self._samples[0, 0]) / periods)
        after = np.floor((self._samples[self._count - 1, 0] - times_s) / periods)
        possible: Floats = self._sizes * (before + after)
        return possible

    def _join(self) -> bool:
        """Give trails without a period that of the one that they continue or are continued by.

        Returns:
            Whether there was any.
        """
        whole = (self._spans[:, 0] != NONE) & (self._sizes >= _MIN_SAMPLES)
        known = np.flatnonzero(whole & (self._periods > 0.0))
        unknown = np.flatnonzero(whole & (self._periods == 0.0))
        limits = _JOIN_M, _JOIN_MPS
        joined_to = continued_trails(self._view(), unknown, known, _JOIN_S, limits)
        is_joined = joined_to != NONE
        joined, periods = unknown[is_joined], np.full(len(self._spans), math.inf)
        periods[joined] = self._periods[joined_to[is_joined]]
        joined = joined[self._possible_votes(periods)[joined] <= _JOIN_TURNS * self._sizes[joined]]
        self._periods[joined] = periods[joined]
        return len(joined) > 0

    def replay(self, times_s: Floats) -> Replays:
        """Return where obstacles with a period are.

        Args:
            times_s: float64[t], increasing, from now on.
        """
        if self.is_empty:
            return NO_REPLAYS
        places = np.empty((len(times_s), _COLUMNS, 2))
        velocities, owners = np.empty_like(places), np.empty(_COLUMNS, np.int64)
        count = replay_all(self._view(), times_s, _BEYOND_S, places, velocities, owners)
        places, velocities = places[:, :count], velocities[:, :count]
        radii_m = self._radii_m[owners[:count]]
        drop_repeats(places, radii_m, _SAME_M)
        kept = np.isfinite(places[:, :, 0]).any(axis=0)
        return Replays(places[:, kept], velocities[:, kept], radii_m[kept])

    def _reserve(self, count: int) -> None:
        """Make room for samples and votes; forget everything if there are too many samples."""
        if self._count + count > _CAPACITY:
            self.reset()
        while self._count + count > len(self._samples):
            self._samples = np.concatenate([self._samples, np.empty_like(self._samples)])
            self._later = np.concatenate([self._later, np.empty_like(self._later)])
            self._owners = np.concatenate([self._owners, np.empty_like(self._owners)])
        if self._lags + _ROOM * count > len(self._votes.lags):
            self._votes = _enlarged(self._votes, max(len(self._votes.lags), _ROOM * count))


def _enlarged(votes: Votes, more: int) -> Votes:
    """Return votes with room for more lags."""
    none = np.zeros(more, np.int64)
    return Votes(
        np.append(votes.lags, np.zeros(more)),
        np.append(votes.counts, none),
        np.append(votes.trails, none),
        np.append(votes.following, none),
        votes.heads,
    )


def _proposed(lags: Floats, counts: Integers) -> Floats:
    """Return the means of lags that many votes are for, float64[p], one for those that agree."""
    order = np.argsort(lags)
    lags, weights = lags[order], counts[order].astype(float)
    if not len(lags):
        return lags
    starts = np.flatnonzero(np.append(True, np.diff(lags) > _TOLERANCE_S))
    means: Floats = np.add.reduceat(lags * weights, starts) / np.add.reduceat(weights, starts)
    return means[means > 0.0]


def multiples(periods: Floats, voters: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which periods are multiples of another one, bool[p].

    Many trails that vote for a multiple vote for the period as well; where a period is twice that
    of another obstacle by chance, few do.

    Args:
        periods: float64[p].
        voters: bool[m, p], trails that vote for each period.
    """
    turns = np.rint(periods[:, None] / periods)
    off = np.abs(periods[:, None] - turns * periods)
    is_multiple = (turns >= 2.0) & (off < _TOLERANCE_S + _TOLERANCE_PER_TURN_S * turns)
    counts = voters.T.astype(float) @ voters
    shared = counts / np.maximum(counts.diagonal()[:, None], 1.0)
    found: NDArray[np.bool_] = (is_multiple & (shared >= _SHARED)).any(axis=1)
    return found
