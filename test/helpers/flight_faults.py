"""Sensor faults, injected between an offline flight's simulation and its navigator."""

from __future__ import annotations

from collections import deque
from dataclasses import replace
from typing import Optional

from quad_nav.geometry import Pose3D, Scan
from quad_nav.loop.navigator_group import LocatedScan, LoopRobot
from quad_nav.navigator.tick import RobotPoses
from quad_nav.offline.flight import Flight, FlightObserver


class SensorFault(FlightObserver):
    """A fault of robot 0 from ``begin_s`` to ``end_s``; the base class changes nothing.

    ``hover_after_s``: time from the fault's begin to the last command during the fault that was
    not zero. ``resume_after_s``: time from the fault's end to the next such command.
    """

    def __init__(self, begin_s: float, end_s: float):
        self.begin_s, self.end_s = begin_s, end_s
        self.hover_after_s = 0.0
        self.resume_after_s: Optional[float] = None
        self._robot: Optional[LoopRobot] = None

    def on_start(self, flight: Flight) -> None:
        self._robot, self._configuration = flight.offline_robots[0], flight.robots[0].configuration
        self._add_scan, self._navigate = self._robot.add_scan, self._robot.navigate
        self._robot.add_scan, self._robot.navigate = self.add_scan, self.navigate

    def is_on(self, now_s: float) -> bool:
        return self.begin_s <= now_s < self.end_s

    def add_scan(self, scan, map_from_lidar, now_s):
        if self.is_on(now_s):
            located_scan = self.faulty_scan(scan, map_from_lidar)
        else:
            located_scan = self.last_healthy = scan, map_from_lidar
        if located_scan is not None:
            self._add_scan(*located_scan, now_s)

    def navigate(self, now_s, state, peers):
        if not self.is_on(now_s):
            return self._navigate(now_s, state, peers)
        return self.faulty_tick(now_s, state, peers)

    def faulty_scan(self, scan: Scan, map_from_lidar: Pose3D) -> Optional[LocatedScan]:
        return scan, map_from_lidar

    def faulty_tick(self, now_s, state, peers):
        return self._navigate(now_s, state, peers)

    def on_tick(self, robot, tick, located, wall_s):
        if robot != 0 or tick.command is None or tick.command.is_zero:
            return
        if self.is_on(tick.now_s):
            self.hover_after_s = tick.now_s - self.begin_s
        elif tick.now_s >= self.end_s and self.resume_after_s is None:
            self.resume_after_s = tick.now_s - self.end_s


class NoScans(SensorFault):
    def faulty_scan(self, scan, map_from_lidar):
        return None


class FrozenScans(SensorFault):
    """The last scan with new stamps: its obstacles move with the robot."""

    def faulty_scan(self, scan, map_from_lidar):
        return replace(self.last_healthy[0], stamp_s=scan.stamp_s), map_from_lidar


class OldScans(SensorFault):
    """The last scan with its old stamp."""

    def faulty_scan(self, scan, map_from_lidar):
        return self.last_healthy


class LateScans(SensorFault):
    """Scans half a second late, each with the pose at its stamp."""

    def __init__(self, begin_s, end_s):
        super().__init__(begin_s, end_s)
        self._waiting = deque()

    def faulty_scan(self, scan, map_from_lidar):
        self._waiting.append((scan, map_from_lidar))
        if self._waiting[0][0].stamp_s <= scan.stamp_s - 0.5 + 1e-9:
            return self._waiting.popleft()
        return None


class ScansOf(SensorFault):
    """Scans with one value in all ranges, or in the first half of them."""

    def __init__(self, begin_s, end_s, value, first_half=False):
        super().__init__(begin_s, end_s)
        self._value, self._first_half = value, first_half

    def faulty_scan(self, scan, map_from_lidar):
        ranges_m = scan.ranges_m.copy()
        ranges_m[: len(ranges_m) // 2 if self._first_half else None] = self._value
        return replace(scan, ranges_m=ranges_m), map_from_lidar


class NoPose(SensorFault):
    """No tf: the pose is unknown when the last one is older than the tolerance."""

    def faulty_tick(self, now_s, state, peers):
        if now_s - self.begin_s <= self._configuration.local_costmap.transform_tolerance_s:
            return self._navigate(now_s, state, peers)
        located = RobotPoses(None, None)
        return self._robot.tick(now_s, located, state.twist, peers), located


class ShiftedPose(SensorFault):
    """The odometry is off by half a metre in y of ``map``."""

    BY_M = 0.5

    def _shifted(self, pose: Pose3D) -> Pose3D:
        return replace(pose, y_m=pose.y_m + self.BY_M)

    def faulty_scan(self, scan, map_from_lidar):
        return scan, self._shifted(map_from_lidar)

    def faulty_tick(self, now_s, state, peers):
        return self._navigate(
            now_s, replace(state, map_from_base=self._shifted(state.map_from_base)), peers
        )
