"""Actions, observations and rewards of one robot, for both environments."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple

import gymnasium
import numpy as np
from numpy.typing import NDArray

from quad_nav.api.flight import Command
from quad_nav.errors import InputError
from quad_nav.mission.goal_file import GoalSequence, parse_goals
from quad_nav.scenario.flight_setup import FlightSetup
from quad_nav.sim.flight import BodyState
from quad_rl.worlds import World

VELOCITY, PARAMETERS = "velocity", "parameters"
ACTIONS = (VELOCITY, PARAMETERS)
Observation = Dict[str, NDArray[np.float32]]
Ranges = Mapping[str, Tuple[float, float]]
"""Range of each parameter by its path, as {"DWAPlannerROS/max_vel_x": (0.1, 0.6)}."""
_FASTER = 1.5
"""Bound of measured velocities over that of commanded ones: tilted bodies overshoot."""


@dataclass(frozen=True)
class Progress:
    """Changes of a robot in one step; rewards are computed from them.

    Attributes:
        approach_m: Decrease of the distance to the goal, 0 if the goal changed.
        reached: Number of goals that it reached.
        contacts: Number of its contacts that began.
        is_done: All its goals have ended.
    """

    approach_m: float
    reached: int
    contacts: int
    is_done: bool

    @property
    def info(self) -> Dict[str, Any]:
        """The environments' ``info``: goals reached and contacts of the step."""
        return {"reached": self.reached, "contacts": self.contacts}


def default_reward(progress: Progress) -> float:
    """Return 1 per metre towards the goal, 10 per goal reached, -10 per contact, -0.01 per step."""
    return (progress.approach_m + 10.0 * progress.reached - 10.0 * progress.contacts) - 0.01


def check_action(action: str, parameters: Ranges) -> None:
    """Refuse an action that does not exist, or parameters that do not fit to it.

    Raises:
        ValueError: The action is unknown, or parameters are given for velocities.
    """
    if action not in ACTIONS:
        raise ValueError(f"action: {action!r}; expected {' or '.join(map(repr, ACTIONS))}")
    if (action == PARAMETERS) != bool(parameters):
        raise ValueError(
            f"parameters: {dict(parameters)} with action {action!r}; expected ranges of "
            f"move_base's parameters with action {PARAMETERS!r}, none otherwise"
        )


def action_space(setup: FlightSetup, parameters: Ranges) -> gymnasium.spaces.Box:
    """Return the bounds of velocities (vx, vy, vyaw) in ``base_link``, or of the parameters."""
    if parameters:
        bounds = np.array(list(parameters.values()), np.float32)
        return gymnasium.spaces.Box(bounds[:, 0], bounds[:, 1], dtype=np.float32)
    flight = setup.simulation.flight
    high = np.array(
        [flight.max_speed_mps, flight.max_speed_mps, flight.max_yaw_rate_radps], np.float32
    )
    return gymnasium.spaces.Box(-high, high, dtype=np.float32)


def observation_space(setup: FlightSetup) -> gymnasium.spaces.Dict:
    """Return the bounds of ``observe``'s arrays."""
    scene, lidar = setup.scene, setup.simulation.lidar
    diagonal_m = math.hypot(scene.size_x_m, scene.size_y_m)
    fastest = _FASTER * action_space(setup, {}).high
    return gymnasium.spaces.Dict(
        {
            "lidar": _box([0.0] * lidar.beam_count, [lidar.range_max_m] * lidar.beam_count),
            "pose": _box(
                [scene.origin_x_m, scene.origin_y_m, -math.pi],
                [scene.end_x_m, scene.end_y_m, math.pi],
            ),
            "velocity": _box(-fastest, fastest),
            "goal": _box([-diagonal_m] * 2, [diagonal_m] * 2),
        }
    )


def _box(low: Any, high: Any) -> gymnasium.spaces.Box:
    return gymnasium.spaces.Box(
        np.asarray(low, np.float32), np.asarray(high, np.float32), dtype=np.float32
    )


class Observer:
    """Makes observations, clipped to the bounds of ``observation_space``."""

    def __init__(self, setup: FlightSetup, space: gymnasium.spaces.Dict) -> None:
        self._range_max_m = np.float32(setup.simulation.lidar.range_max_m)
        state = ("pose", "velocity", "goal")
        self._low = np.concatenate([space[name].low for name in state])  # type: ignore[attr-defined]
        self._high = np.concatenate([space[name].high for name in state])  # type: ignore[attr-defined]

    def observe(self, world: World, robots: Sequence[int]) -> List[Observation]:
        """Return the observations of some robots."""
        bodies = world.bodies()
        return [
            {"lidar": np.minimum(ranges, self._range_max_m), **self._state(world, bodies, robot)}
            for robot, ranges in zip(robots, world.ranges(robots))
        ]

    def _state(self, world: World, bodies: BodyState, robot: int) -> Observation:
        x, y, _, _, _, _, _, vx, vy, vz, wx, wy, wz = bodies.rows[robot].tolist()
        (xx, yx, zx), (xy, yy, zy), (xz, yz, zz) = bodies.rotations[robot].tolist()
        goal = world.goal(robot)
        dx, dy = (0.0, 0.0) if goal is None else (goal.x_m - x, goal.y_m - y)
        length = math.hypot(xx, xy) or 1.0
        cos, sin = xx / length, xy / length
        row = np.array(
            [
                x,
                y,
                math.atan2(xy, xx),
                xx * vx + xy * vy + xz * vz,
                yx * vx + yy * vy + yz * vz,
                zx * wx + zy * wy + zz * wz,
                cos * dx + sin * dy,
                cos * dy - sin * dx,
            ],
            np.float32,
        )
        row = np.minimum(np.maximum(row, self._low), self._high)
        return {"pose": row[:3], "velocity": row[3:6], "goal": row[6:]}


def command_of(action: Any, robot: int) -> Command:
    """Return the velocity of an action, exactly.

    Raises:
        ValueError: It has not three numbers.
    """
    values = np.asarray(action).tolist()
    if not isinstance(values, list) or len(values) != 3:
        raise ValueError(f"quad{robot}: action {action!r}; expected (vx, vy, vyaw), m/s and rad/s")
    return Command(*values)


def goal_distance_m(world: World, robot: int) -> Optional[float]:
    """Return a robot's distance to its goal, None after the last one."""
    goal = world.goal(robot)
    if goal is None:
        return None
    row = world.bodies().rows[robot]
    return math.hypot(goal.x_m - row[0], goal.y_m - row[1])


def sequences_of(
    setup: FlightSetup, options: Optional[Mapping[str, Any]]
) -> Tuple[GoalSequence, ...]:
    """Return the goals of an episode: those of ``options["goals"]`` or of the set-up.

    Raises:
        InputError: The goals have faults, or are not those of each robot.
    """
    if not options or "goals" not in options:
        return tuple(robot.sequence for robot in setup.robots)
    given = options["goals"]
    if len(given) != len(setup.robots):
        raise InputError(
            [f"options: goals of {len(given)} robots; expected {len(setup.robots)}, the robots"]
        )
    return tuple(
        parse_goals(json.dumps({"goals": goals}), f"options: quad{number}")
        for number, goals in enumerate(given)
    )
