"""A navigator group: the LIDARs and navigators of the robots that share a process.

The robots of a flight are one group, or several in as many processes. A navigator knows of
its peers what they publish, and nothing that they publish in the same instant, so that the
division into groups does not change the flight.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Dict, List, Mapping, Optional, Sequence, Tuple

import numpy as np

from quad_nav.config import Configuration
from quad_nav.costmap.scan_intake import ScanIntake, SensorPose, sinks_of
from quad_nav.geometry import Pose2D, Pose3D, Scan
from quad_nav.navigator.tick import RobotPoses, Tick
from quad_nav.peers.peer import Intention, Peer, peer_at
from quad_nav.scenario.assembly import build_navigator
from quad_nav.scenario.flight_setup import FlightSetup
from quad_nav.scenario.scene_map import SceneMaps
from quad_nav.sim.casters import Lidars
from quad_nav.sim.lidar import base_from_lidar
from quad_nav.sim.simulation import RobotState, RobotStates

LocatedScan = Tuple[Scan, Pose3D]
"""A scan and ``map_from_lidar``, the LIDAR's pose at its stamp."""


@dataclass(frozen=True)
class NavigatorResult:
    """The result of one navigator's tick.

    ``goal_waits`` while the navigator has not taken the last goal that was sent. ``wall_s`` is
    the tick's wall time.
    """

    robot: int
    tick: Tick
    located: RobotPoses
    wall_s: float
    goal_waits: bool
    intention: Intention


class OfflineRobot:
    """One robot's navigator in the loop: scans, poses and goals in, ticks out.

    Attributes:
        navigator: The navigator.
        waiting_goal: The last goal that was sent, until the navigator takes it.
    """

    def __init__(self, configuration: Configuration, number: int) -> None:
        """Build the navigator of robot ``number``."""
        self.navigator = build_navigator(configuration, number)
        self.waiting_goal: Optional[Pose2D] = None
        costmaps = (self.navigator.global_costmap, self.navigator.local_costmap)
        self._intake = ScanIntake(sinks_of(costmaps), configuration.scan_validator)

    def add_scan(self, scan: Scan, map_from_lidar: Pose3D, now_s: float) -> None:
        """Hand a scan that arrives now to the costmaps, unless it is implausible."""
        poses = [SensorPose(map_from_lidar, map_from_lidar)] * len(self._intake.sinks)
        self._intake.add_scan(scan, poses, scan.stamp_s, now_s)

    def is_due(self, now_s: float) -> bool:
        """Set the waiting goal if the navigator accepts it; return True if a tick is due."""
        navigator = self.navigator
        if self.waiting_goal is not None and navigator.accepts_goal(now_s):
            navigator.set_goal(self.waiting_goal, now_s)
            self.waiting_goal = None
        return navigator.next_due_s <= now_s + 1e-9 or navigator.has_work

    def navigate(
        self, now_s: float, state: RobotState, peers: Sequence[Peer]
    ) -> Tuple[Tick, RobotPoses]:
        """Tick the navigator; also return the poses that it was given."""
        pose = state.map_from_base.to_2d()
        located = RobotPoses(pose, pose)
        return self.navigator.tick(now_s, located, state.twist, peers), located


class NavigatorGroup:
    """The LIDARs and navigators of some of a set-up's robots.

    Attributes:
        robots: The group's robots, by number.
    """

    def __init__(self, setup: FlightSetup, robots: Sequence[int], lidars: Lidars) -> None:
        """Build the navigators of ``robots``; ``lidars`` are those of all robots."""
        self.robots = {robot: OfflineRobot(setup.configurations[robot], robot) for robot in robots}
        self._lidars = lidars
        self._names = [goals.name for goals in setup.robots]
        self._intentions = [Intention()] * len(setup.robots)
        for number, robot in self.robots.items():
            self._intentions[number] = robot.navigator.peers.intention
        maps = SceneMaps(setup.scene)
        for robot in self.robots.values():
            maps.set_map_of(robot.navigator.global_costmap)
            maps.set_map_of(robot.navigator.local_costmap)

    def scan(self, now_s: float, states: RobotStates) -> Dict[int, LocatedScan]:
        """Take a scan with each LIDAR and pass it to the robot's navigator.

        Returns:
            The scans, by the robots' numbers.
        """
        scans = {}
        numbers = list(self.robots)
        for number, scan in zip(numbers, self._lidars.scan(states.bodies, numbers, now_s)):
            map_from_lidar = states[number].map_from_base.compose(base_from_lidar)
            self.robots[number].add_scan(scan, map_from_lidar, now_s)
            scans[number] = (scan, map_from_lidar)
        return scans

    def navigate(
        self,
        now_s: float,
        states: RobotStates,
        goals: Mapping[int, Pose2D],
        updates: Mapping[int, Intention],
    ) -> List[NavigatorResult]:
        """Tick the navigators that are due.

        Args:
            now_s: Simulated time.
            states: States of all robots.
            goals: New goals of robots of this group, by number.
            updates: Intentions of all robots that have changed, by number.
        """
        for number, goal in goals.items():
            self.robots[number].waiting_goal = goal
        for number, intention in updates.items():
            self._intentions[number] = intention
        due = [number for number, robot in self.robots.items() if robot.is_due(now_s)]
        peers = self._peers_in_reach(due, now_s, states)
        results = [self._navigate(number, now_s, states, peers[number]) for number in due]
        for result in results:
            self._intentions[result.robot] = result.intention
        return results

    def _navigate(
        self, number: int, now_s: float, states: RobotStates, peers: Sequence[Peer]
    ) -> NavigatorResult:
        robot = self.robots[number]
        start_s = time.perf_counter()
        tick, located = robot.navigate(now_s, states[number], peers)
        return NavigatorResult(
            number,
            tick,
            located,
            time.perf_counter() - start_s,
            robot.waiting_goal is not None,
            robot.navigator.peers.intention,
        )

    def _peers_in_reach(
        self, robots: Sequence[int], now_s: float, states: RobotStates
    ) -> Dict[int, List[Peer]]:
        """The peers within each robot's ``peers.reach_m``, by the robots' numbers."""
        if len(self._names) == 1:
            return {robot: [] for robot in robots}
        positions = states.bodies.positions_m[:, :2]
        near: Dict[int, List[int]] = {}
        for robot in robots:
            distance_m = np.hypot(*(positions - positions[robot]).T)
            distance_m[robot] = np.inf
            near[robot] = np.flatnonzero(
                distance_m < self.robots[robot].navigator.peers.reach_m
            ).tolist()
        peers = {
            robot: self._as_peer(robot, now_s, states) for robot in set().union(*near.values())
        }
        return {robot: [peers[other] for other in others] for robot, others in near.items()}

    def _as_peer(self, robot: int, now_s: float, states: RobotStates) -> Peer:
        state = states[robot]
        return peer_at(
            self._names[robot],
            state.map_from_base.to_2d(),
            state.twist,
            now_s,
            self._intentions[robot],
        )
