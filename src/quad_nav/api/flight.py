"""A flight that is advanced step by step, with commands of the caller."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.api.result import FlightResult, TrajectoryObserver
from quad_nav.config import Configuration, updated
from quad_nav.geometry import Pose2D, Scan, Twist2D
from quad_nav.navigator.tick import Tick
from quad_nav.offline import flight as offline
from quad_nav.offline.run import summary_of
from quad_nav.scenario.flight_setup import FlightSetup
from quad_nav.sim.contacts import Contact
from quad_nav.sim.flight import BodyState
from quad_nav.sim.robot_state import RobotState
from quad_nav.sim.simulation_params import STEPS_PER_ODOMETRY, STEPS_PER_S

Command = Twist2D
"""Velocity in ``base_link``: ``Command(vx_mps, vy_mps, vyaw_radps)``."""
PERIOD_S = STEPS_PER_ODOMETRY / STEPS_PER_S
"""Shortest step of a flight, 1/40 s: the period of odometry."""
NO_COMMANDS: Mapping[int, Optional[Command]] = {}


@dataclass(frozen=True)
class Observation:
    """Knowledge of a robot at an instant.

    Attributes:
        time_s: Simulated time.
        scan: The last scan of the LIDAR; its ``stamp_s`` is the time at which it was taken.
        pose: Pose of ``base_link`` in ``map``.
        velocity: Velocity in ``base_link``.
        goal: The goal that the robot flies to, in ``map``; None before the first and after the
            last one.
        contacts: The robot's contacts so far.
    """

    time_s: float
    scan: Scan
    pose: Pose2D
    velocity: Command
    goal: Optional[Pose2D]
    contacts: Tuple[Contact, ...]


class Flight:
    """A mission that the caller advances; use it in a ``with`` statement.

    Each robot has its navigator, as in ``fly``. A command in ``step`` replaces that of the robot's
    navigator for this step. With the navigators' own commands the flight is that of ``fly``, bit
    for bit.

    Args:
        setup: The mission, from ``prepare``.
        period_s: Length of a step, a multiple of 1/40 s, at most the time after which a robot
            without commands hovers.
        navigators: False for a flight on commands of the caller alone, which is much faster.
        observers: Called as the flight goes on.

    Raises:
        ValueError: ``period_s`` is no such multiple.
    """

    def __init__(
        self,
        setup: FlightSetup,
        period_s: float = PERIOD_S,
        navigators: bool = True,
        observers: Sequence[offline.FlightObserver] = (),
    ) -> None:
        self._periods = periods(period_s, setup.simulation.command_timeout_s)
        self._record = _Record()
        self._is_closed = False
        self._start_wall_s = time.perf_counter()
        self._loop = _Loop(setup, [self._record, *observers], navigators)

    def step(self, commands: Mapping[int, Optional[Command]] = NO_COMMANDS) -> None:
        """Fly for one period.

        Args:
            commands: Robot's number -> velocity to fly instead of its navigator's; limited as every
                command is. With None the robot keeps its last command, and hovers once that is too
                old. Robots that are not listed fly as their navigators command.

        Raises:
            ValueError: A command is not finite, the robot does not exist, or the flight is closed.
        """
        if self._is_closed:
            raise ValueError("step: the flight is closed; expected a new Flight")
        unknown = sorted(set(commands) - set(range(len(self._loop.robots))))
        if unknown:
            raise ValueError(
                f"step: commands for robots {unknown}; expected 0 to {len(self._loop.robots) - 1}"
            )
        self._loop.navigator_commands = {}
        for _ in range(self._periods):
            self._loop.begin_period(commands)
            self._loop.advance()

    def observe(self, robot: int) -> Observation:
        """Return a robot's scan, pose, velocity, goal and contacts of now."""
        state = self.state(robot)
        return Observation(
            self.now_s,
            self.scan(robot),
            state.map_from_base.to_2d(),
            state.twist,
            self.goal(robot),
            tuple(one for one in self._loop.contacts if one.involves(f"quad{robot}")),
        )

    def scan(self, robot: int) -> Scan:
        """Return the last scan; without navigators it is taken when it is asked for."""
        if not self._loop.has_navigators:
            return self._loop.simulation.scan(robot)
        return self._record.scans[robot]

    def state(self, robot: int) -> RobotState:
        """Return a robot's pose and velocities in three dimensions."""
        return self._loop.states[robot]

    def goal(self, robot: int) -> Optional[Pose2D]:
        """Return the goal that a robot flies to, in ``map``."""
        active = self._loop.robots[robot].sequencer.active_goal
        return None if active is None else active.pose

    def navigator_command(self, robot: int) -> Optional[Command]:
        """Return the command of a robot's navigator for the next step, None if it sent none."""
        return self._loop.navigator_commands.get(robot)

    def reconfigure(self, robot: int, parameters: Mapping[str, Any]) -> Configuration:
        """Change parameters of a robot's navigator, as dynamic_reconfigure does.

        Args:
            robot: Number of the robot.
            parameters: Values by path, as {"DWAPlannerROS/max_vel_x": 0.4}, clamped to the
                parameters' ranges.

        Returns:
            The configuration in force.

        Raises:
            InputError: Every change that is refused; then nothing is changed.
            ValueError: The robot has no navigator.
        """
        if robot not in self._loop.offline_robots:
            raise ValueError(
                f"reconfigure: robot {robot} has no navigator; expected one of"
                f" {sorted(self._loop.offline_robots)}"
            )
        configuration = self._loop.robots[robot].configuration
        groups: Dict[str, Dict[str, Any]] = {}
        for path, value in parameters.items():
            namespace, _, name = path.rpartition("/")
            groups.setdefault(namespace, {})[name] = value
        for namespace, changes in groups.items():
            configuration = updated(configuration, namespace, changes)
        self._loop.reconfigure(robot, configuration)
        return configuration

    @property
    def now_s(self) -> float:
        """Simulated time."""
        return self._loop.now_s

    @property
    def positions_m(self) -> NDArray[np.float64]:
        """Positions float64[n, 3] in ``map``."""
        return self._loop.simulation.body_state.positions_m.copy()

    @property
    def bodies(self) -> BodyState:
        """Poses and velocities of all robots in ``map``, as arrays that must not be changed."""
        return self._loop.simulation.body_state

    def has_ended(self, robot: int) -> bool:
        """Return whether every goal of a robot has ended."""
        return self._loop.robots[robot].sequencer.done

    @property
    def contacts(self) -> List[Contact]:
        """All contacts, oldest first."""
        return list(self._loop.contacts)

    @property
    def is_done(self) -> bool:
        """True when every goal of every robot has ended, or time is up."""
        return self._loop.is_done or self._loop.now_s >= self._loop.setup.time_limit_s

    def result(self) -> FlightResult:
        """Return summary and trajectories of the flight so far, also after ``close``."""
        loop, limit_s = self._loop, self._loop.setup.time_limit_s
        is_late = loop.now_s >= limit_s and not loop.is_done
        reason = f"time limit of {limit_s:g} s" if is_late else ""
        summary = summary_of(loop, reason, time.perf_counter() - self._start_wall_s)
        return FlightResult(summary, self._record.trajectories())

    def close(self) -> None:
        """Free the physics engine; a second call does nothing."""
        if not self._is_closed:
            self._is_closed = True
            self._loop.end()

    def __enter__(self) -> Flight:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def periods(period_s: float, timeout_s: float) -> int:
    """Return how many periods of odometry a step lasts.

    Raises:
        ValueError: It is no whole number, or commands time out within a step.
    """
    count = round(period_s / PERIOD_S)
    if count < 1 or abs(count * PERIOD_S - period_s) > 1e-9 or period_s > timeout_s:
        raise ValueError(
            f"period_s: {period_s}; expected a multiple of {PERIOD_S} s, at most {timeout_s} s"
        )
    return count


class _Record(TrajectoryObserver):
    """Keeps the last scans too; they are complete in a single process only."""

    needs_single_process = True

    def __init__(self) -> None:
        super().__init__()
        self.scans: Dict[int, Scan] = {}

    def on_scan(self, robot: int, scan: Scan, map_from_lidar: Any) -> None:
        self.scans[robot] = scan


class _Loop(offline.Flight):
    """The loop of ``offline``, with the navigators' commands held back until the next period."""

    def __init__(
        self,
        setup: FlightSetup,
        observers: Sequence[offline.FlightObserver],
        navigators: bool,
    ) -> None:
        self.has_navigators = navigators
        self.navigator_commands: Dict[int, Command] = {}
        super().__init__(setup, observers, navigators=navigators)
        self._pending: Dict[int, Command] = {}

    def begin_period(self, commands: Mapping[int, Optional[Command]]) -> None:
        """Hand the commands of the caller to the simulation, for the others their navigators'."""
        for robot, command in {**self._pending, **commands}.items():
            if command is not None:
                self.simulation.set_command(robot, command)
        self._pending = {}

    def command(self, robot: int, tick: Tick) -> None:
        """Hold a navigator's command back."""
        if tick.command is not None:
            self._pending[robot] = self.navigator_commands[robot] = tick.command
