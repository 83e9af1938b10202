"""Halted obstacles: those that have come and stopped.

An obstacle that stands for two seconds has no track any more, and one that then creeps is too slow
for another. It may walk on at any time, so passive safety counts it: those whose track ends while
they are slow, and those that stand where an earlier scan saw free space. The disc of each follows
the points in its place, whether they stand or move, until the LIDAR sees through the place, or a
track is there. It stays where it was last seen while something hides it.
"""

from __future__ import annotations

from typing import List

import numpy as np
from numpy.typing import NDArray

from quad_moving.discs import Outlines, Radius, fit, fit_points
from quad_moving.earlier_scans import ENOUGH
from quad_moving.kalman import Filters
from quad_moving.moving_points import SLOTS, SPACING_S, ScanClusters, TrackerParams

Floats = NDArray[np.float64]

SPEED_MPS = 0.1
"""Standard deviation of each component of the velocity of an obstacle that has stopped."""
BESIDE_M = 0.15
"""Points of an obstacle are no farther from its disc: half of a person's step."""
PATIENCE_S = 0.3
"""A few scans without a sign of an obstacle where it should be seen: it is not there."""
_HIDDEN_S = SPACING_S * SLOTS  # as long as the places of earlier scans are remembered


class HaltedObstacles:
    """Obstacles that have stopped, followed from scan to scan."""

    def __init__(self) -> None:
        """Follow none."""
        self._filters = Filters()
        self._radii: List[Radius] = []
        self._seen_s: List[float] = []

    def __len__(self) -> int:
        return len(self._radii)

    @property
    def rows(self) -> Floats:
        """The obstacles as ``Tracks.suspects`` has them, float64[k, 5]."""
        return np.column_stack([self._filters.states, [one.outer_m for one in self._radii]])

    def add(self, place: Floats, noise: Floats, radius: Radius, now_s: float) -> None:
        """Follow one more, at a place, float64[2], with its covariance, float64[2, 2]."""
        self._filters.add(place, noise, SPEED_MPS)
        self._radii.append(radius)
        self._seen_s.append(now_s)

    def follow(
        self, now_s: float, clusters: ScanClusters, seen: Outlines, params: TrackerParams
    ) -> None:
        """Move the discs to where a scan shows them; forget who is gone."""
        self._filters.predict(now_s, params.acceleration_mps2)
        if not len(self):
            return
        is_small = np.append(seen.radii_m <= params.max_radius_m, False)[clusters.labels]
        for row in range(len(self)):
            self._see(row, clusters, is_small)
        self._keep(np.array([not self._is_gone(row, clusters) for row in range(len(self))]))

    def notice(
        self, clusters: ScanClusters, seen: Outlines, params: TrackerParams, others: Floats
    ) -> None:
        """Follow what has come and stopped though it had no track of its own, as in a crowd.

        Args:
            clusters: Clusters of a scan.
            seen: Their outlines.
            params: The parameters.
            others: float64[k, 3], x, y and radius of what is known otherwise.
        """
        for row in np.flatnonzero(clusters.arrived & (seen.radii_m <= params.max_radius_m)):
            known = np.concatenate([others, self.rows[:, [0, 1, 4]]])
            away_m = np.hypot(*(known[:, :2] - seen.centres[row]).T)
            if (away_m < known[:, 2] + BESIDE_M).any():
                continue
            radius, is_whole = Radius(), bool(seen.is_whole[row])
            radius.see(float(seen.radii_m[row]), is_whole)
            disc = fit(clusters, int(row), seen.centres[row], radius, is_whole)
            self.add(disc.position, disc.noise, radius, self._filters.time_s)

    def forget(self, places: Floats, radii_m: Floats) -> None:
        """Forget those in discs, float64[n, 2] and float64[n], that are known otherwise."""
        for place, radius_m in zip(places, radii_m):
            if len(self):
                self._keep(np.hypot(*(self._filters.states[:, :2] - place).T) > radius_m)

    def _see(self, row: int, clusters: ScanClusters, is_small: NDArray[np.bool_]) -> None:
        place, radius = self._filters.states[row, :2], self._radii[row]
        away_m = np.hypot(*(clusters.points[:, :2] - place).T)
        beams = is_small & (away_m < radius.outer_m + BESIDE_M)
        if beams.sum() >= ENOUGH:
            disc = fit_points(clusters, beams, place.copy(), radius)
            self._filters.update(row, disc.position, disc.noise)
            self._seen_s[row] = self._filters.time_s
        else:
            self._filters.states[row, 2:] = 0.0

    def _is_gone(self, row: int, clusters: ScanClusters) -> bool:
        place, circle_m = self._filters.states[row, :2], self._radii[row].circle_m
        unseen_s = self._filters.time_s - self._seen_s[row]
        is_through = unseen_s > PATIENCE_S and clusters.sees_through(place, circle_m, 0.0)
        return is_through or unseen_s > _HIDDEN_S

    def _keep(self, kept: NDArray[np.bool_]) -> None:
        if not kept.all():
            self._filters.keep(kept)
            self._radii = [one for one, is_kept in zip(self._radii, kept) if is_kept]
            self._seen_s = [one for one, is_kept in zip(self._seen_s, kept) if is_kept]
