"""The LIDARs and navigators that share a process: what they see, and what is due to them.

Those of a flight are one crew, or several in as many processes: navigators know of
each other what peers tell, and nothing that was told in the same instant.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Dict, List, Mapping, Sequence, Tuple

import numpy as np

from quad_nav.geometry import Pose2D, Pose3D, Scan
from quad_nav.navigator.tick import RobotPoses, Tick
from quad_nav.offline.offline_robot import OfflineRobot
from quad_nav.peers.peer import Intention, Peer, peer_at
from quad_nav.scenario.flight_setup import FlightSetup
from quad_nav.scenario.scene_map import SceneMaps
from quad_nav.sim.lidar import base_from_lidar
from quad_nav.sim.lidars import Lidars
from quad_nav.sim.simulation import RobotStates

Seen = Tuple[Scan, Pose3D]  # and where the LIDAR was, in ``map``


@dataclass(frozen=True)
class Navigated:
    """What a navigator has done; ``goal_waits`` when it has not taken the last goal yet."""

    robot: int
    tick: Tick
    located: RobotPoses
    wall_s: float
    goal_waits: bool
    intention: Intention


class NavigatorGroup:
    """Those of some of a setup's quadcopters, by their numbers; ``lidars`` are everybody's."""

    def __init__(self, setup: FlightSetup, robots: Sequence[int], lidars: Lidars):
        self.pilots = {robot: OfflineRobot(setup.configurations[robot], robot) for robot in robots}
        self._lidars = lidars
        self._names = [goals.name for goals in setup.robots]
        self._intentions = [Intention()] * len(setup.robots)
        for robot, pilot in self.pilots.items():
            self._intentions[robot] = pilot.navigator.intention
        maps = SceneMaps(setup.scene)
        for pilot in self.pilots.values():
            maps.give_to(pilot.navigator.global_costmap)
            maps.give_to(pilot.navigator.local_costmap)

    def scan(self, now_s: float, states: RobotStates) -> Dict[int, Seen]:
        """Lets the LIDARs turn once and the navigators see that."""
        seen = {}
        for robot, scan in zip(
            self.pilots, self._lidars.scan(states.bodies, list(self.pilots), now_s)
        ):
            map_from_lidar = states[robot].map_from_base.compose(base_from_lidar)
            self.pilots[robot].see(scan, map_from_lidar, now_s)
            seen[robot] = (scan, map_from_lidar)
        return seen

    def navigate(
        self,
        now_s: float,
        states: RobotStates,
        goals: Mapping[int, Pose2D],
        news: Mapping[int, Intention],
    ) -> List[Navigated]:
        """Does what is due, after new goals for own quadcopters and news of others."""
        for robot, goal in goals.items():
            self.pilots[robot].waiting_goal = goal
        for robot, intention in news.items():
            self._intentions[robot] = intention
        due = [robot for robot, pilot in self.pilots.items() if pilot.is_due(now_s)]
        peers = self._peers_near(due, now_s, states)
        done = [self._navigate(robot, now_s, states, peers[robot]) for robot in due]
        for navigated in done:
            self._intentions[navigated.robot] = navigated.intention
        return done

    def _navigate(
        self, robot: int, now_s: float, states: RobotStates, peers: Sequence[Peer]
    ) -> Navigated:
        pilot = self.pilots[robot]
        start_s = time.perf_counter()
        tick, located = pilot.navigate(now_s, states[robot], peers)
        return Navigated(
            robot,
            tick,
            located,
            time.perf_counter() - start_s,
            pilot.waiting_goal is not None,
            pilot.navigator.intention,
        )

    def _peers_near(
        self, robots: Sequence[int], now_s: float, states: RobotStates
    ) -> Dict[int, List[Peer]]:
        """For each of some quadcopters the others that it may have to do with."""
        if len(self._names) == 1:
            return {robot: [] for robot in robots}
        positions = states.bodies.positions_m[:, :2]
        near: Dict[int, List[int]] = {}
        for robot in robots:
            distance_m = np.hypot(*(positions - positions[robot]).T)
            distance_m[robot] = np.inf
            near[robot] = np.flatnonzero(
                distance_m < self.pilots[robot].navigator.peer_reach_m
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
