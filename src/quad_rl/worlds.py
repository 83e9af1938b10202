"""The flights behind the environments: bodies alone, or with the navigators.

Both advance by a control period at a time and have the same methods.
"""

from __future__ import annotations

from dataclasses import replace
from typing import List, Mapping, Optional, Sequence, Union

import numpy as np
from numpy.typing import NDArray

from quad_nav.api.flight import PERIOD_S, Command, Flight, periods
from quad_nav.geometry import Pose2D
from quad_nav.mission.actions import Action, GoalEnded
from quad_nav.mission.goal_file import GoalSequence
from quad_nav.mission.sequencer import Sequencer
from quad_nav.offline.flight import FlightObserver
from quad_nav.scenario.flight_setup import FlightSetup
from quad_nav.sim.contacts import Contact
from quad_nav.sim.flight import BodyState
from quad_nav.sim.simulation import Simulation
from quad_nav.sim.simulation_params import STEPS_PER_ODOMETRY

Commands = Mapping[int, Optional[Command]]


class BodyWorld:
    """Quadcopters without navigators; resets keep the engine and cost little.

    Attributes:
        contacts: Contacts that began in the last step.
        reached: Numbers of the robots that reached a goal in the last step, once for each goal.
    """

    def __init__(self, setup: FlightSetup, period_s: float) -> None:
        self._steps = periods(period_s, setup.simulation.command_timeout_s) * STEPS_PER_ODOMETRY
        self._simulation = Simulation(setup.scene, len(setup.robots), setup.simulation, setup.seed)
        self._sequencers: List[Sequencer] = []
        self.contacts: Sequence[Contact] = ()
        self.reached: Sequence[int] = ()

    def reset(self, seed: int, sequences: Sequence[GoalSequence]) -> None:
        """Start again, with other goals and a seed for jitter and noise."""
        self._simulation.reset(seed, start_step=0)
        self._sequencers = [Sequencer(sequence) for sequence in sequences]
        self.contacts = ()
        self._sequence()

    def step(self, commands: Commands) -> None:
        """Fly for a period; see ``api.Flight.step``."""
        for robot, command in commands.items():
            if command is not None:
                self._simulation.set_command(robot, command)
        self.contacts = self._simulation.advance(self._steps)
        self._sequence()

    def _sequence(self) -> None:
        bodies, now_s = self.bodies(), self.now_s()
        yaws_rad = np.arctan2(bodies.rotations[:, 1, 0], bodies.rotations[:, 0, 0]).tolist()
        poses = [
            Pose2D(x_m, y_m, yaw_rad)
            for (x_m, y_m), yaw_rad in zip(bodies.rows[:, :2].tolist(), yaws_rad)
        ]
        self.reached = [
            robot
            for robot, (sequencer, pose) in enumerate(zip(self._sequencers, poses))
            for action in sequencer.tick(now_s, pose, (), False)
            if isinstance(action, GoalEnded) and action.reached
        ]

    def bodies(self) -> BodyState:
        """Return the state of all quadcopters in ``map``."""
        return self._simulation.body_state

    def ranges(self, robots: Sequence[int]) -> List[NDArray[np.float32]]:
        """Return the ranges of the last scan of some robots, float32[beams] each, +inf for none."""
        return [scan.ranges_m for scan in self._simulation.scans(robots)]

    def goal(self, robot: int) -> Optional[Pose2D]:
        """Return the goal that a robot flies to; None after the last."""
        active = self._sequencers[robot].active_goal
        return None if active is None else active.pose

    def is_done(self, robot: int) -> bool:
        """Return whether all goals of a robot have ended."""
        return self._sequencers[robot].done

    def now_s(self) -> float:
        """Return the simulated time since the start."""
        return self._simulation.now_s

    def close(self) -> None:
        """Free the physics engine."""
        self._simulation.close()


class NavigatorWorld(FlightObserver):
    """Quadcopters with their navigators; every reset makes new ones. See ``BodyWorld``."""

    def __init__(self, setup: FlightSetup, period_s: float) -> None:
        self._setup, self._period_s = setup, period_s
        periods(period_s, setup.simulation.command_timeout_s)
        self._flight: Optional[Flight] = None
        self.contacts: Sequence[Contact] = ()
        self.reached: List[int] = []

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
        """Start again; the first goals are sent after 1/40 s."""
        self.close()
        robots = tuple(
            replace(robot, sequence=sequence)
            for robot, sequence in zip(self._setup.robots, sequences)
        )
        setup = replace(self._setup, seed=seed, robots=robots)
        self._flight = Flight(setup, self._period_s, observers=[self])
        self.contacts, self.reached = (), []

    def step(self, commands: Commands) -> None:
        """See ``BodyWorld``."""
        known, self.reached = len(self.flight.contacts), []
        self.flight.step(commands)
        self.contacts = self.flight.contacts[known:]

    def on_action(self, robot: int, now_s: float, action: Action) -> None:
        """Note a goal that is reached."""
        if isinstance(action, GoalEnded) and action.reached:
            self.reached.append(robot)

    def bodies(self) -> BodyState:
        """See ``BodyWorld``."""
        return self.flight.bodies

    def ranges(self, robots: Sequence[int]) -> List[NDArray[np.float32]]:
        """See ``BodyWorld``."""
        return [self.flight.scan(robot).ranges_m for robot in robots]

    def goal(self, robot: int) -> Optional[Pose2D]:
        """See ``BodyWorld``."""
        if self.flight.now_s < PERIOD_S:
            return self._setup.robots[robot].sequence.goals[0].pose
        return self.flight.goal(robot)

    def is_done(self, robot: int) -> bool:
        """See ``BodyWorld``."""
        return self.flight.has_ended(robot)

    def now_s(self) -> float:
        """Return the simulated time."""
        return self.flight.now_s

    def close(self) -> None:
        """End the flight."""
        if self._flight is not None:
            self._flight.close()


World = Union[BodyWorld, NavigatorWorld]
