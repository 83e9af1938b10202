"""Clearances and separations: distances from hulls to obstacles and between hulls.

A robot's hull is a disc of ``radius_m`` around its centre. Its clearance is the distance from its
hull to the nearest obstacle or wall, its separation the distance from its hull to that of the
nearest other robot. Both are negative if hulls overlap. The flight logs of both shells and the
reports compute them with the functions of this module.
"""

from __future__ import annotations

import math
from typing import Callable, Dict, List, Mapping, Optional, Sequence, Tuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

SurfaceDistance = Callable[[Floats, Floats], Floats]
"""Distance in m from positions in ``map``, float64[..., t, 2], to the nearest surface at their
times, float64[t] in s; float64[..., t], negative inside."""

BLOCK_S = 10.0
"""Poses are compared in blocks of this length: arrays cost about as much as two numbers."""
RECENT_S = 1.0
MAX_DELAY_S = 1.0
"""Largest delay of a robot's poses relative to the other robots."""
_ROUNDING_M = 1e-9


def clearances_m(
    positions_m: Floats, times_s: Floats, surface_distance: SurfaceDistance, radius_m: float
) -> Floats:
    """Return the clearances float64[..., t] of robots.

    Args:
        positions_m: float64[..., t, 2], positions in ``map``.
        times_s: float64[t], their times.
        surface_distance: Distance to the nearest surface.
        radius_m: Radius of each hull.
    """
    return surface_distance(positions_m, times_s) - radius_m


def separations_m(positions_m: Floats, others_m: Floats, radius_m: float) -> Floats:
    """Return the distances float64[...] between the hulls of two robots.

    Args:
        positions_m: float64[..., 2], centres of one robot in ``map``.
        others_m: float64[..., 2], centres of the other robot at the same times.
        radius_m: Radius of each hull.
    """
    offsets = positions_m - others_m
    squares = offsets * offsets
    return np.sqrt(squares[..., 0] + squares[..., 1]) - 2 * radius_m


def nearest_separations_m(positions_m: Floats, radius_m: float) -> Floats:
    """Return each robot's separation from the nearest other robot.

    Args:
        positions_m: float64[n, t, 2], centres of n robots in ``map`` at t times; NaN if unknown.
        radius_m: Radius of each hull.

    Returns:
        float64[n, t]; NaN where no other robot is known.
    """
    nearest = np.full(positions_m.shape[:2], np.nan)
    for a in range(len(nearest)):
        for b in range(a + 1, len(nearest)):
            between_m = separations_m(positions_m[a], positions_m[b], radius_m)
            nearest[a] = np.fmin(nearest[a], between_m)
            nearest[b] = np.fmin(nearest[b], between_m)
    return nearest


def gap_m(smallest_m: Optional[float], touched: bool) -> Optional[float]:
    """Return the smallest distance of a robot, which is 0 after a contact.

    Measured from hulls it may be a little more or less: poses are samples, hulls are discs, and
    bodies yield when they touch.

    Args:
        smallest_m: Smallest distance measured; None if it was not.
        touched: Whether the robot had a contact.
    """
    return 0.0 if touched and smallest_m is not None else smallest_m


class DistanceLog:
    """Smallest clearance and separation of each robot, from poses that arrive one at a time.

    Poses of two robots need not have the same stamps. Each pose is compared with the other
    robot's position at that time, interpolated linearly between two of its poses.
    """

    def __init__(
        self,
        names: Sequence[str],
        radius_m: float,
        surface_distance: Optional[SurfaceDistance] = None,
    ) -> None:
        self._radius_m = radius_m
        self._surface_distance = surface_distance
        self._samples: Dict[str, List[Tuple[float, float, float]]] = {name: [] for name in names}
        self._min_clearance_m = dict.fromkeys(names, math.inf)
        self._min_separation_m = dict.fromkeys(names, math.inf)
        self._next_block_s = -math.inf
        self._is_compared = True
        self._newest_s = self._compared_s = -math.inf

    def add_tracks(self, tracks: Mapping[str, Sequence[Tuple[float, float, float]]]) -> None:
        """Add positions (stamp_s, x_m, y_m) in ``map`` of some robots, one or more of each.

        The stamps of one robot increase.
        """
        for name, track in tracks.items():
            self._samples[name].extend(track)
        self._is_compared = False
        stamp_s = max(track[-1][0] for track in tracks.values())
        self._newest_s = max(self._newest_s, stamp_s)
        if stamp_s >= self._next_block_s:
            if self._next_block_s > -math.inf:
                self._compare()
            self._next_block_s = stamp_s + BLOCK_S

    def restore(
        self, name: str, clearance_m: Optional[float], separation_m: Optional[float]
    ) -> None:
        """Include the minima of an earlier log; None if it had none."""
        for minima, value_m in (
            (self._min_clearance_m, clearance_m),
            (self._min_separation_m, separation_m),
        ):
            if value_m is not None:
                minima[name] = min(minima[name], value_m)

    def recent_minima_m(self, name: str) -> Tuple[Optional[float], Optional[float]]:
        """Return clearance and separation for a journal.

        They may lack the poses of the last `RECENT_S`, so that many calls cost little.
        """
        if self._newest_s - self._compared_s >= RECENT_S:
            self._compare()
        return _finite(self._min_clearance_m[name]), _finite(self._min_separation_m[name])

    def min_clearance_m(self, name: str) -> Optional[float]:
        """Return the smallest clearance; None without a pose or a scene."""
        self._compare()
        return _finite(self._min_clearance_m[name])

    def min_separation_m(self, name: str) -> Optional[float]:
        """Return the smallest separation; None if no other robot has a pose at the same time."""
        self._compare()
        return _finite(self._min_separation_m[name])

    def _compare(self) -> None:
        """Compare all samples, then drop those that later samples do not need."""
        if self._is_compared:
            return
        self._is_compared, self._compared_s = True, self._newest_s
        tracks = [(name, np.array(samples)) for name, samples in self._samples.items() if samples]
        if self._surface_distance is not None:
            for name, track in tracks:
                clearance_m = clearances_m(
                    track[:, 1:], track[:, 0], self._surface_distance, self._radius_m
                )
                self._min_clearance_m[name] = min(
                    self._min_clearance_m[name], float(clearance_m.min())
                )
        for a, b in self._near_pairs(tracks):
            (name, track), (other, other_track) = tracks[a], tracks[b]
            separation_m = _min_separation_m(track, other_track, self._radius_m)
            self._min_separation_m[name] = min(self._min_separation_m[name], separation_m)
            self._min_separation_m[other] = min(self._min_separation_m[other], separation_m)
        newest_s = max((track[-1, 0] for _, track in tracks), default=0.0)
        for name, track in tracks:
            kept = int(np.searchsorted(track[:, 0], newest_s - MAX_DELAY_S, side="right"))
            del self._samples[name][: max(kept - 1, 0)]

    def _near_pairs(self, tracks: Sequence[Tuple[str, Floats]]) -> List[Tuple[int, int]]:
        """Return the pairs that can reduce a minimum, by their tracks' bounding boxes."""
        if len(tracks) < 2:
            return []
        lows = np.array([track[:, 1:].min(axis=0) for _, track in tracks])
        highs = np.array([track[:, 1:].max(axis=0) for _, track in tracks])
        between = np.maximum(lows[:, None] - highs[None], lows[None] - highs[:, None])
        separation_m = np.hypot(*np.moveaxis(np.maximum(between, 0.0), 2, 0)) - 2 * self._radius_m
        minima_m = np.array([self._min_separation_m[name] for name, _ in tracks])
        is_near = separation_m - _ROUNDING_M < np.maximum(minima_m[:, None], minima_m[None])
        return [(int(a), int(b)) for a, b in np.argwhere(np.triu(is_near, 1))]


def _min_separation_m(track: Floats, other: Floats, radius_m: float) -> float:
    """Return the smallest separation of two tracks of (stamp, x, y), float64[k, 3]."""
    if np.array_equal(track[:, 0], other[:, 0]):
        return float(separations_m(track[:, 1:], other[:, 1:], radius_m).min())
    return min(
        float(separations_m(one[:, 1:], _positions_at(one[:, 0], two), radius_m).min())
        for one, two in ((track, other), (other, track))
    )


def _positions_at(stamps_s: Floats, track: Floats) -> Floats:
    """Interpolate a track: float64[k, 2], +inf before its first and after its last stamp."""
    return np.column_stack(
        [
            np.interp(stamps_s, track[:, 0], track[:, column], left=np.inf, right=np.inf)
            for column in (1, 2)
        ]
    )


def _finite(value_m: float) -> Optional[float]:
    return value_m if value_m < math.inf else None
