"""Tracks of moving obstacles: association, filters and the life of each track.

A cluster of points in space that was free begins a track. A track is confirmed when it has moved
and its velocity is larger than what its uncertainty explains; only then it is told to others. A
track that is not seen is predicted for a while if something hides it, and ends soon if the LIDAR
sees through the place. An obstacle that has stood for 2 s is a standing obstacle again: its track
ends.

Sources: detection and tracking as in C.-C. Wang, C. Thorpe, S. Thrun, ICRA 2003, section V; gates,
global nearest neighbours and M of N detections as in S. Blackman, R. Popoli, "Design and Analysis
of Modern Tracking Systems", 1999, sections 6.2 and 6.4; discs and filters as in M. Przybyla, RoMoCo
2017, section III.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Dict, List, Optional, Set

import numpy as np
from numpy.typing import NDArray

from quad_moving.association import GATE, assign
from quad_moving.discs import Outlines, Radius, fit, outlines
from quad_moving.earlier_scans import ENOUGH
from quad_moving.halted_obstacles import BESIDE_M, PATIENCE_S, SPEED_MPS, HaltedObstacles
from quad_moving.kalman import Filters
from quad_moving.moving_points import (
    SLOTS,
    Heights,
    MovingPoints,
    ScanClusters,
    TrackedScan,
    TrackerParams,
)
from quad_nav.config.plugins import Parameters
from quad_nav.costmap.scan_filter import FilteredScan, ScanFilter, ScanSituation
from quad_nav.costmap.tracks import Tracks
from quad_nav.geometry import Pose3D, Scan

Floats = NDArray[np.float64]

_RESTART_S = 1.5  # time in which a walker is confirmed, or else measured from another start
_IN_DOUBT_S = 2.0 * PATIENCE_S  # a track may be in space that was never seen: slivers of walls
_NONE = np.empty((0, 3))


@dataclass
class _Life:
    """What a track is besides its state."""

    number: int
    start: Floats
    start_noise: Floats
    start_s: float
    seen_s: float
    radius: Radius
    bias_m: float
    freed_s: float
    hits: int = 1
    is_confirmed: bool = False
    trail: List[Floats] = field(default_factory=list)


class Tracker(ScanFilter):
    """Scan filter that tracks moving obstacles in the scans of one robot's LIDARs.

    Attributes:
        params: The parameters.
        known: The confirmed tracks, at the time of the last scan; empty ones may be older. The
            method ``tracks`` ends those that are too old.
    """

    params_class = TrackerParams

    def __init__(self, params: Parameters) -> None:
        """Track nothing yet.

        Raises:
            InputError: A parameter is unknown or out of range.
        """
        self.params = params.read(TrackerParams)
        self._number = 0
        self.reset()

    def filter(self, filtered: FilteredScan, situation: ScanSituation) -> FilteredScan:
        """Return the scan with the beams masked that hit moving obstacles."""
        if not situation.is_local:
            return filtered
        tracked = self.add_scan(
            situation.sensor,
            filtered.scan,
            situation.pose,
            situation.heights_m,
            situation.known_circles,
        )
        if tracked is None:
            return filtered
        masked = filtered.masked
        if tracked.any_moving:
            masked = tracked.moving_beams if masked is None else masked | tracked.moving_beams
        return replace(filtered, masked=masked, vacated=tracked.vacated)

    def tracks(self, now_s: float) -> Tracks:
        """Return the confirmed tracks, at the time of the last scan.

        They end by the clock, also if no scan comes.
        """
        self._end_unseen(now_s)
        return self.known

    def reset(self) -> None:
        """Forget tracks and scans, after the clock has jumped."""
        self._points: Dict[str, MovingPoints] = {}
        self._end_all(0.0)

    def _end_all(self, now_s: float) -> None:
        self._lives: List[_Life] = []
        self._filters, self._halted = Filters(), HaltedObstacles()
        self.known = Tracks.none(now_s)

    def _end_unseen(self, now_s: float) -> None:
        """End the tracks that were not seen for too long, though no scan has come since."""
        tracks, lost_s = self.known, self.params.lost_after_s
        silent_s = now_s - tracks.time_s
        kept = tracks.unseen_s + silent_s <= lost_s
        if not kept.all():
            self.known = tracks.chosen(kept)
        if silent_s > lost_s and len(tracks.suspects):
            self.known = replace(self.known, suspects=tracks.suspects[:0])

    def add_scan(
        self,
        sensor: str,
        scan: Scan,
        frame_from_sensor: Pose3D,
        heights_m: Heights = (-math.inf, math.inf),
        known_circles: Floats = _NONE,
    ) -> Optional[TrackedScan]:
        """Take a scan.

        Args:
            sensor: Name of the LIDAR.
            scan: The scan.
            frame_from_sensor: Pose of the LIDAR in the fixed frame at the scan's stamp.
            heights_m: Lowest and greatest height in the fixed frame of points that count.
            known_circles: float64[k, 3], rows x, y, radius in the fixed frame: what is in them is
                known otherwise, as peers are, and is not tracked.

        Returns:
            What the scan shows of moving obstacles, None if nothing moves.
        """
        moving = self._points.get(sensor)
        if moving is None:
            moving = self._points[sensor] = MovingPoints()
        now_s = scan.stamp_s
        is_thorough = bool(self._lives) or len(self._halted) > 0
        clusters = moving.compare(scan, frame_from_sensor, heights_m, self.params, is_thorough)
        if clusters is None:
            if len(self.known):
                self._end_all(now_s)
            return None
        return self._track(now_s, clusters, known_circles)

    def _track(self, now_s: float, clusters: ScanClusters, known_circles: Floats) -> TrackedScan:
        seen = outlines(clusters)
        usable = self._usable(clusters, seen, known_circles)
        self._check_continuity(now_s)
        self._predict(now_s, known_circles)
        pairs = [
            (track, row)
            for track, row in assign(
                self._states, self._filters.covariances, seen, usable, self.params.max_radius_m
            )
            if clusters.rows[row, 2] or now_s - self._lives[track].freed_s <= _IN_DOUBT_S
        ]
        for track, row in pairs:
            self._update(track, row, now_s, clusters, seen)
        self._drop(now_s, {track for track, _ in pairs}, clusters, seen)
        self._begin(now_s, clusters, seen, usable, {row for _, row in pairs})
        result = self._confirm(clusters, seen)
        self._follow_halted(now_s, clusters, seen, known_circles)
        self._tell(now_s)
        return result

    def _check_continuity(self, now_s: float) -> None:
        """End the tracks if no scan came for longer than an obstacle is predicted."""
        step_s = now_s - self._filters.time_s
        if abs(step_s) <= max(self.params.lost_after_s, _RESTART_S):
            return
        self._keep(np.zeros(len(self._lives), bool), now_s)
        if step_s < 0.0:  # the LIDAR's clock was set back
            self._end_all(now_s)

    def _tell(self, now_s: float) -> None:
        """Tell others of the confirmed tracks."""
        told = [k for k, life in enumerate(self._lives) if life.is_confirmed]
        covariances = self._filters.covariances[told]
        biases_m = np.array([self._lives[k].bias_m for k in told], float)
        covariances[:, 0, 0] += biases_m**2
        covariances[:, 1, 1] += biases_m**2
        self.known = Tracks(
            now_s,
            np.array([self._lives[k].number for k in told], np.int64),
            self._states[told],
            covariances,
            np.array([self._lives[k].radius.outer_m for k in told], float),
            np.array([now_s - self._lives[k].seen_s for k in told], float),
            self._suspects(),
        )

    def _suspects(self) -> Floats:
        """Return what may move but has no confirmed track, float64[k, 5]."""
        halted = self._halted.rows
        new = [
            (*state, life.radius.outer_m)
            for state, life in zip(self._states, self._lives)
            if not life.is_confirmed
            and life.hits >= ENOUGH - 1
            and (np.hypot(*(halted[:, :2] - state[:2]).T) > halted[:, 4]).all()
        ]
        return np.concatenate([halted, np.array(new, float).reshape(-1, 5)])

    def _follow_halted(
        self, now_s: float, clusters: ScanClusters, seen: Outlines, known_circles: Floats
    ) -> None:
        """Follow obstacles that have stopped, until they have a track again."""
        self._halted.follow(now_s, clusters, seen, self.params)
        told = [life.is_confirmed and life.seen_s == now_s for life in self._lives]
        radii_m = np.array([life.radius.circle_m for life in self._lives], float)
        tracked = np.column_stack([self._states[told, :2], radii_m[told]])
        others = np.concatenate([tracked, known_circles])
        self._halted.forget(others[:, :2], 0.5 * others[:, 2])
        self._halted.notice(clusters, seen, self.params, others)

    def _usable(
        self, clusters: ScanClusters, seen: Outlines, known_circles: Floats
    ) -> NDArray[np.bool_]:
        """Return which clusters may be obstacles that move, bool[m].

        A cluster with no point in space that was free counts only if both of its edges are in
        sight; otherwise it may be a part of a wall.
        """
        usable = (
            (clusters.rows[:, 3] == 0)
            & (clusters.rows[:, 1] >= ENOUGH)
            & (seen.radii_m <= self.params.max_radius_m)
            & ((clusters.rows[:, 2] > 0) | seen.is_whole)
        )
        for x_m, y_m, radius_m in known_circles:
            usable &= np.hypot(seen.centres[:, 0] - x_m, seen.centres[:, 1] - y_m) > radius_m
        return usable

    def _predict(self, now_s: float, known_circles: Floats) -> None:
        """Predict all tracks up to now; end those of what is known otherwise."""
        self._filters.predict(now_s, self.params.acceleration_mps2)
        for x_m, y_m, radius_m in known_circles:
            away_m = np.hypot(self._states[:, 0] - x_m, self._states[:, 1] - y_m)
            self._keep(away_m > radius_m, now_s)

    @property
    def _states(self) -> Floats:
        return self._filters.states

    def _update(
        self, track: int, row: int, now_s: float, clusters: ScanClusters, seen: Outlines
    ) -> None:
        life = self._lives[track]
        is_whole = bool(seen.is_whole[row])
        life.radius.see(float(seen.radii_m[row]), is_whole)
        guess = seen.centres[row] if is_whole else self._states[track, :2].copy()
        disc = fit(clusters, row, guess, life.radius, is_whole)
        life.radius.hold(disc.farthest_m)
        self._filters.update(track, disc.position, disc.noise)
        life.seen_s, life.bias_m = now_s, disc.bias_m
        if clusters.rows[row, 2]:
            life.freed_s = now_s
        life.hits += 1
        self._remember(life, clusters, row)

    def _remember(self, life: _Life, clusters: ScanClusters, row: int) -> None:
        """Keep the points of a track until it is confirmed."""
        if not life.is_confirmed:
            life.trail.append(clusters.points[clusters.beams(row)])
            del life.trail[:-SLOTS]

    def _drop(
        self, now_s: float, updated: Set[int], clusters: ScanClusters, seen: Outlines
    ) -> None:
        """End the tracks that are lost, and those of obstacles that stand."""
        keep = np.ones(len(self._lives), bool)
        for track, life in enumerate(self._lives):
            if track in updated:
                continue
            unseen_s = now_s - life.seen_s
            if not life.is_confirmed:
                keep[track] = unseen_s <= PATIENCE_S
            elif self._stands(track, clusters, seen):
                keep[track] = False
            elif self._is_seen_through(track, clusters):
                keep[track] = unseen_s <= PATIENCE_S
            else:
                keep[track] = unseen_s <= self.params.lost_after_s
        self._keep(keep, now_s)

    def _is_seen_through(self, track: int, clusters: ScanClusters) -> bool:
        radius_m = self._lives[track].radius.circle_m
        return clusters.sees_through(self._states[track, :2], radius_m, radius_m)

    def _halt(self, track: int, now_s: float) -> None:
        """Follow the obstacle of a track that ends, if it has stopped."""
        life, speed_mps = self._lives[track], math.hypot(*self._states[track, 2:])
        if life.is_confirmed and speed_mps < self.params.min_speed_mps + SPEED_MPS:
            noise = self._filters.covariances[track, :2, :2]
            self._halted.add(self._states[track, :2], noise, life.radius, now_s)

    def _stands(self, track: int, clusters: ScanClusters, seen: Outlines) -> bool:
        """Return whether a track that was not seen has become a standing cluster."""
        x_m, y_m, vx_mps, vy_mps = self._states[track].tolist()
        if math.hypot(vx_mps, vy_mps) > self.params.min_speed_mps:
            return False
        near = np.hypot(seen.centres[:, 0] - x_m, seen.centres[:, 1] - y_m)
        limit_m = self._lives[track].radius.circle_m + BESIDE_M
        return bool(((clusters.rows[:, 3] == 1) & (near < limit_m)).any())

    def _begin(
        self,
        now_s: float,
        clusters: ScanClusters,
        seen: Outlines,
        usable: NDArray[np.bool_],
        taken: Set[int],
    ) -> None:
        """Begin tracks of clusters in space that was free and that belong to no track."""
        freed, beams = clusters.rows[:, 2], clusters.rows[:, 1]
        wanted = usable & (freed >= ENOUGH) & (freed >= 0.5 * beams)
        for row in np.flatnonzero(wanted).tolist():
            if row in taken or self._is_covered(seen.centres[row]):
                continue
            radius = Radius()
            is_whole = bool(seen.is_whole[row])
            radius.see(float(seen.radii_m[row]), is_whole)
            disc = fit(clusters, row, seen.centres[row], radius, is_whole)
            radius.hold(disc.farthest_m)
            self._number += 1
            life = _Life(
                self._number, disc.position, disc.noise, now_s, now_s, radius, disc.bias_m, now_s
            )
            self._remember(life, clusters, row)
            self._lives.append(life)
            self._filters.add(disc.position, disc.noise)

    def _is_covered(self, centre: Floats) -> bool:
        """Return whether a place is in the disc of a track, float64[2]."""
        for state, life in zip(self._states, self._lives):
            if math.hypot(*(centre - state[:2])) < life.radius.outer_m + BESIDE_M:
                return True
        return False

    def _confirm(self, clusters: ScanClusters, seen: Outlines) -> TrackedScan:
        """Confirm tracks that have moved; return the beams on all confirmed ones."""
        vacated: List[Floats] = []
        rows = np.zeros(len(clusters.rows), bool)
        may_move = clusters.rows[:, 3] == 0
        for state, covariance, life in zip(self._states, self._filters.covariances, self._lives):
            if not life.is_confirmed and self._has_moved(state, covariance, life):
                life.is_confirmed = True
                vacated += life.trail
                life.trail = []
            if life.is_confirmed:
                away_m = np.hypot(*(seen.centres - state[:2]).T)
                rows |= may_move & (away_m < life.radius.outer_m + BESIDE_M)
        beams = np.append(rows, False)[clusters.labels]  # label -1 takes the last one
        return TrackedScan(beams, np.concatenate(vacated) if vacated else _NONE)

    def _has_moved(self, state: Floats, covariance: Floats, life: _Life) -> bool:
        """Return whether a track has moved by more than its uncertainty, and is fast enough."""
        passed_s = life.seen_s - life.start_s
        moved = state[:2] - life.start
        moved_m = math.hypot(*moved)
        if life.hits < ENOUGH or moved_m < max(
            self.params.margin_m, self.params.min_speed_mps * passed_s
        ):
            if passed_s > _RESTART_S:
                life.start, life.start_noise = state[:2].copy(), covariance[:2, :2].copy()
                life.start_s = life.seen_s
            return False
        (xx, xy), (_, yy) = (life.start_noise + covariance[:2, :2]).tolist()
        dx, dy = moved.tolist()
        square = (yy * dx * dx - 2.0 * xy * dx * dy + xx * dy * dy) / (xx * yy - xy * xy)
        return bool(square > GATE)

    def _keep(self, keep: NDArray[np.bool_], now_s: float) -> None:
        """Keep some tracks; of the others, follow the obstacles that have stopped."""
        for track in np.flatnonzero(~keep).tolist():
            self._halt(track, now_s)
        if not keep.all():
            self._lives = [life for life, is_kept in zip(self._lives, keep) if is_kept]
            self._filters.keep(keep)
