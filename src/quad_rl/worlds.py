"""The flights behind the environments: bodies alone, or with the navigators.

Both advance by a control period at a time and have the same methods.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import List, Mapping, Optional, Protocol, Sequence

import numpy as np
from numpy.typing import NDArray

from quad_nav.api.flight import PERIOD_S, Command, Flight, periods
from quad_nav.geometry import Pose2D
from quad_nav.loop.flight_loop import STEPS_PER_ODOMETRY
from quad_nav.mission.actions import Action, GoalEnded
from quad_nav.mission.goal_file import GoalSequence
from quad_nav.mission.sequencer import Sequencer
from quad_nav.offline.flight import FlightObserver
from quad_nav.scenario.flight_setup import FlightSetup
from quad_nav.sim.contacts import Contact
from quad_nav.sim.flight import BodyState
from quad_nav.sim.simulation import Simulation

Commands = Mapping[int, Optional[Command]]


class World(Protocol):
    """Quadcopters that fly their goals.

    Attributes:
        contacts: Contacts that began in the last step.
        reached: Numbers of the robots that reached a goal in the last step, once for each goal.
    """

    contacts: Sequence[Contact]
    reached: Sequence[int]

    def reset(self, seed: int, sequences: Sequence[GoalSequence]) -> None:
        """Start again, with other goals and a seed for jitter and noise."""

    def step(self, commands: Commands) -> None:
        """Fly for a period; see ``api.Flight.step``."""

    def bodies(self) -> BodyState:
        """Return the state of all quadcopters in ``map``."""

    def ranges(self, robots: Sequence[int]) -> List[NDArray[np.float32]]:
        """Return the ranges of the last scan of some robots, float32[beams] each, +inf for none."""

    def goal(self, robot: int) -> Optional[Pose2D]:
        """Return the goal that a robot flies to; None after the last."""

    def is_done(self, robot: int) -> bool:
        """Return whether all goals of a robot have ended."""

    def now_s(self) -> float:
        """Return the simulated time since the start."""

    def close(self) -> None:
        """Free the physics engine."""


class BodyWorld:
    """Quadcopters without navigators; resets keep the engine and cost little."""

    def __init__(self, setup: FlightSetup, period_s: float) -> None:
        self._setup = setup
        self._steps = periods(period_s, setup.simulation.command_timeout_s) * STEPS_PER_ODOMETRY
        self.simulation = Simulation(setup.scene, len(setup.robots), setup.simulation, setup.seed)
        self._sequencers: List[Sequencer] = []
        self.contacts: Sequence[Contact] = ()
        self.reached: Sequence[int] = ()

    def reset(self, seed: int, sequences: Sequence[GoalSequence]) -> None:
        """Start again; see ``World.reset``."""
        self.simulation.reset(seed, start_step=0)
        self._sequencers = [Sequencer(sequence) for sequence in sequences]
        self.contacts = ()
        self._sequence()

    def step(self, commands: Commands) -> None:
        """Fly for a period; see ``World.step``."""
        for robot, command in commands.items():
            if command is not None:
                self.simulation.set_command(robot, command)
        self.contacts = self.simulation.advance(self._steps)
        self._sequence()

    def _sequence(self) -> None:
        bodies, now_s = self.bodies(), self.simulation.now_s
        reached = []
        for robot, (sequencer, row) in enumerate(zip(self._sequencers, bodies.rows)):
            pose = Pose2D(float(row[0]), float(row[1]), _yaw_rad(bodies, robot))
            for action in sequencer.tick(now_s, pose, (), False):
                if isinstance(action, GoalEnded) and action.reached:
                    reached.append(robot)
        self.reached = reached

    def bodies(self) -> BodyState:
        """Return the state; see ``World.bodies``."""
        return self.simulation.body_state

    def ranges(self, robots: Sequence[int]) -> List[NDArray[np.float32]]:
        """Take scans; see ``World.ranges``."""
        return [scan.ranges_m for scan in self.simulation.scans(robots)]

    def goal(self, robot: int) -> Optional[Pose2D]:
        """Return the goal; see ``World.goal``."""
        active = self._sequencers[robot].active_goal
        return None if active is None else active.pose

    def is_done(self, robot: int) -> bool:
        """Return whether all goals have ended; see ``World.is_done``."""
        return self._sequencers[robot].done

    def now_s(self) -> float:
        """Return the simulated time."""
        return self.simulation.now_s

    def close(self) -> None:
        """Free the physics engine."""
        self.simulation.close()


class NavigatorWorld:
    """Quadcopters with their navigators; every reset makes new ones."""

    def __init__(self, setup: FlightSetup, period_s: float) -> None:
        self._setup, self._period_s = setup, period_s
        periods(period_s, setup.simulation.command_timeout_s)
        self._flight: Optional[Flight] = None
        self._ended = _EndedGoals()
        self.contacts: Sequence[Contact] = ()
        self.reached: Sequence[int] = ()

    @property
    def flight(self) -> Flight:
        """The flight since the last reset.

        Raises:
            ValueError: There was no reset yet.
        """
        if self._flight is None:
            raise ValueError("there is no flight yet; expected a call of reset")
        return self._flight

    def reset(self, seed: int, sequences: Sequence[GoalSequence]) -> None:
        """Start again; see ``World.reset``. The first goals are sent after 1/40 s."""
        self.close()
        robots = tuple(
            replace(robot, sequence=sequence)
            for robot, sequence in zip(self._setup.robots, sequences)
        )
        self._ended = _EndedGoals()
        setup = replace(self._setup, seed=seed, robots=robots)
        self._flight = Flight(setup, self._period_s, observers=[self._ended])
        self.contacts, self.reached = (), ()

    def step(self, commands: Commands) -> None:
        """Fly for a period; see ``World.step``."""
        flight, known = self.flight, len(self.flight.contacts)
        self._ended.reached = []
        flight.step(commands)
        self.contacts, self.reached = flight.contacts[known:], self._ended.reached

    def bodies(self) -> BodyState:
        """Return the state; see ``World.bodies``."""
        return self.flight.bodies

    def ranges(self, robots: Sequence[int]) -> List[NDArray[np.float32]]:
        """Return the last scans; see ``World.ranges``."""
        return [self.flight.scan(robot).ranges_m for robot in robots]

    def goal(self, robot: int) -> Optional[Pose2D]:
        """Return the goal; see ``World.goal``."""
        if self.flight.now_s < PERIOD_S:
            return self._setup.robots[robot].sequence.goals[0].pose
        return self.flight.goal(robot)

    def is_done(self, robot: int) -> bool:
        """Return whether all goals have ended; see ``World.is_done``."""
        return self.flight.has_ended(robot)

    def now_s(self) -> float:
        """Return the simulated time."""
        return self.flight.now_s

    def close(self) -> None:
        """End the flight."""
        if self._flight is not None:
            self._flight.close()


class _EndedGoals(FlightObserver):
    """Keeps which robots reached goals."""

    def __init__(self) -> None:
        self.reached: List[int] = []

    def on_action(self, robot: int, now_s: float, action: Action) -> None:
        if isinstance(action, GoalEnded) and action.reached:
            self.reached.append(robot)


def _yaw_rad(bodies: BodyState, robot: int) -> float:
    rotations = bodies.rotations
    return math.atan2(rotations[robot, 1, 0], rotations[robot, 0, 0])
