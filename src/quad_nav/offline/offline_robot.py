"""One quadcopter's navigator in the circle: scans, poses and goals in, ticks out."""

from __future__ import annotations

from typing import Optional, Sequence, Tuple

from quad_nav.config import Configuration
from quad_nav.costmap.scan_intake import ScanIntake, SensorPose, sinks_of
from quad_nav.geometry import Pose2D, Pose3D, Scan
from quad_nav.navigator.tick import RobotPoses, Tick
from quad_nav.peers.peer import Peer
from quad_nav.scenario.assembly import build_navigator
from quad_nav.sim.simulation import RobotState


class OfflineRobot:
    """``waiting_goal`` is one that was sent and that the navigator has not taken yet."""

    def __init__(self, configuration: Configuration, number: int):
        self.navigator = build_navigator(configuration, number)
        self.waiting_goal: Optional[Pose2D] = None
        costmaps = (self.navigator.global_costmap, self.navigator.local_costmap)
        self._intake = ScanIntake(sinks_of(costmaps), configuration.scan_validator)

    def add_scan(self, scan: Scan, map_from_lidar: Pose3D, now_s: float) -> None:
        """Hand a scan that arrives now to the costmaps, unless it is implausible."""
        poses = [SensorPose(map_from_lidar, map_from_lidar)] * len(self._intake.sinks)
        self._intake.add_scan(scan, poses, scan.stamp_s, now_s)

    def is_due(self, now_s: float) -> bool:
        """Whether the navigator has something to do; a goal that waits is set if it can be."""
        navigator = self.navigator
        if self.waiting_goal is not None and navigator.accepts_goal(now_s):
            navigator.set_goal(self.waiting_goal, now_s)
            self.waiting_goal = None
        return navigator.next_due_s <= now_s + 1e-9 or navigator.has_work

    def navigate(
        self, now_s: float, state: RobotState, peers: Sequence[Peer]
    ) -> Tuple[Tick, RobotPoses]:
        """Does what is due."""
        pose = state.map_from_base.to_2d()
        located = RobotPoses(pose, pose)
        return self.navigator.tick(now_s, located, state.twist, peers), located
