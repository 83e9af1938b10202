"""The circle scan -> costmap -> plan -> velocity -> body -> scan in one program.

Time goes in the simulation's steps of 1/240 s. Scans are taken and delivered at
their own steps; every 1/40 s there is odometry, the sequencers look at it, and the
navigators do what is due. This is what the nodes do on ROS, less the transport.
Equal setups give equal flights, bit for bit.
"""

from __future__ import annotations

from operator import attrgetter
from typing import Dict, List, Mapping, Sequence

from quad_nav.config import Configuration
from quad_nav.geometry import Pose2D
from quad_nav.mission.flight_log import FlightLog
from quad_nav.mission.robot_goals import RobotGoals
from quad_nav.mission.sequencer import Action, NavigatorReport, SendGoal, Sequencer, Verdict
from quad_nav.navigator.tick import State, Tick
from quad_nav.offline.navigator_group import Navigated, NavigatorGroup
from quad_nav.offline.observer import FlightObserver
from quad_nav.offline.offline_robot import OfflineRobot
from quad_nav.offline.worker_process import WorkerProcess
from quad_nav.peers.peer import Intention
from quad_nav.scenario.flight_setup import FlightSetup
from quad_nav.sim.contacts import Contact
from quad_nav.sim.simulation import STEPS_PER_S, RobotStates, Simulation

STEPS_PER_ODOMETRY = STEPS_PER_S // 40


class FlightRobot:
    """One quadcopter's sequencer, and what it knows of the navigator.

    ``goal_waits`` while the navigator has not taken the last goal that was sent.
    """

    def __init__(self, goals: RobotGoals, configuration: Configuration, log: FlightLog):
        self.name = goals.name
        self.configuration = configuration
        self.sequencer = Sequencer(goals.sequence)
        self._log = log
        self.goal_waits = False
        self._is_idle = True
        self._reports: List[NavigatorReport] = []

    def sequence(self, now_s: float, pose: Pose2D) -> List[Action]:
        """Lets the sequencer look at the odometry; its actions."""
        self._log.move(self.name, now_s, pose)
        actions = self.sequencer.tick(
            now_s, pose, self._reports, self._is_idle and not self.goal_waits
        )
        self._reports = []
        for action in actions:
            self._log.robots[self.name].act(action)
            self.goal_waits = self.goal_waits or isinstance(action, SendGoal)
        return actions

    def take(self, tick: Tick, goal_waits: bool) -> None:
        """What the navigator has done."""
        self.goal_waits, self._is_idle = goal_waits, tick.state is State.IDLE
        if tick.recovery is not None:
            self._log.robots[self.name].recoveries += 1
        if tick.outcome is None:
            return
        self._log.robots[self.name].aborts += not tick.outcome.succeeded
        # A goal that waits has replaced the one that ended here.
        if not goal_waits:
            verdict = Verdict.SUCCEEDED if tick.outcome.succeeded else Verdict.ABORTED
            self._reports.append(NavigatorReport(verdict, tick.outcome.text))


class Flight:
    """A mission from its start, advanced by one period of odometry at a time.

    LIDARs and navigators share ``processes``; what is flown does not depend on how many. There
    is only one when an observer looks inside, or when the engine casts the beams.
    """

    def __init__(
        self, setup: FlightSetup, observers: Sequence[FlightObserver] = (), processes: int = 1
    ):
        self.setup = setup
        self._observers = tuple(observers)
        if (
            any(observer.looks_inside for observer in self._observers)
            or setup.simulation.lidar_caster != "kernel"
        ):
            processes = 1
        self.log = FlightLog(
            [goals.name for goals in setup.robots],
            setup.robot_radius_m,
            setup.scene.flight_clearances_m,
        )
        self.robots = [
            FlightRobot(goals, configuration, self.log)
            for goals, configuration in zip(setup.robots, setup.configurations)
        ]
        shares = [
            range(first, len(self.robots), processes)
            for first in range(min(processes, len(self.robots)))
        ]
        # Before the engine is there: processes that begin as copies need none.
        self._helpers = [WorkerProcess(setup, share) for share in shares[1:]]
        self.simulation = Simulation(setup.scene, len(setup.robots), setup.simulation, setup.seed)
        self._crew = NavigatorGroup(setup, shares[0], self.simulation.lidars)
        self._new_goals: Dict[int, Pose2D] = {}
        self._news: Dict[int, Intention] = {}  # of what the last ticks changed
        self.reason = ""  # why it ended before its goals did, if it did
        self.states = RobotStates(self.simulation.body_state)
        for observer in self._observers:
            observer.began(self)
        self._scan()

    @property
    def pilots(self) -> Mapping[int, OfflineRobot]:
        """By the quadcopters' numbers, as far as they are in this process."""
        return self._crew.pilots

    @property
    def now_s(self) -> float:
        return self.simulation.now_s

    @property
    def contacts(self) -> List[Contact]:
        """Oldest first."""
        return self.log.contacts

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
        self.states = RobotStates(self.simulation.body_state)
        for observer in self._observers:
            observer.moved(self)
        self._sequence()
        self._navigate()

    def end(self, reason: str = "") -> None:
        """Frees the simulation and ends the helpers; the observers are told once."""
        self.reason = reason
        for observer in self._observers:
            observer.ended(self)
        self.simulation.close()
        for helper in self._helpers:
            helper.close()

    def _step(self, end: int) -> None:
        """To a step, or to that of the next scan, which is taken."""
        count, per_scan = self.simulation.step_count, self.setup.steps_per_scan
        next_scan = (count // per_scan + 1) * per_scan
        for contact in self.simulation.advance(min(end, next_scan) - count):
            self.log.add_contact(contact)
            for observer in self._observers:
                observer.touched(contact)
        if self.simulation.step_count == next_scan:
            self._scan()

    def _scan(self) -> None:
        states, now_s = RobotStates(self.simulation.body_state), self.now_s
        for helper in self._helpers:
            helper.scan(now_s, states)
        for index, (scan, map_from_lidar) in self._crew.scan(now_s, states).items():
            for observer in self._observers:
                observer.scanned(index, scan, map_from_lidar)

    def _sequence(self) -> None:
        now_s = self.now_s
        for index, (robot, state) in enumerate(zip(self.robots, self.states)):
            for action in robot.sequence(now_s, state.map_from_base.to_2d()):
                if isinstance(action, SendGoal):
                    self._new_goals[index] = action.pose
                for observer in self._observers:
                    observer.acted(index, now_s, action)

    def _navigate(self) -> None:
        for done in sorted(self._navigated(), key=attrgetter("robot")):
            index = done.robot
            self.robots[index].take(done.tick, done.goal_waits)
            if done.tick.command is not None:
                self.simulation.set_command(index, done.tick.command)
            for observer in self._observers:
                observer.ticked(index, done.tick, done.located, done.wall_s)

    def _navigated(self) -> List[Navigated]:
        """Lets all crews do what is due, side by side."""
        goals, news = self._new_goals, self._news
        now_s, states = self.now_s, self.states
        for helper in self._helpers:
            helper.begin_navigating(
                now_s,
                states,
                {robot: goals[robot] for robot in helper.robots if robot in goals},
                news,
            )
        done = self._crew.navigate(
            now_s,
            states,
            {robot: goals[robot] for robot in self._crew.pilots if robot in goals},
            news,
        )
        for helper in self._helpers:
            done += helper.navigated()
        self._new_goals = {}
        self._news = {each.robot: each.intention for each in done}
        return done
