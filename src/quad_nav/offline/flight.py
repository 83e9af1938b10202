"""The circle scan -> costmap -> plan -> velocity -> body -> scan in one process.

Time goes in the simulation's steps of 1/240 s. Scans are taken and delivered at
their own steps; every 1/40 s there is odometry, the sequencers look at it, and the
navigators do what is due. This is what the nodes do on ROS, less the transport.
Equal setups give equal flights, bit for bit.
"""
from __future__ import annotations

import time
from typing import Dict, List, Optional, Sequence, Tuple

import numpy as np

from quad_nav.assembly import build_navigator
from quad_nav.config import Configuration
from quad_nav.costmap.obstacle import ObstacleLayer
from quad_nav.costmap.trust import ScanTrust
from quad_nav.geometry import Pose2D, Pose3D, Scan
from quad_nav.mission.flight_log import RobotLog
from quad_nav.mission.robot_goals import RobotGoals
from quad_nav.mission.sequencer import (
    Action,
    NavigatorReport,
    SendGoal,
    Sequencer,
    Verdict,
)
from quad_nav.offline.observer import FlightObserver
from quad_nav.offline.scene_map import SceneMaps
from quad_nav.offline.setup import FlightSetup
from quad_nav.peers import Peer, peer_at
from quad_nav.sim.contacts import Contact
from quad_nav.sim.lidar import base_from_lidar
from quad_nav.sim.simulation import STEPS_PER_S, RobotState, Simulation
from quad_nav.tick import Located, State, Tick

STEPS_PER_ODOMETRY = STEPS_PER_S // 40


class FlightRobot:
    """One quadcopter's navigator and sequencer, and what passes between them."""

    def __init__(self, goals: RobotGoals, configuration: Configuration, number: int):
        self.name = goals.name
        self.configuration = configuration
        self.navigator = build_navigator(configuration, number)
        self.sequencer = Sequencer(goals.sequence)
        self.log = RobotLog(goals.name)
        self.waiting_goal: Optional[Pose2D] = None
        self._reports: List[NavigatorReport] = []
        self._sinks = self._sorted_sinks()
        self._trust = ScanTrust(layer.buffers[source].params for sinks in self._sinks.values()
                                for layer, source in sinks)

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
        if self.navigator.mends.doubt_scans and self._trust.why_not(scan, map_from_lidar, now_s):
            return
        for sinks in self._sinks.values():
            layer, source = sinks[0]
            layer.add_scan(source, scan, map_from_lidar, scan.stamp_s)
            for other, other_source in sinks[1:]:
                other.add_observation(other_source, layer.newest(source), scan.stamp_s)

    def sequence(self, now_s: float, pose: Pose2D) -> List[Action]:
        """Lets the sequencer look at the odometry; its actions."""
        self.log.move(now_s, pose)
        idle = self.navigator.state is State.IDLE and self.waiting_goal is None
        actions = self.sequencer.tick(now_s, pose, self._reports, idle)
        self._reports = []
        for action in actions:
            self.log.act(action)
            if isinstance(action, SendGoal):
                self.waiting_goal = action.pose
        return actions

    def is_due(self, now_s: float) -> bool:
        """Whether the navigator has something to do; a goal that waits is set if it can be."""
        navigator = self.navigator
        if self.waiting_goal is not None and navigator.accepts_goal(now_s):
            navigator.set_goal(self.waiting_goal, now_s)
            self.waiting_goal = None
        return navigator.next_due_s <= now_s + 1e-9 or navigator.has_work

    def navigate(self, now_s: float, state: RobotState, peers: Sequence[Peer]
                 ) -> Tuple[Tick, Located]:
        """Does what is due."""
        pose = state.map_from_base.to_2d()
        located = Located(pose, pose)
        tick = self.navigator.tick(now_s, located, state.twist, peers)
        self._take(tick)
        return tick, located

    def _take(self, tick: Tick) -> None:
        if tick.recovery is not None:
            self.log.recoveries += 1
        if tick.outcome is None:
            return
        self.log.aborts += not tick.outcome.succeeded
        # A goal that waits has replaced the one that ended here.
        if self.waiting_goal is None:
            verdict = Verdict.SUCCEEDED if tick.outcome.succeeded else Verdict.ABORTED
            self._reports.append(NavigatorReport(verdict, tick.outcome.text))


class Flight:
    """A mission from its start, advanced by one period of odometry at a time."""

    def __init__(self, setup: FlightSetup, observers: Sequence[FlightObserver] = ()):
        self.setup = setup
        self.simulation = Simulation(setup.scene, len(setup.robots), setup.simulation, setup.seed)
        self.robots = [FlightRobot(goals, configuration, number) for number, (goals, configuration)
                       in enumerate(zip(setup.robots, setup.configurations))]
        self._give_maps()
        self.reason = ""  # why it ended before its goals did, if it did
        self._observers = tuple(observers)
        self.states = self._read_states()
        for observer in self._observers:
            observer.began(self)
        self._scan()

    @property
    def now_s(self) -> float:
        return self.simulation.now_s

    @property
    def contacts(self) -> List[Contact]:
        """Oldest first."""
        return self.simulation.contacts

    @property
    def is_done(self) -> bool:
        return all(robot.sequencer.done for robot in self.robots)

    @property
    def stop_reason(self) -> str:
        """Why an observer wants it to end, "" when none does."""
        return next((o.stop_reason for o in self._observers if o.stop_reason), "")

    def advance(self) -> None:
        """Fly for one period of odometry, 1/40 s."""
        end = self.simulation.step_count + STEPS_PER_ODOMETRY
        while self.simulation.step_count < end:
            self._step(end)
        self.states = self._read_states()
        for observer in self._observers:
            observer.moved(self)
        self._sequence()
        self._navigate()

    def end(self, reason: str = "") -> None:
        """Frees the simulation; the observers are told once."""
        self.reason = reason
        for observer in self._observers:
            observer.ended(self)
        self.simulation.close()

    def _give_maps(self) -> None:
        maps = SceneMaps(self.setup.scene)
        for robot in self.robots:
            maps.give_to(robot.navigator.global_costmap)
            maps.give_to(robot.navigator.local_costmap)

    def _read_states(self) -> List[RobotState]:
        return [self.simulation.state(index) for index in range(len(self.robots))]

    def _step(self, end: int) -> None:
        """To a step, or to that of the next scan, which is taken."""
        count, per_scan = self.simulation.step_count, self.setup.steps_per_scan
        next_scan = (count // per_scan + 1) * per_scan
        for contact in self.simulation.advance(min(end, next_scan) - count):
            for observer in self._observers:
                observer.touched(contact)
        if self.simulation.step_count == next_scan:
            self._scan()

    def _scan(self) -> None:
        everybody = range(len(self.robots))
        for index, scan in zip(everybody, self.simulation.scans(everybody)):
            map_from_lidar = self.simulation.state(index).map_from_base.compose(base_from_lidar)
            self.robots[index].see(scan, map_from_lidar, self.now_s)
            for observer in self._observers:
                observer.scanned(index, scan, map_from_lidar)

    def _sequence(self) -> None:
        now_s = self.now_s
        for index, (robot, state) in enumerate(zip(self.robots, self.states)):
            for action in robot.sequence(now_s, state.map_from_base.to_2d()):
                for observer in self._observers:
                    observer.acted(index, now_s, action)

    def _navigate(self) -> None:
        now_s = self.now_s
        due = [index for index, robot in enumerate(self.robots) if robot.is_due(now_s)]
        peers = self._peers_near(due)
        for index in due:
            robot = self.robots[index]
            start_s = time.perf_counter()
            tick, located = robot.navigate(now_s, self.states[index], peers[index])
            wall_s = time.perf_counter() - start_s
            if tick.command is not None:
                self.simulation.set_command(index, tick.command)
            for observer in self._observers:
                observer.ticked(index, tick, located, wall_s)

    def _peers_near(self, robots: Sequence[int]) -> Dict[int, List[Peer]]:
        """For each of some quadcopters the others that it may have to do with."""
        if len(self.robots) == 1:
            return {index: [] for index in robots}
        positions = self.simulation.body_state.positions_m[:, :2]
        near: Dict[int, List[int]] = {}
        for index in robots:
            apart_m = np.hypot(*(positions - positions[index]).T)
            apart_m[index] = np.inf
            reach_m = self.robots[index].navigator.peer_reach_m
            near[index] = np.flatnonzero(apart_m < reach_m).tolist()
        peers = {index: self._as_peer(index) for index in set().union(*near.values())}
        return {index: [peers[other] for other in others] for index, others in near.items()}

    def _as_peer(self, index: int) -> Peer:
        robot, state = self.robots[index], self.states[index]
        return peer_at(robot.name, state.map_from_base.to_2d(), state.twist, self.now_s,
                       robot.navigator.intention)
