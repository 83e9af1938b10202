"""Memory of motion: obstacles that move as one did before are predicted to go where it went.

Many things that move do it again and again: shuttles, conveyors, doors, people between the same
doors, the obstacles of benchmarks. The memory keeps the states of all tracks for some minutes. Of
an obstacle that is where another was before, with the same velocity, both now and a quarter of a
second ago, it recalls what the other did next, as long as the obstacle stays on the other's path.
Nothing is known beforehand: it learns in flight.

A wrong recollection is worse than none, so only what was well seen is remembered: a track that is
predicted while hidden, or whose states do not follow from each other, as where two tracks were
mistaken for each other, is cut. A track that begins where one that ended a moment before would be
now continues it: something hid the obstacle for that time. Motions that repeat after a fixed time
are known even while their obstacles are hidden, see ``periodic_motion.py``.

Source: prediction by the nearest recorded trajectories as in M. Bennewitz, W. Burgard,
G. Cielniak, S. Thrun, "Learning Motion Patterns of People for Compliant Robot Motion", IJRR
24(1), 2005, without their clustering.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Dict, List

import numpy as np
from numpy.typing import NDArray

from quad_nav.tracking.motion_memory_kernel import NONE, recall, replay
from quad_nav.tracking.periodic_motion import PeriodicMotion, Replays
from quad_nav.tracking.tracks import Tracks

Floats = NDArray[np.float64]

_PERIOD_S = 0.1  # between two samples of a track
_EARLIER_S, _TOO_EARLY_S = 0.25, 1.0  # time between two samples that have to be alike
_TURNS_S = 0.45  # time over which accelerations are taken
_SCALE_M, _SCALE_MPS = 0.2, 0.4  # differences that count as 1
_BEFORE_S = 5.0
SEEN_M = 0.125
"""Standard deviation of positions of obstacles that are seen; that of hidden ones grows beyond."""
_HIDDEN_S = 1.6  # time for which a hidden obstacle stays on a recalled path
_BREAK_M, _BREAK_MPS = 0.15, 0.25  # by how much a sample may be off the last one's motion
_JOIN_S, _JOIN_M, _JOIN_MPS = 4.0, 0.35, 2.0  # gap, offset and change of velocity at a join
_JOIN_SAMPLES = 6  # of a track before it is joined: its velocity is known then
_MAX_ACCELERATION_MPS2 = 2.5
_CAPACITY = 40_000  # samples; 200 s of 20 tracks
_RECENT = 10  # samples of a track, one second


@dataclass(frozen=True)
class Recalled:
    """What the memory recalls of one obstacle.

    Attributes:
        moves: float64[t, 2], positions relative to the track's present one, metres. The first is
            not zero if the obstacle is hidden and its track has left the path.
        known: Number of the times that the memory covers.
    """

    moves: Floats
    known: int


@dataclass
class _Trail:
    """Samples of a track that is seen now, and the past motion that it repeats."""

    rows: List[int] = field(default_factory=list)  # the last ones
    count: int = 0
    alike: int = NONE  # row of the sample that moved alike
    lag_s: float = 0.0  # by which the obstacle repeats it later


class MotionMemory:
    """Memory of the motion of tracked obstacles."""

    def __init__(self) -> None:
        """Remember nothing yet."""
        self.reset()

    def reset(self) -> None:
        """Forget everything, after the clock has jumped back or the frame has changed."""
        self._samples = np.empty((1024, 5))
        self._earlier = np.empty(1024, np.int64)
        self._later = np.empty(1024, np.int64)
        self._count = 0
        self._now_s = -math.inf
        self._places: Dict[int, Floats] = {}
        self._trails: Dict[int, _Trail] = {}
        self._ends: List[int] = []  # last samples of trails that ended
        self._periodic = PeriodicMotion()

    @property
    def span_s(self) -> float:
        """Time from the first sample to the last one."""
        samples = self._samples[: self._count]
        return float(samples[-1, 0] - samples[0, 0]) if self._count else 0.0

    @property
    def most_repeat(self) -> bool:
        """True where most obstacles repeat their motion after a fixed time."""
        return self._periodic.most_repeat

    def add(self, tracks: Tracks) -> None:
        """Remember the states of tracks, at most once in each period."""
        if tracks.time_s < self._now_s - _BEFORE_S:
            self.reset()
        elif tracks.time_s < self._now_s + 0.9 * _PERIOD_S:
            return
        self._now_s = tracks.time_s
        self._reserve(len(tracks))
        self._places = dict(zip(tracks.numbers.tolist(), tracks.states[:, :2]))
        for number in [one for one in self._trails if one not in self._places]:
            trail = self._trails.pop(number)
            self._end(trail)
        seen = tracks.chosen(tracks.position_variances <= SEEN_M**2)
        for number, state in zip(seen.numbers.tolist(), seen.states):
            self._add(number, state)
        self._periodic.add(self._now_s, seen.numbers, seen.states, seen.radii_m)

    def _replay(self, trail: _Trail, times_s: Floats, places: Floats) -> int:
        """Fill float64[t, 2] at times after now; return how many of them are known."""
        past_s = self._now_s - trail.lag_s + times_s
        return int(replay(self._samples[: self._count], self._later, trail.alike, past_s, places))

    def replay(self, times_s: Floats) -> Replays:
        """Return where obstacles with a periodic motion are, at times float64[t] from now on."""
        return self._periodic.replay(times_s)

    def _add(self, number: int, state: Floats) -> None:
        """Remember a state of a track that is seen."""
        row = self._count
        self._count += 1
        self._samples[row, 0], self._samples[row, 1:] = self._now_s, state
        self._later[row] = NONE
        trail = self._trails.setdefault(number, _Trail())
        if trail.rows and not self._continues(trail.rows[-1], row, _BREAK_M, math.inf):
            self._end(trail)
            trail = self._trails[number] = _Trail()
        self._earlier[row] = self._before(trail, _EARLIER_S)
        if trail.rows:
            self._later[trail.rows[-1]] = row
        trail.rows = [*trail.rows[-_RECENT:], row]
        trail.count += 1
        if trail.count == _JOIN_SAMPLES:
            self._join(trail.rows[_JOIN_SAMPLES // 2])

    def _before(self, trail: _Trail, least_s: float) -> int:
        """Return the last sample of a trail that is so old, NONE if there is none or an older."""
        for row in reversed(trail.rows):
            apart_s = self._now_s - self._samples[row, 0]
            if apart_s >= least_s:
                return row if apart_s <= _TOO_EARLY_S else NONE
        return NONE

    def _continues(self, a: int, b: int, offset_m: float, change_mps: float) -> bool:
        """Return whether sample b follows from a: as if the velocity changed evenly."""
        gap_s, dx, dy, du, dv = (self._samples[b] - self._samples[a]).tolist()
        mean_u, mean_v = (0.5 * (self._samples[a, 3:] + self._samples[b, 3:])).tolist()
        off_m = math.hypot(dx - gap_s * mean_u, dy - gap_s * mean_v)
        off = off_m / (offset_m + _BREAK_MPS * gap_s)
        return off * off + (du * du + dv * dv) / change_mps**2 < 1.0

    def _end(self, trail: _Trail) -> None:
        if trail.rows:
            self._ends.append(trail.rows[-1])

    def _join(self, begin: int) -> None:
        """Let a trail that has begun continue the one that ended last and leads to it."""
        start_s = self._samples[begin, 0]
        self._ends = [end for end in self._ends if start_s - self._samples[end, 0] <= _JOIN_S]
        for end in reversed(self._ends):
            if self._samples[end, 0] < start_s and self._continues(end, begin, _JOIN_M, _JOIN_MPS):
                self._later[end] = begin
                self._ends.remove(end)
                return

    def acceleration(self, number: int) -> Floats:
        """Return how the velocity of a track changes, float64[2] in m/s^2, over half a second.

        It is zero for a track that is younger or hidden, and no more than
        ``_MAX_ACCELERATION_MPS2``.
        """
        trail = self._trails.get(number)
        if trail is None or self._samples[trail.rows[-1], 0] < self._now_s:
            return np.zeros(2)
        before = self._before(trail, _TURNS_S)
        if before == NONE:
            return np.zeros(2)
        now, earlier = self._samples[trail.rows[-1]], self._samples[before]
        change: Floats = (now[3:] - earlier[3:]) / (now[0] - earlier[0])
        return change * min(1.0, _MAX_ACCELERATION_MPS2 / max(float(np.hypot(*change)), 1e-9))

    def recall(self, number: int, times_s: Floats) -> Recalled:
        """Return where an obstacle that moved like a track did went next.

        Args:
            number: Number of the track, in the last tracks that were added.
            times_s: float64[t], times after the last ones, increasing from 0.
        """
        moves = np.zeros((len(times_s), 2))
        trail = self._trails.get(number)
        if trail is None or self._now_s - self._samples[trail.rows[-1], 0] > _HIDDEN_S:
            return Recalled(moves, 0)
        seen = trail.rows[-1]
        past = self._place(trail, self._samples[seen, 0])
        if trail.alike == NONE:
            return Recalled(moves, 0)
        known = self._replay(trail, times_s, moves)
        moves += self._samples[seen, 1:3] - past - self._places[number]
        return Recalled(moves, known)

    def _place(self, trail: _Trail, seen_s: float) -> Floats:
        """Return where the past motion was that a trail repeats, float64[2].

        A trail that repeats none, or that has left it, looks for another.
        """
        samples, past = self._samples[: self._count], np.zeros((1, 2))
        seen = trail.rows[-1]
        if trail.alike != NONE:
            known = replay(
                samples, self._later, trail.alike, np.array([seen_s - trail.lag_s]), past
            )
            off_m = math.hypot(*(samples[seen, 1:3] - past[0]))
            if known and off_m <= _SCALE_M:
                return past[0]
        trail.alike = recall(samples, self._earlier, seen, (_SCALE_M, _SCALE_MPS), _BEFORE_S)
        if trail.alike != NONE:
            trail.lag_s = seen_s - samples[trail.alike, 0]
            past[0] = samples[trail.alike, 1:3]
        return past[0]

    def _reserve(self, count: int) -> None:
        """Make room for samples; drop the older half if there are too many."""
        if self._count + count > _CAPACITY:
            self._drop(self._count // 2)
        while self._count + count > len(self._samples):
            self._samples = np.concatenate([self._samples, np.empty_like(self._samples)])
            self._earlier = np.concatenate([self._earlier, np.empty_like(self._earlier)])
            self._later = np.concatenate([self._later, np.empty_like(self._later)])

    def _drop(self, count: int) -> None:
        kept = slice(count, self._count)
        self._count -= count
        self._samples[: self._count] = self._samples[kept].copy()
        for indices in (self._earlier, self._later):
            moved = indices[kept] - count
            indices[: self._count] = np.where(moved >= 0, moved, NONE)
        self._ends = [row - count for row in self._ends if row >= count]
        for number, trail in list(self._trails.items()):
            trail.rows = [row - count for row in trail.rows if row >= count]
            trail.alike = trail.alike - count if trail.alike >= count else NONE
            if not trail.rows:
                del self._trails[number]
