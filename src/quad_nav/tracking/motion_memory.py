"""Memory of motion: obstacles that move as one did before are predicted to go where it went.

Many things that move do it again and again: shuttles, conveyors, doors, people between the same
doors, the obstacles of benchmarks. The memory keeps the states of all tracks for some minutes. Of
an obstacle that is where another was before, with the same velocity, both now and half a second
ago, it recalls what the other did next. Nothing is known beforehand: it learns in flight.

Source: prediction by the nearest recorded trajectories as in M. Bennewitz, W. Burgard,
G. Cielniak, S. Thrun, "Learning Motion Patterns of People for Compliant Robot Motion", IJRR
24(1), 2005, without their clustering.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Dict, List

import numpy as np
from numpy.typing import NDArray

from quad_nav.kernels.motion_memory import NONE, recall, replay
from quad_nav.tracking.tracks import Tracks

Floats = NDArray[np.float64]

_PERIOD_S = 0.1  # between two samples of a track
_EARLIER = 5  # samples between those that have to be alike
_SCALE_M, _SCALE_MPS = 0.5, 0.5  # differences that count as 1
_BEFORE_S = 5.0
_MAX_ACCELERATION_MPS2 = 2.5
_CAPACITY = 40_000  # samples; 200 s of 20 tracks


@dataclass(frozen=True)
class Recalled:
    """What the memory recalls of one obstacle.

    Attributes:
        moves: float64[t, 2], positions relative to the present one, metres.
        known: Number of the times that the memory covers.
    """

    moves: Floats
    known: int


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
        self._recent: Dict[int, List[int]] = {}

    @property
    def span_s(self) -> float:
        """Time from the first sample to the last one."""
        samples = self._samples[: self._count]
        return float(samples[-1, 0] - samples[0, 0]) if self._count else 0.0

    def add(self, tracks: Tracks) -> None:
        """Remember the states of tracks, at most once in each period."""
        last_s = self._samples[self._count - 1, 0] if self._count else -np.inf
        if tracks.time_s < last_s - _BEFORE_S:
            self.reset()
        elif tracks.time_s < last_s + 0.9 * _PERIOD_S:
            return
        self._reserve(len(tracks))
        recent: Dict[int, List[int]] = {}
        for number, state in zip(tracks.numbers.tolist(), tracks.states):
            row, own = self._count, self._recent.get(number, [])
            self._samples[row, 0], self._samples[row, 1:] = tracks.time_s, state
            self._later[row] = NONE
            self._earlier[row] = own[-_EARLIER] if len(own) >= _EARLIER else NONE
            if own:
                self._later[own[-1]] = row
            recent[number] = [*own[-_EARLIER:], row]
            self._count += 1
        self._recent = recent

    def acceleration(self, number: int) -> Floats:
        """Return how the velocity of a track changes, float64[2] in m/s^2, over half a second.

        It is zero for a track that is younger, and no more than ``_MAX_ACCELERATION_MPS2``.
        """
        rows = self._recent.get(number)
        if not rows or self._earlier[rows[-1]] == NONE:
            return np.zeros(2)
        now, earlier = self._samples[rows[-1]], self._samples[self._earlier[rows[-1]]]
        change: Floats = (now[3:] - earlier[3:]) / (now[0] - earlier[0])
        return change * min(1.0, _MAX_ACCELERATION_MPS2 / max(float(np.hypot(*change)), 1e-9))

    def recall(self, number: int, times_s: Floats) -> Recalled:
        """Return where an obstacle that moved like a track did went next.

        Args:
            number: Number of the track, in the last tracks that were added.
            times_s: float64[t], times after the last ones, increasing from 0.
        """
        moves = np.zeros((len(times_s), 2))
        rows = self._recent.get(number)
        if not rows:
            return Recalled(moves, 0)
        samples = self._samples[: self._count]
        alike = recall(samples, self._earlier, rows[-1], (_SCALE_M, _SCALE_MPS), _BEFORE_S)
        if alike == NONE:
            return Recalled(moves, 0)
        return Recalled(moves, replay(samples, self._later, alike, times_s, moves))

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
        self._recent = {
            number: [row - count for row in rows if row >= count]
            for number, rows in self._recent.items()
        }
