"""One quadcopter's navigator in the circle: scans, poses and goals in, ticks out."""

from __future__ import annotations

from typing import Dict, List, Optional, Sequence, Tuple

from quad_nav.config import Configuration
from quad_nav.costmap.obstacle import ObstacleLayer
from quad_nav.costmap.scan_validator import ScanValidator
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
        self._sinks = self._sorted_sinks()
        self._rejects_scans = configuration.scan_validator.reject_implausible_scans
        self._trust = ScanValidator(
            layer.buffers[source].params
            for sinks in self._sinks.values()
            for layer, source in sinks
        )

    def _sorted_sinks(self) -> Dict[Tuple, List[Tuple[ObstacleLayer, str]]]:
        """The layers and sources that take scans, by the way in which they see them."""
        sinks: Dict[Tuple, List[Tuple[ObstacleLayer, str]]] = {}
        for costmap in (self.navigator.global_costmap, self.navigator.local_costmap):
            for layer in costmap.layers.values():
                if isinstance(layer, ObstacleLayer):
                    for source in layer.params.sources:
                        way = layer.way_of_seeing(source.name)
                        sinks.setdefault(way, []).append((layer, source.name))
        return sinks

    def see(self, scan: Scan, map_from_lidar: Pose3D, now_s: float) -> None:
        """Takes a scan that comes now, if it can be true."""
        if self._rejects_scans and self._trust.why_not(scan, map_from_lidar, now_s):
            return
        for sinks in self._sinks.values():
            layer, source = sinks[0]
            layer.add_scan(source, scan, map_from_lidar, scan.stamp_s)
            for other, other_source in sinks[1:]:
                other.add_observation(other_source, layer.newest(source), scan.stamp_s)

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
