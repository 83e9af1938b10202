"""Positions of people who react to quadcopters, recorded during a flight."""

from __future__ import annotations

from collections import deque
from typing import Deque, Optional, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.sim.scene import Scene

Floats = NDArray[np.float64]

_LONGEST_GAP_S = 0.5


class CrowdRecord:
    """Positions of people at times that increase.

    Times are those since the motions' start, as those of ``walkers.Crowd``.

    Args:
        count: Number of people.
        kept: Number of positions of each person that are kept, the newest ones; None for all.
    """

    def __init__(self, count: int, kept: Optional[int] = None) -> None:
        self._count = count
        self._samples: Deque[Tuple[float, Floats]] = deque(maxlen=kept)
        self._arrays: Optional[Tuple[Floats, Floats]] = None  # of the samples

    @staticmethod
    def of(scene: Scene, kept: Optional[int] = None) -> Optional[CrowdRecord]:
        """Return an empty record for a scene; None if it has no people who react."""
        if scene.walkers is None or not scene.people_react:
            return None
        return CrowdRecord(scene.walkers.count, kept)

    def add(self, time_s: float, positions_m: Floats) -> None:
        """Add positions in ``map``, float64[n, 2], NaN where unknown.

        They replace those of the same time. A time before the last one begins the record anew: the
        simulation was reset.
        """
        if self._samples and time_s < self._samples[-1][0]:
            self._samples.clear()
        elif self._samples and time_s == self._samples[-1][0]:
            self._samples.pop()
        self._samples.append((time_s, positions_m))
        self._arrays = None

    def poses(self, times_s: Floats) -> Floats:
        """Interpolate the poses float64[t, n, 3] at float64[t]; NaN where they are not known.

        They are not known before the first and after the last time, and within gaps of more than
        half a second.
        """
        poses = np.full((len(times_s), self._count, 3), np.nan)
        if not self._samples:
            return poses
        known_s, positions = self._as_arrays()
        last = len(known_s) - 1
        after = np.searchsorted(known_s, times_s).clip(min(1, last), last)
        before = np.maximum(after - 1, 0)
        gaps_s = known_s[after] - known_s[before]
        inside = (times_s >= known_s[0]) & (times_s <= known_s[-1])
        inside &= (gaps_s <= _LONGEST_GAP_S) | (times_s == known_s[after])
        part = (times_s - known_s[before]) / np.where(gaps_s > 0.0, gaps_s, 1.0)
        steps = positions[after] - positions[before]
        poses[inside, :, :2] = (positions[before] + part[:, None, None] * steps)[inside]
        poses[inside, :, 2] = 0.0
        return poses

    def _as_arrays(self) -> Tuple[Floats, Floats]:
        if self._arrays is None:
            times_s, positions = zip(*self._samples)
            self._arrays = np.array(times_s), np.array(positions)
        return self._arrays
