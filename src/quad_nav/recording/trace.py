"""What happened in a flight, as arrays: what reports, animations and views are made from.

It comes from a flight as it is flown (``TraceObserver``) or from a recorded bag.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, List, Mapping, Optional, Tuple

import numpy as np

from quad_nav.geometry import Pose2D
from quad_nav.mission.sequencer import Action, GoalEnded, SendGoal
from quad_nav.navigator.tick import RobotPoses, State, Tick
from quad_nav.offline.flight import Flight, FlightObserver
from quad_nav.sim.contacts import Contact
from quad_nav.sim.scene import Scene
from quad_nav.versions import versions


@dataclass(frozen=True)
class GoalTrace:
    """One goal's flight. ``ended_s`` is None when it was not over; ``reason`` why it failed."""

    index: int
    lap: int
    pose: Pose2D
    sent_s: float
    ended_s: Optional[float] = None
    reached: bool = False
    reason: str = ""
    attempts: int = 1


@dataclass(frozen=True)
class RobotTrace:
    """One quadcopter; everything is in ``map`` unless it says otherwise.

    ``times_s`` float64[k]; ``positions_m`` float64[k, 3]; ``quaternions`` float64[k, 4],
    (x, y, z, w); ``velocities`` float64[k, 3], (vx, vy, vyaw) in the body's frame.
    ``command_times_s`` float64[c] and ``commands`` float64[c, 3], in the body's frame.
    ``cycle_times_s`` float64[m]: when a control cycle ran; ``cycle_walls_s`` float64[m]: how
    long it took, empty where that is not known. ``plans``: (time, float64[n, 2 or 3]).
    ``states``: (time, state) at each change. ``recoveries``: (time, name).
    ``parameters``: move_base's tree with ROS spellings, {} where it is not known.
    """

    name: str
    times_s: np.ndarray
    positions_m: np.ndarray
    quaternions: np.ndarray
    velocities: np.ndarray
    command_times_s: np.ndarray
    commands: np.ndarray
    cycle_times_s: np.ndarray
    cycle_walls_s: np.ndarray
    plans: Tuple[Tuple[float, np.ndarray], ...] = ()
    states: Tuple[Tuple[float, State], ...] = ()
    recoveries: Tuple[Tuple[float, str], ...] = ()
    goals: Tuple[GoalTrace, ...] = ()
    parameters: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class FlightTrace:
    """All quadcopters of a flight, where they flew and what touched."""

    title: str
    robots: Tuple[RobotTrace, ...]
    contacts: Tuple[Contact, ...]
    scene: Optional[Scene]
    robot_radius_m: float
    seed: Optional[int] = None
    config_name: str = ""
    versions: Mapping[str, str] = field(default_factory=dict)
    reason: str = ""


class _RobotRecord:
    """Lists that become a ``RobotTrace``."""

    def __init__(self) -> None:
        self.commands: List[Tuple[float, float, float, float]] = []
        self.cycles: List[Tuple[float, float]] = []
        self.plans: List[Tuple[float, np.ndarray]] = []
        self.states: List[Tuple[float, State]] = []
        self.recoveries: List[Tuple[float, str]] = []
        self.goals: List[GoalTrace] = []
        self.velocities: List[Tuple[float, float, float]] = []


class TraceObserver(FlightObserver):
    """Takes a trace of a flight."""

    def __init__(self, title: str = "flight"):
        self._title = title
        self._times_s: List[float] = []
        self._positions: List[np.ndarray] = []
        self._quaternions: List[np.ndarray] = []
        self._robots: List[_RobotRecord] = []
        self._flight: Optional[Flight] = None

    def on_start(self, flight: Flight) -> None:
        self._flight = flight
        self._robots = [_RobotRecord() for _ in flight.robots]
        self.on_move(flight)

    def on_move(self, flight: Flight) -> None:
        bodies = flight.simulation.body_state
        self._times_s.append(flight.now_s)
        self._positions.append(bodies.positions_m)
        self._quaternions.append(bodies.quaternions)
        for record, state in zip(self._robots, flight.states):
            twist = state.twist
            record.velocities.append((twist.vx_mps, twist.vy_mps, twist.vyaw_radps))

    def on_action(self, robot: int, now_s: float, action: Action) -> None:
        goals = self._robots[robot].goals
        if isinstance(action, SendGoal) and not action.resend_reason:
            goals.append(GoalTrace(action.index, action.lap, action.pose, now_s))
        elif isinstance(action, GoalEnded):
            last = goals[-1]
            goals[-1] = GoalTrace(
                last.index,
                last.lap,
                last.pose,
                last.sent_s,
                now_s,
                action.reached,
                action.reason,
                action.attempts,
            )

    def on_tick(self, robot: int, tick: Tick, located: RobotPoses, wall_s: float) -> None:
        record, now_s = self._robots[robot], tick.now_s
        if tick.cycle:
            record.cycles.append((now_s, wall_s))
        if tick.command is not None:
            command = tick.command
            record.commands.append((now_s, command.vx_mps, command.vy_mps, command.vyaw_radps))
        if tick.plan is not None:
            record.plans.append((now_s, tick.plan))
        if not record.states or record.states[-1][1] is not tick.state:
            record.states.append((now_s, tick.state))
        if tick.recovery is not None:
            record.recoveries.append((now_s, tick.recovery.name))

    def trace(self, contacts: Tuple[Contact, ...] = (), reason: str = "") -> FlightTrace:
        """What has been seen so far; contacts and reason are the summary's."""
        assert self._flight is not None
        setup = self._flight.setup
        times_s, positions = np.array(self._times_s), np.array(self._positions)
        quaternions = np.array(self._quaternions)
        robots = []
        for k, (record, robot) in enumerate(zip(self._robots, self._flight.robots)):
            commands = np.array(record.commands, dtype=float).reshape(-1, 4)
            cycles = np.array(record.cycles, dtype=float).reshape(-1, 2)
            robots.append(
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
                    tuple(record.goals),
                    robot.configuration.to_tree(),
                )
            )
        return FlightTrace(
            self._title,
            tuple(robots),
            contacts,
            setup.scene,
            setup.robot_radius_m,
            setup.seed,
            setup.config_name,
            versions(),
            reason,
        )
