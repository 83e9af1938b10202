"""Trace of a flight as arrays: the input of reports, animations and views.

A trace comes from a running flight (``TraceObserver``) or from a recording (``bag_trace``).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Iterable, List, Mapping, Optional, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.config.differences import known_parameters
from quad_nav.geometry import Pose2D, yaws_from_quaternions
from quad_nav.mission.actions import Action, Event
from quad_nav.mission.goal import Goal
from quad_nav.mission.localization_errors import pose_errors
from quad_nav.navigator.tick import RobotPoses, State, Tick
from quad_nav.offline.flight import Flight, FlightObserver
from quad_nav.sim.contacts import Contact
from quad_nav.sim.crowd_record import CrowdRecord
from quad_nav.sim.localization import believed_states, covariances
from quad_nav.sim.movers import Movers
from quad_nav.sim.scene import Scene
from quad_nav.topics.mission_events import MissionEvent, mission_event
from quad_nav.versions import versions


@dataclass(frozen=True)
class GoalTrace:
    """Flight to one goal.

    ``ended_s`` is None if the goal had not ended. ``reason`` says why it was not reached.
    ``yaw_error_rad`` is the robot's yaw at the end less the goal's; None for a goal without yaw.
    """

    index: int
    lap: int
    pose: Pose2D
    sent_s: float
    ended_s: Optional[float] = None
    reached: bool = False
    reason: str = ""
    attempts: int = 1
    yaw_error_rad: Optional[float] = None


def goal_traces(events: Iterable[MissionEvent], start_s: float = 0.0) -> Tuple[GoalTrace, ...]:
    """Return the flights to the goals of one robot; times count from ``start_s``.

    The end of a goal that was not seen to be sent, as in a recording that was started later, is
    left out.
    """
    goals: List[GoalTrace] = []
    for event in events:
        if event.event is Event.SENT and event.pose is not None:
            if not event.reason:
                goals.append(GoalTrace(event.goal, event.lap, event.pose, event.time_s - start_s))
        elif event.event in (Event.REACHED, Event.SKIPPED) and goals:
            last = goals[-1]
            if last.ended_s is None and (last.index, last.lap) == (event.goal, event.lap):
                goals[-1] = replace(
                    last,
                    ended_s=event.time_s - start_s,
                    reached=event.event is Event.REACHED,
                    reason=event.reason,
                    attempts=event.attempts,
                    yaw_error_rad=event.yaw_error_rad,
                )
    return tuple(goals)


@dataclass(frozen=True)
class RobotTrace:
    """Trace of one robot.

    Attributes:
        name: Name of the robot.
        times_s: Times of the poses, shape (k,).
        positions_m: Positions in ``map``, shape (k, 3).
        quaternions: Orientations (x, y, z, w) in ``map``, shape (k, 4).
        velocities: Velocities (vx, vy, vyaw) in the body frame, shape (k, 3), m/s and rad/s.
        command_times_s: Times of the commands, shape (c,).
        commands: Commands (vx, vy, vyaw) in the body frame, shape (c, 3), m/s and rad/s.
        cycle_times_s: Times of the control cycles, shape (m,).
        cycle_walls_s: Wall times of the control cycles, shape (m,); empty if unknown.
        plans: (time, plan) pairs; a plan has shape (n, 2) or (n, 3), in ``map``.
        states: (time, state) pairs, one for each change.
        recoveries: (time, name) pairs.
        goals: Goals in the order of flight.
        parameters: move_base's known parameters with ROS names; empty if unknown.
        mission: The goals of the goal file; empty if unknown.
        odom_frames: (time, pose in ``map``) pairs of the odometry frame, one for each change.
        said: (time, value) pairs of each topic of ``ROBOT_TOPICS``, by name; recordings have them.
        believed: Poses (x, y, yaw) in ``map`` that the robot believes, shape (k, 3); shape (0, 3)
            if it knows them, or nobody knows the true ones.
        covariances: Those of its last estimates, shape (k, 3, 3), NaN before the first; shape
            (0, 3, 3) without any.
    """

    name: str
    times_s: NDArray[np.float64]
    positions_m: NDArray[np.float64]
    quaternions: NDArray[np.float64]
    velocities: NDArray[np.float64]
    command_times_s: NDArray[np.float64]
    commands: NDArray[np.float64]
    cycle_times_s: NDArray[np.float64]
    cycle_walls_s: NDArray[np.float64]
    plans: Tuple[Tuple[float, NDArray[np.float64]], ...] = ()
    states: Tuple[Tuple[float, State], ...] = ()
    recoveries: Tuple[Tuple[float, str], ...] = ()
    goals: Tuple[GoalTrace, ...] = ()
    parameters: Mapping[str, Any] = field(default_factory=dict)
    mission: Tuple[Goal, ...] = ()
    odom_frames: Tuple[Tuple[float, Pose2D], ...] = ()
    said: Mapping[str, Tuple[Tuple[float, Any], ...]] = field(default_factory=dict)
    believed: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 3)))
    covariances: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 3, 3)))

    @property
    def unsent(self) -> Tuple[Goal, ...]:
        """Goals of the goal file after the last one that was sent."""
        return self.mission[self.goals[-1].index + 1 if self.goals else 0 :]

    @property
    def is_localized(self) -> bool:
        """True if the robot finds its place, as far as the trace tells."""
        return len(self.believed) > 0 or len(self.covariances) > 0

    @cached_property
    def errors(self) -> NDArray[np.float64]:
        """Errors of the believed poses in m and rad, shape (k, 2); shape (0, 2) without any."""
        if not len(self.believed):
            return np.zeros((0, 2))
        yaws_rad = yaws_from_quaternions(self.quaternions)
        return pose_errors(self.believed, np.column_stack([self.positions_m[:, :2], yaws_rad]))


@dataclass(frozen=True)
class FlightTrace:
    """Trace of all robots of a flight, with its contacts and scene.

    ``jitter_m`` is the largest displacement of a start position; None if it is unknown. ``people``
    says where people were who react to quadcopters; None if there are none, or it is unknown.
    """

    title: str
    robots: Tuple[RobotTrace, ...]
    contacts: Tuple[Contact, ...]
    scene: Optional[Scene]
    robot_radius_m: float
    seed: Optional[int] = None
    config_name: str = ""
    versions: Mapping[str, str] = field(default_factory=dict)
    reason: str = ""
    jitter_m: Optional[float] = None
    people: Optional[CrowdRecord] = None

    @cached_property
    def movers(self) -> Optional[Movers]:
        """The moving obstacles of the scene; None without any, or without a scene."""
        if self.scene is None or not self.scene.moving_shapes:
            return None
        return Movers(self.scene, self.seed, record=self.people)


class _RobotRecord:
    """Lists from which a ``RobotTrace`` is built."""

    def __init__(self) -> None:
        self.commands: List[Tuple[float, float, float, float]] = []
        self.cycles: List[Tuple[float, float]] = []
        self.plans: List[Tuple[float, NDArray[np.float64]]] = []
        self.states: List[Tuple[float, State]] = []
        self.recoveries: List[Tuple[float, str]] = []
        self.events: List[MissionEvent] = []
        self.velocities: List[Tuple[float, float, float]] = []


class TraceObserver(FlightObserver):
    """Traces a running flight."""

    def __init__(self, title: str = "flight") -> None:
        self._title = title
        self._times_s: List[float] = []
        self._positions: List[NDArray[np.float64]] = []
        self._quaternions: List[NDArray[np.float64]] = []
        self._believed: List[NDArray[np.float64]] = []  # of all robots, as the next
        self._covariances: List[NDArray[np.float64]] = []
        self._robots: List[_RobotRecord] = []
        self._flight: Optional[Flight] = None
        self._people: Optional[CrowdRecord] = None

    def on_start(self, flight: Flight) -> None:
        """Start the trace."""
        self._flight = flight
        self._people = CrowdRecord.of(flight.setup.scene)
        self._robots = [_RobotRecord() for _ in flight.robots]
        self.on_move(flight)

    def on_move(self, flight: Flight) -> None:
        """Add the state of all bodies."""
        bodies = flight.simulation.body_state
        self._times_s.append(flight.now_s)
        self._positions.append(bodies.positions_m)
        self._quaternions.append(bodies.quaternions)
        localization = flight.loop.group.localization
        if localization is not None:
            self._believed.append(believed_states(flight.states, localization).poses)
            self._covariances.append(covariances(localization, len(flight.robots)))
        if self._people is not None:
            poses = flight.simulation.movers.poses(flight.now_s)
            self._people.add(flight.now_s, poses[flight.setup.scene.walker_rows, :2])
        for record, state in zip(self._robots, flight.states):
            twist = state.twist
            record.velocities.append((twist.vx_mps, twist.vy_mps, twist.vyaw_radps))

    def on_action(self, robot: int, now_s: float, action: Action) -> None:
        """Add an action of the sequencer."""
        self._robots[robot].events.append(mission_event(robot, now_s, action))

    def on_tick(self, robot: int, tick: Tick, located: RobotPoses, wall_s: float) -> None:
        """Add the results of a navigator's tick."""
        record, now_s = self._robots[robot], tick.now_s
        if tick.cycle:
            record.cycles.append((now_s, wall_s))
        if tick.command is not None:
            command = tick.command
            record.commands.append((now_s, command.vx_mps, command.vy_mps, command.vyaw_radps))
        if tick.plan is not None:
            assert self._flight is not None
            costmap = self._flight.setup.configurations[robot].global_costmap
            record.plans.append((now_s, self._flight.plan_in_map(robot, tick.plan, costmap)))
        if not record.states or record.states[-1][1] is not tick.state:
            record.states.append((now_s, tick.state))
        if tick.recovery is not None:
            record.recoveries.append((now_s, tick.recovery.name))

    def trace(self, contacts: Tuple[Contact, ...] = (), reason: str = "") -> FlightTrace:
        """Build the trace of the flight so far.

        Args:
            contacts: Contacts of the flight's summary.
            reason: Reason why the flight ended early, from the summary.
        """
        assert self._flight is not None
        setup = self._flight.setup
        return FlightTrace(
            self._title,
            self._robot_traces(self._flight),
            contacts,
            setup.scene,
            setup.robot_radius_m,
            setup.seed,
            setup.config_name,
            versions(),
            reason,
            setup.simulation.jitter_m,
            self._people,
        )

    def _robot_traces(self, flight: Flight) -> Tuple[RobotTrace, ...]:
        times_s, positions = np.array(self._times_s), np.array(self._positions)
        quaternions = np.array(self._quaternions)
        count = len(flight.robots)
        believed = np.array(self._believed).reshape(-1, count, 3)
        uncertain = np.array(self._covariances).reshape(-1, count, 3, 3)
        traces = []
        for k, (record, robot) in enumerate(zip(self._robots, flight.robots)):
            commands = np.array(record.commands, dtype=float).reshape(-1, 4)
            cycles = np.array(record.cycles, dtype=float).reshape(-1, 2)
            traces.append(
                RobotTrace(
                    robot.name,
                    times_s,
                    positions[:, k],
                    quaternions[:, k],
                    np.array(record.velocities),
                    commands[:, 0],
                    commands[:, 1:],
                    cycles[:, 0],
                    cycles[:, 1],
                    tuple(record.plans),
                    tuple(record.states),
                    tuple(record.recoveries),
                    goal_traces(record.events),
                    known_parameters(robot.configuration.to_tree()),
                    tuple(robot.sequencer.sequence.goals),
                    believed=believed[:, k],
                    covariances=uncertain[:, k],
                )
            )
        return tuple(traces)
