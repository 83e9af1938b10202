"""The environment of a fleet: a PettingZoo ``ParallelEnv``."""

from __future__ import annotations

from types import MappingProxyType
from typing import Any, Dict, List, Mapping, Optional, Tuple

import gymnasium
import numpy as np
from gymnasium.utils import seeding
from numpy.typing import NDArray
from pettingzoo import ParallelEnv

from quad_nav.api.flight import Command
from quad_nav.scenario.flight_setup import FlightSetup
from quad_rl.task import (
    PARAMETERS,
    VELOCITY,
    Observation,
    Observer,
    Progress,
    Ranges,
    action_space,
    check_action,
    command_of,
    default_reward,
    goal_distance_m,
    observation_space,
    sequences_of,
)
from quad_rl.worlds import BodyWorld, NavigatorWorld, World

_HOVER = Command(0.0, 0.0, 0.0)
Action = Optional[NDArray[np.float32]]
Infos = Dict[str, Dict[str, Any]]


class FleetEnv(ParallelEnv):
    """Quadcopters "quad0", "quad1", ... that fly to their goals.

    An agent terminates after its last goal, or with its first contact; its quadcopter hovers from
    then on.

    Args:
        setup: The mission, from ``quad_nav.prepare``.
        action: "velocity", or "parameters" for parameters of move_base.
        parameters: Ranges of these parameters by their paths.
        navigator: Fly with the navigators. They always fly with parameters; with velocities they
            only compute ``navigator_action``.
        period_s: Control period, a multiple of 1/40 s.
        time_limit_s: Time after which an episode is truncated.

    Raises:
        ValueError: An argument is out of range.
    """

    metadata: Dict[str, Any] = {
        "name": "quad_fleet_v0",
        "render_modes": [],
        "is_parallelizable": True,
    }

    def __init__(
        self,
        setup: FlightSetup,
        action: str = VELOCITY,
        parameters: Ranges = MappingProxyType({}),
        navigator: bool = False,
        period_s: float = 0.1,
        time_limit_s: float = 60.0,
    ) -> None:
        check_action(action, parameters)
        self._setup, self._time_limit_s = setup, time_limit_s
        self._parameters = tuple(parameters)
        self.possible_agents: List[str] = [robot.name for robot in setup.robots]
        self.agents: List[str] = []
        self._numbers = {name: number for number, name in enumerate(self.possible_agents)}
        navigator = navigator or action == PARAMETERS
        self.world: World = (NavigatorWorld if navigator else BodyWorld)(setup, period_s)
        space = observation_space(setup)
        self._observer = Observer(setup, space)
        self._observation_spaces = dict.fromkeys(self.possible_agents, space)
        self._action_spaces = {
            name: action_space(setup, parameters) for name in self.possible_agents
        }
        self._in_force: Dict[str, List[float]] = {}
        self._distances_m: List[Optional[float]] = []
        self._random: Optional[np.random.Generator] = None

    def observation_space(self, agent: str) -> gymnasium.spaces.Dict:
        """Return the bounds of an agent's observations."""
        return self._observation_spaces[agent]

    def action_space(self, agent: str) -> gymnasium.spaces.Box:
        """Return the bounds of an agent's actions."""
        return self._action_spaces[agent]

    def reset(
        self, seed: Optional[int] = None, options: Optional[Mapping[str, Any]] = None
    ) -> Tuple[Dict[str, Observation], Infos]:
        """Start an episode.

        Args:
            seed: Seed of this episode's starts and noise, as that of ``quad fly``; the seeds of the
                next episodes follow from it. Without one they follow from the last seed given.
            options: {"goals": list of goals for each robot} for other goals in this episode.

        Raises:
            InputError: The options have faults.
        """
        sequences = sequences_of(self._setup, options)
        if seed is not None or self._random is None:
            self._random, known = seeding.np_random(seed)
            seed = known if seed is None else seed
            seed %= 2**32
        else:
            seed = int(self._random.integers(2**32))
        self.world.reset(int(seed), sequences)
        self.agents = list(self.possible_agents)
        self._in_force = {}
        self._distances_m = [goal_distance_m(self.world, k) for k in self._numbers.values()]
        return self._observations(), {name: {} for name in self.agents}

    def step(
        self, actions: Mapping[str, Action]
    ) -> Tuple[Dict[str, Observation], Dict[str, float], Dict[str, bool], Dict[str, bool], Infos]:
        """Fly for a period.

        Args:
            actions: Each agent's action. Numbers are flown as they are, also in float64. With None
                the robot flies as its navigator commands, or keeps its last command without one.

        Raises:
            ValueError: An action has not the right size, or is not finite.
        """
        commands: Dict[int, Optional[Command]] = {}
        for name, robot in self._numbers.items():
            if name not in self.agents:
                commands[robot] = _HOVER
            elif actions[name] is not None:
                self._act(name, robot, actions[name], commands)
        self.world.step(commands)
        flown, is_late = self.agents, self.world.now_s() >= self._time_limit_s
        progress = {name: self._progress(self._numbers[name]) for name in flown}
        observations = self._observations()
        terminations = {name: one.is_done or one.contacts > 0 for name, one in progress.items()}
        self.agents = [name for name in flown if not (terminations[name] or is_late)]
        return (
            observations,
            {name: self.reward(name, one) for name, one in progress.items()},
            terminations,
            dict.fromkeys(flown, is_late),
            {name: one.info for name, one in progress.items()},
        )

    def reward(self, agent: str, progress: Progress) -> float:
        """Return the reward of an agent's step; override it for another one."""
        return default_reward(progress)

    def navigator_action(self, agent: str) -> Optional[NDArray[np.float64]]:
        """Return the velocity, float64[3], that an agent's navigator would fly next.

        None if it has sent no command in the last period.

        Raises:
            ValueError: The environment flies without navigators.
        """
        if not isinstance(self.world, NavigatorWorld):
            raise ValueError("navigator_action: there are no navigators; expected navigator=True")
        command = self.world.flight.navigator_command(self._numbers[agent])
        if command is None:
            return None
        return np.array([command.vx_mps, command.vy_mps, command.vyaw_radps])

    def close(self) -> None:
        """Free the physics engine."""
        self.world.close()

    def _act(
        self, name: str, robot: int, action: Any, commands: Dict[int, Optional[Command]]
    ) -> None:
        """Add the command of an action, or change the parameters that it has."""
        if not self._parameters:
            commands[robot] = command_of(action, robot)
            return
        values = np.asarray(action, float).tolist()
        if len(values) != len(self._parameters):
            raise ValueError(f"{name}: action {action!r}; expected {len(self._parameters)} values")
        if values != self._in_force.get(name):
            assert isinstance(self.world, NavigatorWorld)
            self.world.flight.reconfigure(robot, dict(zip(self._parameters, values)))
            self._in_force[name] = values

    def _progress(self, robot: int) -> Progress:
        before_m, now_m = self._distances_m[robot], goal_distance_m(self.world, robot)
        reached = list(self.world.reached).count(robot)
        self._distances_m[robot] = now_m
        is_same = not reached and before_m is not None and now_m is not None
        name = self.possible_agents[robot]
        return Progress(
            before_m - now_m if is_same else 0.0,  # type: ignore[operator]
            reached,
            sum(contact.involves(name) for contact in self.world.contacts),
            self.world.is_done(robot),
        )

    def _observations(self) -> Dict[str, Observation]:
        robots = [self._numbers[name] for name in self.agents]
        return dict(zip(self.agents, self._observer.observe(self.world, robots)))
