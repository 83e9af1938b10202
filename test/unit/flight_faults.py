"""Faults of a quadcopter's sensor_faults, between an offline flight's simulation and its navigator."""

from __future__ import annotations

from collections import deque
from dataclasses import replace
from typing import Callable, Optional, Tuple

import numpy as np

from quad_nav.geometry import Pose3D, Scan
from quad_nav.navigator.tick import RobotPoses
from quad_nav.offline.flight import Flight, FlightObserver
from quad_nav.offline.navigator_group import OfflineRobot

Seen = Tuple[Scan, Pose3D]


def with_ranges(scan: Scan, change: Callable[[np.ndarray], None]) -> Scan:
    ranges_m = scan.ranges_m.copy()
    change(ranges_m)
    return replace(scan, ranges_m=ranges_m)


class SenseFault(FlightObserver):
    """Quadcopter 0's sensor_faults from ``begin_s`` to ``end_s``; the base class does no harm.

    ``hover_after_s`` is how long after the fault's begin the last command was sent that was
    not to hover, as far as the fault lasts; ``away_s`` how long after its end it flew again.
    """

    def __init__(self, begin_s: float, end_s: float):
        self.begin_s, self.end_s = begin_s, end_s
        self.hover_after_s = 0.0
        self.away_s: Optional[float] = None
        self._pilot: Optional[OfflineRobot] = None

    def on_start(self, flight: Flight) -> None:
        self._pilot, self._configuration = flight.offline_robots[0], flight.robots[0].configuration
        self._add_scan, self._navigate = self._pilot.add_scan, self._pilot.navigate
        self._pilot.add_scan, self._pilot.navigate = self.add_scan, self.navigate

    def is_on(self, now_s: float) -> bool:
        return self.begin_s <= now_s < self.end_s

    def add_scan(self, scan, map_from_lidar, now_s):
        seen = (
            self.scanned_as(scan, map_from_lidar)
            if self.is_on(now_s)
            else (self.not_scanned_as(scan, map_from_lidar))
        )
        if seen is not None:
            self._add_scan(*seen, now_s)

    def navigate(self, now_s, state, peers):
        if not self.is_on(now_s):
            return self._navigate(now_s, state, peers)
        return self.located_as(now_s, state, peers)

    def scanned_as(self, scan: Scan, map_from_lidar: Pose3D) -> Optional[Seen]:
        return scan, map_from_lidar

    def not_scanned_as(self, scan: Scan, map_from_lidar: Pose3D) -> Optional[Seen]:
        """While all is well."""
        return scan, map_from_lidar

    def located_as(self, now_s, state, peers):
        return self._navigate(now_s, state, peers)

    def on_tick(self, robot, tick, located, wall_s):
        if robot != 0 or tick.command is None or tick.command.is_zero:
            return
        if self.is_on(tick.now_s):
            self.hover_after_s = tick.now_s - self.begin_s
        elif tick.now_s >= self.end_s and self.away_s is None:
            self.away_s = tick.now_s - self.end_s


class NoScans(SenseFault):
    def scanned_as(self, scan, map_from_lidar):
        return None


class _Kept(SenseFault):
    """Knows the scan before the fault."""

    kept: Scan

    def not_scanned_as(self, scan, map_from_lidar):
        self.kept = scan
        self.kept_pose = map_from_lidar
        return scan, map_from_lidar


class FrozenScans(_Kept):
    """The same scan with new stamps: what it shows flies along."""

    def scanned_as(self, scan, map_from_lidar):
        return replace(self.kept, stamp_s=scan.stamp_s), map_from_lidar


class OldScans(_Kept):
    """The same scan with its old stamp."""

    def scanned_as(self, scan, map_from_lidar):
        return self.kept, self.kept_pose


class LateScans(SenseFault):
    """Half a second late: each at its own place."""

    def __init__(self, begin_s, end_s):
        super().__init__(begin_s, end_s)
        self._waiting = deque()

    def scanned_as(self, scan, map_from_lidar):
        self._waiting.append((scan, map_from_lidar))
        if self._waiting[0][0].stamp_s <= scan.stamp_s - 0.5 + 1e-9:
            return self._waiting.popleft()
        return None


class ScansOf(SenseFault):
    """Ranges that are all, or the first half, of one value."""

    def __init__(self, begin_s, end_s, value, first_half=False):
        super().__init__(begin_s, end_s)
        self._value, self._first_half = value, first_half

    def scanned_as(self, scan, map_from_lidar):
        def fill(ranges_m):
            ranges_m[: len(ranges_m) // 2 if self._first_half else None] = self._value

        return with_ranges(scan, fill), map_from_lidar


class NoPose(SenseFault):
    """tf is silent: the pose is unknown once the last one is older than the tolerance."""

    def located_as(self, now_s, state, peers):
        if now_s - self.begin_s <= self._configuration.local_costmap.transform_tolerance_s:
            return self._navigate(now_s, state, peers)
        located = RobotPoses(None, None)
        return self._pilot.navigator.tick(now_s, located, state.twist, peers), located


class ShiftedPose(SenseFault):
    """The odometry says that it is half a metre to the left, in ``map``."""

    BY_M = 0.5

    def _shifted(self, pose: Pose3D) -> Pose3D:
        return replace(pose, y_m=pose.y_m + self.BY_M)

    def scanned_as(self, scan, map_from_lidar):
        return scan, self._shifted(map_from_lidar)

    def located_as(self, now_s, state, peers):
        return self._navigate(
            now_s, replace(state, map_from_base=self._shifted(state.map_from_base)), peers
        )
