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
from quad_nav.costmap.layered import LayeredCostmap
from quad_nav.costmap.scan_intake import ScanIntake, SensorPose, sinks_of
from quad_nav.geometry import Pose2D, Pose3D, Scan
from quad_nav.navigator.tick import RobotPoses, Tick
from quad_nav.peers.peer import Intention, Peer, peer_at
from quad_nav.scenario.assembly import build_navigator
from quad_nav.scenario.flight_setup import FlightSetup
from quad_nav.scenario.scene_map import SceneMaps
from quad_nav.sim.casters import Lidars
from quad_nav.sim.lidar import base_from_lidar
from quad_nav.sim.odometry import OdomFrames, pose_in
from quad_nav.sim.simulation import RobotState, RobotStates

LocatedScan = Tuple[Scan, Pose3D]
"""A scan and ``map_from_lidar``, the LIDAR's pose at its stamp."""
_IDENTITY = Pose2D(0.0, 0.0)


@dataclass(frozen=True)
class NavigatorResult:
    """The result of one navigator's tick.

    ``goal_waits`` while the navigator has not taken the last goal that was sent. ``wall_s`` is
    the tick's wall time. ``intention`` is in ``map``.
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
        waiting_goal: The last goal that was sent, in ``map``, until the navigator takes it.
    """

    def __init__(self, configuration: Configuration, number: int, frames: OdomFrames) -> None:
        """Build the navigator of robot ``number``, which knows poses in the frames' places."""
        self.navigator = build_navigator(configuration, number)
        self.waiting_goal: Optional[Pose2D] = None
        self._number, self._frames = number, frames
        costmaps = (self.navigator.global_costmap, self.navigator.local_costmap)
        self._intake = ScanIntake(sinks_of(costmaps), configuration.scan_validator)

    def add_scan(self, scan: Scan, map_from_lidar: Pose3D, now_s: float) -> None:
        """Hand a scan that arrives now to the costmaps, unless it is implausible."""
        at = {
            frame: SensorPose(pose, pose)
            for frame, pose in self._in_costmaps(map_from_lidar, now_s).items()
        }
        poses = [at[sink.costmap.params.global_frame] for sink in self._intake.sinks]
        self._intake.add_scan(scan, poses, scan.stamp_s, now_s)

    def is_due(self, now_s: float) -> bool:
        """Set the waiting goal if the navigator accepts it; return True if a tick is due."""
        navigator = self.navigator
        if self.waiting_goal is not None and navigator.accepts_goal(now_s):
            goal, map_from_global = self.waiting_goal, self.map_from_global(now_s)
            if map_from_global != _IDENTITY:
                goal = goal.relative_to(map_from_global)
            navigator.set_goal(goal, now_s)
            self.waiting_goal = None
        return navigator.next_due_s <= now_s + 1e-9 or navigator.has_work

    def navigate(
        self, now_s: float, state: RobotState, peers: Sequence[Peer]
    ) -> Tuple[Tick, RobotPoses]:
        """Tick the navigator; also return the poses that it was given.

        Args:
            now_s: Simulated time.
            state: State of the robot.
            peers: The other robots, in ``map``.
        """
        costmaps = (self.navigator.global_costmap, self.navigator.local_costmap)
        for costmap in costmaps:
            if costmap.map_frames:
                costmap.set_map_poses(self._map_poses(costmap, now_s))
        poses = self._in_costmaps(state.map_from_base, now_s)
        in_global, in_local = (poses[one.params.global_frame].to_2d() for one in costmaps)
        located = RobotPoses(in_global, in_local)
        map_from_global = self.map_from_global(now_s)
        if map_from_global != _IDENTITY:
            peers = [peer.relative_to(map_from_global) for peer in peers]
        return self.navigator.tick(now_s, located, state.twist, peers), located

    def intention(self, now_s: float) -> Intention:
        """Return the navigator's intention in ``map``."""
        intention, map_from_global = self.navigator.peers.intention, self.map_from_global(now_s)
        if map_from_global == _IDENTITY:
            return intention
        return intention.transformed(map_from_global)

    def map_from_global(self, now_s: float) -> Pose2D:
        """Return the pose of the global costmap's frame in ``map``."""
        frame = self.navigator.global_costmap.params.global_frame
        return self._frames.map_from_frame(frame, self._number, now_s)

    def _map_poses(self, costmap: LayeredCostmap, now_s: float) -> Dict[str, Optional[Pose3D]]:
        """Return the pose of a costmap's frame in the frames of its maps, which are ``map``."""
        frame = costmap.params.global_frame
        pose = self._frames.map_from_frame(frame, self._number, now_s).to_3d()
        return dict.fromkeys(costmap.map_frames, pose)

    def _in_costmaps(self, map_from_pose: Pose3D, now_s: float) -> Dict[str, Pose3D]:
        """Express a pose in ``map`` in the frames of the costmaps, by their names."""
        costmaps = (self.navigator.global_costmap, self.navigator.local_costmap)
        return {
            frame: pose_in(self._frames.map_from_frame(frame, self._number, now_s), map_from_pose)
            for frame in dict.fromkeys(costmap.params.global_frame for costmap in costmaps)
        }


class NavigatorGroup:
    """The LIDARs and navigators of some of a set-up's robots.

    Attributes:
        robots: The group's robots, by number.
    """

    def __init__(self, setup: FlightSetup, robots: Sequence[int], lidars: Lidars) -> None:
        """Build the navigators of ``robots``; ``lidars`` are those of all robots."""
        frames = OdomFrames(setup.simulation.odom_drift, len(setup.robots), setup.seed)
        self.robots = {
            robot: OfflineRobot(setup.configurations[robot], robot, frames) for robot in robots
        }
        self._lidars = lidars
        self._names = [goals.name for goals in setup.robots]
        self._intentions = [Intention()] * len(setup.robots)
        for number, robot in self.robots.items():
            self._intentions[number] = robot.intention(0.0)
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
            goals: New goals in ``map`` of robots of this group, by number.
            updates: Intentions in ``map`` of all robots that have changed, by number.
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
            robot.intention(now_s),
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
