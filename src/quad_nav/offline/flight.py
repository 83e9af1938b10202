"""A mission flown by the loop on a virtual clock: sequencers, log and observers around it.

Every 1/40 s there is odometry: the sequencers read it and send goals, and the navigators run what
is due. Equal set-ups give equal flights, bit for bit.
"""

from __future__ import annotations

from functools import partial
from typing import Any, List, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from quad_nav.config import Configuration
from quad_nav.costmap.layered import CostmapParams
from quad_nav.geometry import Pose2D, Pose3D, Scan
from quad_nav.loop import inspection, offline_setup, shares_of
from quad_nav.loop.flight_loop import FlightLoop
from quad_nav.loop.navigator_group import LocatedScan, LoopRobot
from quad_nav.mission.actions import Action, SendGoal
from quad_nav.mission.flight_log import FlightLog
from quad_nav.mission.goal_file import GoalSequence
from quad_nav.navigator.tick import RobotPoses, Tick
from quad_nav.offline.flight_robot import FlightRobot, GoalWatch
from quad_nav.scenario.flight_setup import FlightSetup
from quad_nav.sim.contacts import Contact

_POSES_AT_ONCE = 400
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

    @property
    def facts(self) -> Mapping[str, Any]:
        """Facts about the flight, by the keys of ``mission.summary.FACTS``."""
        return {}

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


class Flight:
    """A mission from its start, advanced by one period of odometry at a time.

    LIDARs and navigators are divided among ``processes``; the flight does not depend on their
    number. There is one process if an observer needs that, if the physics engine casts the beams,
    or if robots find their places. Without ``navigators`` nothing scans or commands but who calls
    the simulation.
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
        self._log = FlightLog(
            [goals.name for goals in setup.robots],
            setup.robot_radius_m,
            lambda *places: self.simulation.movers.flight_surface_distances_m(*places),
        )
        self.robots = [
            FlightRobot(goals, configuration, self._log)
            for goals, configuration in zip(setup.robots, setup.configurations)
        ]
        self._watch = GoalWatch(self.robots)
        self._stamps_s: List[float] = []  # poses that are not in the log yet
        self._poses: List[NDArray[np.float64]] = []
        self.loop = self._new_loop(len(self.robots) if navigators else 0, processes)
        self.simulation = self.loop.simulation
        self.reason = ""  # why it ended early; "" after all goals
        self.states = self.loop.states
        for observer in self._observers:
            observer.on_start(self)
        self._report_scans(self.loop.start())

    def _new_loop(self, hosted: int, processes: int) -> FlightLoop:
        if (
            any(observer.needs_single_process for observer in self._observers)
            or self.setup.simulation.lidar_caster != "kernel"
            or self.setup.localization is not None
        ):
            processes = 1
        reads_ticks = any(
            type(observer).on_tick is not FlightObserver.on_tick for observer in self._observers
        )
        # The last share is the smallest; the process that moves the bodies takes it.
        shares = shares_of(range(hosted), processes)[::-1]
        return FlightLoop(offline_setup(self.setup), shares, whole_ticks=reads_ticks)

    @property
    def offline_robots(self) -> Mapping[int, LoopRobot]:
        """The robots of this process, by number."""
        return self.loop.group.robots

    @property
    def log(self) -> FlightLog:
        """The log, up to the last odometry."""
        self._log_poses()
        return self._log

    @property
    def now_s(self) -> float:
        """Simulated time."""
        return self.simulation.now_s

    @property
    def contacts(self) -> List[Contact]:
        """All contacts, oldest first."""
        return self._log.contacts

    @property
    def is_done(self) -> bool:
        """True when every sequencer is done, and no robot flies to a person's goal."""
        return all(robot.is_done for robot in self.robots)

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
        is_odometry = False
        while not is_odometry:
            progress = self.loop.advance()
            for contact in progress.contacts:
                self._log.add_contact(contact)
                for observer in self._observers:
                    observer.on_contact(contact)
            self._report_scans(progress.scans)
            is_odometry = progress.is_odometry
        self.states = self.loop.states
        for observer in self._observers:
            observer.on_move(self)
        self._sequence()
        self._navigate()

    def command(self, robot: int, tick: Tick) -> None:
        """Pass the command of a navigator's tick to the simulation, if there is one."""
        self.loop.command(robot, tick.command)

    # -- a person's doing ----------------------------------------------------------------

    def send_goal(self, robot: int, pose: Pose2D) -> None:
        """Send a robot to a pose in ``map``; the sequencer sends its own goal again afterwards."""
        self.loop.send_goal(robot, pose)
        self.robots[robot].replace_goal()
        self._watch.update(robot)

    def cancel_goal(self, robot: int) -> None:
        """Cancel the goal of a robot; the sequencer skips it if it is its own."""
        self.loop.cancel_goal(robot)
        self.robots[robot].cancel_goal()
        self._watch.update(robot)

    def hold(self) -> None:
        """Stop all missions: every goal is cancelled, and no other one sent until ``release``."""
        for number, robot in enumerate(self.robots):
            if robot.has_navigator_goal:
                self.cancel_goal(number)
            robot.sequencer.hold(self.now_s)

    def release(self) -> None:
        """Resume all missions; each sends its goal again."""
        for number, robot in enumerate(self.robots):
            robot.sequencer.release(self.now_s)
            self._watch.update(number)

    def replace_goals(self, robot: int, sequence: GoalSequence) -> None:
        """Follow other goals from now on, see ``Sequencer.replace_sequence``."""
        self.robots[robot].sequencer.replace_sequence(sequence)
        self._watch.update(robot)

    def clear_costmaps(self, robot: int) -> None:
        """Clear both costmaps of a robot."""
        change = partial(inspection.clear_costmaps, robot=robot, now_s=self.now_s)
        self.loop.change(robot, change)

    def reconfigure(self, robot: int, configuration: Configuration) -> None:
        """Change the parameters of a robot's navigator that may change in flight."""
        self.robots[robot].configuration = configuration
        change = partial(inspection.reconfigure, robot=robot, configuration=configuration)
        self.loop.change(robot, change)

    def end(self, reason: str = "") -> None:
        """Call every observer's ``on_end``, then close the simulation and the processes."""
        self.reason = reason
        for observer in self._observers:
            observer.on_end(self)
        self.loop.close()

    def _report_scans(self, scans: Mapping[int, LocatedScan]) -> None:
        for index, (scan, map_from_lidar) in scans.items():
            for observer in self._observers:
                observer.on_scan(index, scan, map_from_lidar)

    def _sequence(self) -> None:
        now_s, poses = self.now_s, self.states.poses
        self._stamps_s.append(now_s)
        self._poses.append(poses)
        if len(self._stamps_s) == _POSES_AT_ONCE:
            self._log_poses()
        for index in self._watch.due(now_s, poses):
            robot = self.robots[index]
            actions = robot.tick_sequencer(now_s, Pose2D(*poses[index].tolist()))
            for action in actions:
                self.log.robots[robot.name].add_action(action)
            for action in actions:
                if isinstance(action, SendGoal):
                    self.loop.send_goal(index, action.pose)
                for observer in self._observers:
                    observer.on_action(index, now_s, action)
            self._watch.update(index)

    def _log_poses(self) -> None:
        if self._stamps_s:
            self._log.add_tracks(self._stamps_s, np.array(self._poses))
            self._stamps_s, self._poses = [], []

    def _navigate(self) -> None:
        for result in self.loop.navigate():
            index = result.robot
            if self.robots[index].update(result.tick, result.goal_waits):
                self._watch.update(index)
            self.command(index, result.tick)
            for observer in self._observers:
                observer.on_tick(index, result.tick, result.located, result.wall_s)
