"""How near quadcopters came to things and to each other, from poses that come one by one.

Poses are gathered and compared some seconds at a time: one comparison of arrays costs about
as much as one of two numbers.
"""

from __future__ import annotations

import math
from typing import Callable, Dict, List, Optional, Sequence, Tuple

import numpy as np

# Distances in metres from places in ``map``, float64[n, 2], to the nearest surface, float64[n];
# negative inside.
Clearances = Callable[[np.ndarray], np.ndarray]

BLOCK_S = 10.0
LATE_S = 1.0  # how much later than others' a pose may come


class GapLog:
    """Smallest gaps so far, between hulls: discs of ``radius_m`` around the centres.

    Poses of two quadcopters need not have the same stamps: each is compared with where the
    other one was at that time, on the straight line between two of its poses.
    """

    def __init__(
        self, names: Sequence[str], radius_m: float, clearances_m: Optional[Clearances] = None
    ):
        self._radius_m = radius_m
        self._clearances_m = clearances_m
        self._samples: Dict[str, List[Tuple[float, float, float]]] = {name: [] for name in names}
        self._clearance_m = dict.fromkeys(names, math.inf)
        self._separation_m = dict.fromkeys(names, math.inf)
        self._compare_s = -math.inf

    def add(self, name: str, stamp_s: float, x_m: float, y_m: float) -> None:
        """Take where a quadcopter was at a time; stamps of one quadcopter increase."""
        self._samples[name].append((stamp_s, x_m, y_m))
        if stamp_s >= self._compare_s:
            if self._compare_s > -math.inf:
                self._compare()
            self._compare_s = stamp_s + BLOCK_S

    def know(self, name: str, clearance_m: Optional[float], separation_m: Optional[float]) -> None:
        """Take the smallest gaps that another log has seen; None for what it did not know."""
        for gaps, gap_m in ((self._clearance_m, clearance_m), (self._separation_m, separation_m)):
            if gap_m is not None:
                gaps[name] = min(gaps[name], gap_m)

    def so_far_m(self, name: str) -> Tuple[Optional[float], Optional[float]]:
        """To an obstacle and to another quadcopter, but for the last ``BLOCK_S``, for nothing."""
        return _known(self._clearance_m[name]), _known(self._separation_m[name])

    def clearance_m(self, name: str) -> Optional[float]:
        """Smallest gap to an obstacle or a wall; None when none is known."""
        self._compare()
        return _known(self._clearance_m[name])

    def separation_m(self, name: str) -> Optional[float]:
        """Smallest gap to another quadcopter; None when there is none."""
        self._compare()
        return _known(self._separation_m[name])

    def _compare(self) -> None:
        tracks = [(name, np.array(samples)) for name, samples in self._samples.items() if samples]
        for index, (name, track) in enumerate(tracks):
            if self._clearances_m is not None:
                gap_m = float(self._clearances_m(track[:, 1:]).min()) - self._radius_m
                self._clearance_m[name] = min(self._clearance_m[name], gap_m)
            for other, there in tracks[index + 1 :]:
                self._compare_two(name, track, other, there)
        newest_s = max((track[-1, 0] for _, track in tracks), default=0.0)
        for name, track in tracks:
            kept = int(np.searchsorted(track[:, 0], newest_s - LATE_S, side="right"))
            del self._samples[name][: max(kept - 1, 0)]

    def _compare_two(self, name: str, track: np.ndarray, other: str, there: np.ndarray) -> None:
        known_m = max(self._separation_m[name], self._separation_m[other])
        if _boxes_apart_m(track[:, 1:], there[:, 1:]) - 2 * self._radius_m >= known_m:
            return
        gap_m = min(_nearest_m(track, there), _nearest_m(there, track)) - 2 * self._radius_m
        self._separation_m[name] = min(self._separation_m[name], gap_m)
        self._separation_m[other] = min(self._separation_m[other], gap_m)


def _nearest_m(track: np.ndarray, other: np.ndarray) -> float:
    """Smallest distance at the stamps of one track; tracks are (stamp, x, y), float64[n, 3]."""
    stamps_s = track[:, 0]
    x_m, y_m = (
        np.interp(stamps_s, other[:, 0], other[:, column], left=np.inf, right=np.inf)
        for column in (1, 2)
    )
    return float(np.min(np.hypot(track[:, 1] - x_m, track[:, 2] - y_m)))


def _boxes_apart_m(a: np.ndarray, b: np.ndarray) -> float:
    """Distance between the upright rectangles around two sets of places, float64[n, 2]."""
    gaps = np.maximum(a.min(axis=0) - b.max(axis=0), b.min(axis=0) - a.max(axis=0))
    return float(np.hypot(*np.maximum(gaps, 0.0)))


def _known(gap_m: float) -> Optional[float]:
    return gap_m if gap_m < math.inf else None
