"""Environments for reinforcement learning, on top of ``api``: ``pip install 'quad-nav[rl]'``.

``QuadEnv`` is a ``gymnasium.Env`` with one quadcopter, ``FleetEnv`` a PettingZoo ``ParallelEnv``
with several. ``docs/python.md`` documents observations, actions and rewards.

Reading order: ``worlds`` (the flights), ``task`` (actions, observations, rewards of one robot),
``fleet`` (the environment of many), and here that of one.
"""

from __future__ import annotations

from types import MappingProxyType
from typing import Any, Dict, Optional, Tuple

import gymnasium
import numpy as np
from numpy.typing import NDArray

from quad_nav.api import lidar_simulation, prepare
from quad_nav.scenario.flight_setup import FlightSetup
from quad_rl.fleet import FleetEnv
from quad_rl.task import VELOCITY, Observation, Progress, Ranges, default_reward

__all__ = ["FleetEnv", "Progress", "QuadEnv", "default_reward"]
_NAME = "quad0"


class QuadEnv(gymnasium.Env[Any, Any]):
    """One quadcopter that flies to its goals.

    Args:
        setup: A mission of one robot, from ``quad_nav.prepare``; by default the first robot of the
            shipped one, with 64 beams.
        action: "velocity", or "parameters" for parameters of move_base.
        parameters: Ranges of these parameters by their paths.
        navigator: Fly with the navigator. It always does with parameters; with velocities it only
            computes ``navigator_action``.
        period_s: Control period, a multiple of 1/40 s.
        time_limit_s: Time after which an episode is truncated.

    Raises:
        ValueError: The set-up has several robots, or an argument is out of range.
    """

    metadata: Dict[str, Any] = {"render_modes": []}

    def __init__(
        self,
        setup: Optional[FlightSetup] = None,
        action: str = VELOCITY,
        parameters: Ranges = MappingProxyType({}),
        navigator: bool = False,
        period_s: float = 0.1,
        time_limit_s: float = 60.0,
    ) -> None:
        if setup is None:
            setup = default_setup()
        if len(setup.robots) != 1:
            raise ValueError(
                f"setup: {len(setup.robots)} robots; expected 1, FleetEnv flies several"
            )
        self._fleet = FleetEnv(setup, action, parameters, navigator, period_s, time_limit_s)
        self._fleet.reward = self._reward  # type: ignore[method-assign]
        self.observation_space = self._fleet.observation_space(_NAME)
        self.action_space = self._fleet.action_space(_NAME)

    def reset(
        self, *, seed: Optional[int] = None, options: Optional[Dict[str, Any]] = None
    ) -> Tuple[Observation, Dict[str, Any]]:
        """Start an episode; see ``FleetEnv.reset``."""
        super().reset(seed=seed)
        observations, infos = self._fleet.reset(seed, options)
        return observations[_NAME], infos[_NAME]

    def step(
        self, action: Optional[NDArray[np.float32]]
    ) -> Tuple[Observation, float, bool, bool, Dict[str, Any]]:
        """Fly for a period; see ``FleetEnv.step``.

        Raises:
            ValueError: The episode has ended, or the action does not fit.
        """
        if not self._fleet.agents:
            raise ValueError("step: there is no episode; expected a call of reset")
        observations, rewards, terminations, truncations, infos = self._fleet.step({_NAME: action})
        return (
            observations[_NAME],
            rewards[_NAME],
            terminations[_NAME],
            truncations[_NAME],
            infos[_NAME],
        )

    def reward(self, progress: Progress) -> float:
        """Return the reward of a step; override it for another one."""
        return default_reward(progress)

    def _reward(self, agent: str, progress: Progress) -> float:
        return self.reward(progress)

    def navigator_action(self) -> Optional[NDArray[np.float64]]:
        """Return what the navigator would fly next; see ``FleetEnv.navigator_action``."""
        return self._fleet.navigator_action(_NAME)

    @property
    def world(self) -> Any:
        """The flight behind the environment, see ``worlds``."""
        return self._fleet.world

    def close(self) -> None:
        """Free the physics engine."""
        self._fleet.close()


def default_setup(robots: int = 1, beams: int = 64) -> FlightSetup:
    """Return the shipped mission of one or two robots, with LIDARs of few beams."""
    return prepare(robots=robots, simulation=lidar_simulation(beams, jitter_m=0.3))
