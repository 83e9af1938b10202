"""The loop scan -> costmap -> plan -> velocity -> body -> scan in one process.

Time advances in the simulation's steps of 1/240 s. Scans are taken and delivered at their own
steps. Every 1/40 s there is odometry: the sequencers read it, and the navigators run what is due.
The ROS nodes do the same, with topics in between. Equal set-ups give equal flights, bit for bit.
"""

from __future__ import annotations

from operator import attrgetter
from typing import Dict, List, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from quad_nav.config import Configuration
from quad_nav.costmap.layered import CostmapParams
from quad_nav.geometry import Pose2D, Pose3D, Scan
from quad_nav.mission.flight_log import FlightLog
from quad_nav.mission.robot_goals import RobotGoals
from quad_nav.mission.sequencer import Action, NavigatorReport, SendGoal, Sequencer, Verdict
from quad_nav.navigator.tick import RobotPoses, State, Tick
from quad_nav.offline.navigator_group import NavigatorGroup, NavigatorResult, OfflineRobot
from quad_nav.offline.worker_process import WorkerProcess
from quad_nav.peers.peer import Intention
from quad_nav.scenario.flight_setup import FlightSetup
from quad_nav.sim.contacts import Contact
from quad_nav.sim.simulation import STEPS_PER_S, RobotStates, Simulation

STEPS_PER_ODOMETRY = STEPS_PER_S // 40
CONTACT = "contact"
"""Stop reason of a flight that ends at its first contact."""


class FlightObserver:
    """Base class of recorders, traces, views and progress bars; every method may do nothing.

    Methods are called in the order in which things happen. ``robot`` is the robot's number.
    Arguments must not be changed. An observer with ``needs_single_process`` reads scans or the
    navigators in ``flight.offline_robots``, which are complete only in a single process.
    """

    needs_single_process = False

    @property
    def stop_reason(self) -> str:
        """Reason to end the flight, "" to continue."""
        return ""

    def on_start(self, flight: Flight) -> None:
        """Handle the start: everything is in place at time 0, nothing has moved."""

    def on_contact(self, contact: Contact) -> None:
        """Handle the begin of a contact."""

    def on_scan(self, robot: int, scan: Scan, map_from_lidar: Pose3D) -> None:
        """Handle a scan; ``map_from_lidar`` is the LIDAR's pose at the scan's stamp."""

    def on_move(self, flight: Flight) -> None:
        """Handle the end of a period of odometry: ``flight.states`` are new."""

    def on_action(self, robot: int, now_s: float, action: Action) -> None:
        """Handle an action of the sequencer: a goal sent, a goal or the sequence ended."""

    def on_tick(self, robot: int, tick: Tick, located: RobotPoses, wall_s: float) -> None:
        """Handle a navigator's tick, which took ``wall_s`` seconds of wall time."""

    def on_end(self, flight: Flight) -> None:
        """Handle the end of the flight, also of one that was stopped."""


class StopAtContact(FlightObserver):
    """Stops the flight at its first contact."""

    def __init__(self) -> None:
        self._touched = False

    @property
    def stop_reason(self) -> str:
        """``CONTACT`` after a contact."""
        return CONTACT if self._touched else ""

    def on_contact(self, contact: Contact) -> None:
        """Remember the contact."""
        self._touched = True


class FlightRobot:
    """One robot's sequencer, its log, and the last known state of its navigator.

    ``goal_waits`` while the navigator has not taken the last goal that was sent.
    """

    def __init__(self, goals: RobotGoals, configuration: Configuration, log: FlightLog) -> None:
        self.name = goals.name
        self.configuration = configuration
        self.sequencer = Sequencer(goals.sequence)
        self._log = log
        self.goal_waits = False
        self._is_idle = True
        self._reports: List[NavigatorReport] = []

    def tick_sequencer(self, now_s: float, pose: Pose2D) -> List[Action]:
        """Pass the odometry to the sequencer and return its actions."""
        self._log.add_pose(self.name, now_s, pose)
        actions = self.sequencer.tick(
            now_s, pose, self._reports, self._is_idle and not self.goal_waits
        )
        self._reports = []
        for action in actions:
            self._log.robots[self.name].add_action(action)
            self.goal_waits = self.goal_waits or isinstance(action, SendGoal)
        return actions

    def update(self, tick: Tick, goal_waits: bool) -> None:
        """Store the result of the navigator's tick for the log and the sequencer."""
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

    LIDARs and navigators are divided among ``processes``; the flight does not depend on their
    number. There is one process if an observer needs that, or if the physics engine casts the
    beams. Without ``navigators`` nothing scans or commands but who calls the simulation.
    """

    def __init__(
        self,
        setup: FlightSetup,
        observers: Sequence[FlightObserver] = (),
        processes: int = 1,
        navigators: bool = True,
    ) -> None:
        self.setup = setup
        self._observers = tuple(observers)
        if (
            any(observer.needs_single_process for observer in self._observers)
            or setup.simulation.lidar_caster != "kernel"
        ):
            processes = 1
        self.log = FlightLog(
            [goals.name for goals in setup.robots],
            setup.robot_radius_m,
            setup.scene.flight_surface_distances_m,
        )
        self.robots = [
            FlightRobot(goals, configuration, self.log)
            for goals, configuration in zip(setup.robots, setup.configurations)
        ]
        count = len(self.robots) if navigators else 0
        shares = [range(first, count, processes) for first in range(max(1, min(processes, count)))]
        # Before the engine is created: forked processes must not inherit it.
        self._workers = [WorkerProcess(setup, share) for share in shares[1:]]
        self.simulation = Simulation(setup.scene, len(setup.robots), setup.simulation, setup.seed)
        self._group = NavigatorGroup(setup, shares[0], self.simulation.lidars)
        self._new_goals: Dict[int, Pose2D] = {}
        self._updates: Dict[int, Intention] = {}  # intentions that the last ticks changed
        self.reason = ""  # why it ended early; "" after all goals
        self.states = RobotStates(self.simulation.body_state)
        for observer in self._observers:
            observer.on_start(self)
        self._scan()

    @property
    def offline_robots(self) -> Mapping[int, OfflineRobot]:
        """The robots of this process, by number."""
        return self._group.robots

    @property
    def now_s(self) -> float:
        """Simulated time."""
        return self.simulation.now_s

    @property
    def contacts(self) -> List[Contact]:
        """All contacts, oldest first."""
        return self.log.contacts

    @property
    def is_done(self) -> bool:
        """True when every sequencer is done."""
        return all(robot.sequencer.done for robot in self.robots)

    @property
    def stop_reasons(self) -> List[str]:
        """The observers' reasons to end the flight, [] to continue."""
        reasons = (observer.stop_reason for observer in self._observers)
        return list(dict.fromkeys(reason for reason in reasons if reason))

    def plan_in_map(
        self, robot: int, plan: NDArray[np.float64], costmap: CostmapParams
    ) -> NDArray[np.float64]:
        """Express a plan of now, float64[n, 3] in the frame of a robot's costmap, in ``map``."""
        map_from_frame = self.simulation.map_from_frame(costmap.global_frame, robot)
        return plan if map_from_frame == Pose2D(0.0, 0.0) else map_from_frame.transform_poses(plan)

    def advance(self) -> None:
        """Fly for one period of odometry, 1/40 s.

        Raises:
            WorkerProcessError: A worker process failed.
        """
        end = self.simulation.step_count + STEPS_PER_ODOMETRY
        while self.simulation.step_count < end:
            self._step(end)
        self.states = RobotStates(self.simulation.body_state)
        for observer in self._observers:
            observer.on_move(self)
        self._sequence()
        self._navigate()

    def command(self, robot: int, tick: Tick) -> None:
        """Pass the command of a navigator's tick to the simulation, if there is one."""
        if tick.command is not None:
            self.simulation.set_command(robot, tick.command)

    def end(self, reason: str = "") -> None:
        """Call every observer's ``on_end``, then close the simulation and the processes."""
        self.reason = reason
        for observer in self._observers:
            observer.on_end(self)
        self.simulation.close()
        for worker in self._workers:
            worker.close()

    def _step(self, end: int) -> None:
        """Advance to step ``end``, or to the next scan if that comes first, and take the scan."""
        count, per_scan = self.simulation.step_count, self.setup.steps_per_scan
        next_scan = (count // per_scan + 1) * per_scan
        for contact in self.simulation.advance(min(end, next_scan) - count):
            self.log.add_contact(contact)
            for observer in self._observers:
                observer.on_contact(contact)
        if self.simulation.step_count == next_scan:
            self._scan()

    def _scan(self) -> None:
        states, now_s = RobotStates(self.simulation.body_state), self.now_s
        for worker in self._workers:
            worker.scan(now_s, states)
        for index, (scan, map_from_lidar) in self._group.scan(now_s, states).items():
            for observer in self._observers:
                observer.on_scan(index, scan, map_from_lidar)

    def _sequence(self) -> None:
        now_s = self.now_s
        for index, (robot, state) in enumerate(zip(self.robots, self.states)):
            for action in robot.tick_sequencer(now_s, state.map_from_base.to_2d()):
                if isinstance(action, SendGoal):
                    self._new_goals[index] = action.pose
                for observer in self._observers:
                    observer.on_action(index, now_s, action)

    def _navigate(self) -> None:
        for result in sorted(self._tick_navigators(), key=attrgetter("robot")):
            index = result.robot
            self.robots[index].update(result.tick, result.goal_waits)
            self.command(index, result.tick)
            for observer in self._observers:
                observer.on_tick(index, result.tick, result.located, result.wall_s)

    def _tick_navigators(self) -> List[NavigatorResult]:
        """Tick the navigators that are due, in all processes at the same time."""
        goals, updates = self._new_goals, self._updates
        now_s, states = self.now_s, self.states
        for worker in self._workers:
            worker.begin_navigating(
                now_s,
                states,
                {robot: goals[robot] for robot in worker.robots if robot in goals},
                updates,
            )
        results = self._group.navigate(
            now_s,
            states,
            {robot: goals[robot] for robot in self._group.robots if robot in goals},
            updates,
        )
        for worker in self._workers:
            results += worker.results()
        self._new_goals = {}
        self._updates = {result.robot: result.intention for result in results}
        return results
