"""The simulated quadcopters: commands in, poses, scans and contacts out.

Time is counted in whole steps of 1/240 s. Equal arguments and equal calls give
equal results, bit for bit.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import List, Optional, Sequence, Tuple

import numpy as np

from quad_nav.errors import InputError
from quad_nav.geometry import Pose2D, Pose3D, Scan, Twist2D, rotate
from quad_nav.sim.body import GoalSphere, World
from quad_nav.sim.casters import Lidars, WorldCaster, kernel_lidars
from quad_nav.sim.contacts import Contact, ContactLog
from quad_nav.sim.flight import Airframe, BodyState, FlightLaw, FlightParams, limit_command
from quad_nav.sim.free_flight import FreeFlight
from quad_nav.sim.lidar import LidarParams
from quad_nav.sim.scene import BODY_RADIUS_M, Scene

STEPS_PER_S = 240
STEP_S = 1.0 / STEPS_PER_S
LIDAR_CASTERS = ("kernel", "bullet")
_STEPS_NEAR = 12
"""Who is near to something mostly stays so for a while; asking less often is cheaper."""
_START_GAP_M = 0.05
_START_TRIES = 1000


@dataclass(frozen=True)
class SimulationParams:
    """Everything but the scene and the number of quadcopters.

    Commands count for ``command_timeout_s + controller_period_s`` after they
    arrive, then a quadcopter hovers. Starts are displaced at random by up to
    ``jitter_m``. ``lidar_caster`` is who finds what beams hit, see ``casters``: the
    "kernel" or the physics engine, "bullet".
    """

    lidar: LidarParams = field(default_factory=LidarParams)
    flight: FlightParams = field(default_factory=FlightParams)
    airframe: Airframe = field(default_factory=Airframe)
    command_timeout_s: float = 0.5
    controller_period_s: float = 0.05
    jitter_m: float = 0.0
    lidar_caster: str = "kernel"

    def __post_init__(self) -> None:
        problems = [
            f"{name}: {value}, expected {unit}, 0 or more"
            for name, value, unit in [
                ("command_timeout", self.command_timeout_s, "seconds"),
                ("controller_period", self.controller_period_s, "seconds"),
                ("jitter", self.jitter_m, "metres"),
            ]
            if not 0.0 <= value < math.inf
        ]
        if self.lidar_caster not in LIDAR_CASTERS:
            problems.append(f"lidar: {self.lidar_caster!r}, expected {' or '.join(LIDAR_CASTERS)}")
        if problems:
            raise InputError(problems)


@dataclass(frozen=True)
class RobotState:
    """Pose of ``base_link`` in ``map``, velocities in ``base_link``.

    ``linear_mps`` and ``angular_radps`` are (x, y, z).
    """

    map_from_base: Pose3D
    linear_mps: Tuple[float, float, float]
    angular_radps: Tuple[float, float, float]

    @property
    def twist(self) -> Twist2D:
        return Twist2D(self.linear_mps[0], self.linear_mps[1], self.angular_radps[2])


class RobotStates(Sequence[RobotState]):
    """The states of all quadcopters at one instant, each made when it is asked for."""

    def __init__(self, bodies: BodyState):
        self.bodies = bodies
        self._states: List[Optional[RobotState]] = [None] * len(bodies.rows)

    def __len__(self) -> int:
        return len(self._states)

    def __getitem__(self, robot: int) -> RobotState:  # type: ignore[override]
        state = self._states[robot]
        if state is None:
            state = self._states[robot] = _robot_state(self.bodies.rows[robot])
        return state


def _robot_state(row: np.ndarray) -> RobotState:
    x, y, z, qx, qy, qz, qw, *twist = row.tolist()
    quaternion, to_base = (qx, qy, qz, qw), (-qx, -qy, -qz, qw)
    return RobotState(
        Pose3D(x, y, z, quaternion), rotate(to_base, twist[:3]), rotate(to_base, twist[3:])
    )


class Simulation:
    """N quadcopters in a scene, one step at a time.

    Raises ``InputError`` when the scene has fewer start poses than ``n_robots``,
    or no free place near one of them with ``jitter_m``. ``start_step`` is the
    step that the clock starts at.
    """

    def __init__(
        self,
        scene: Scene,
        n_robots: int,
        params: SimulationParams = SimulationParams(),
        seed: int = 0,
        gui: bool = False,
        start_step: int = 0,
    ):
        self.scene = scene
        self.params = params
        self.seed = seed
        self.step_count = start_step
        self._law = FlightLaw(params.airframe, params.flight)
        self._command_steps = math.floor(
            (params.command_timeout_s + params.controller_period_s) * STEPS_PER_S + 1e-9
        )
        self._starts = start_poses(scene, n_robots, params.jitter_m, seed, params.airframe.radius_m)
        self._world = World(scene, self._starts, params.airframe, STEP_S, gui)
        # Who looks into the engine, by its window or its rays, has to find the bodies there.
        self._engine_is_seen = gui or params.lidar_caster == "bullet"
        self._begin()

    def _begin(self) -> None:
        n = self.n_robots
        self._commands = np.zeros((n, 3))
        self._hover_step = np.full(n, -math.inf)  # the last step that a command counts for
        self._next_hover_step = math.inf
        self._contact_log = ContactLog()
        self.lidars = self._new_lidars()
        self._state = self._world.state()
        self._free_flight = FreeFlight(
            self.scene, n, self.params.airframe.radius_m, self._law, STEP_S
        )
        # The step up to which the engine moves a quadcopter.
        self._engine_until = np.full(n, math.inf if self._engine_is_seen else -math.inf)

    def _new_lidars(self) -> Lidars:
        params = self.params
        if params.lidar_caster == "kernel":
            return kernel_lidars(
                params.lidar, self.scene, self.n_robots, self.seed, params.airframe.radius_m
            )
        return Lidars(
            params.lidar, WorldCaster(params.lidar, self._world), self.n_robots, self.seed
        )

    @property
    def n_robots(self) -> int:
        return len(self._starts)

    @property
    def now_s(self) -> float:
        return self.step_count / STEPS_PER_S

    @property
    def contacts(self) -> List[Contact]:
        """Contacts since the start or the last reset, oldest first."""
        return self._contact_log.contacts

    def reset(self) -> None:
        """Back to the start poses without commands or contacts; the clock goes on."""
        self._world.reset(self._starts)
        self._begin()

    def close(self) -> None:
        """Free the physics engine; nothing else may be called afterwards."""
        self._world.close()

    @property
    def is_open(self) -> bool:
        """False once the window has been closed."""
        return self._world.is_open

    def set_command(self, robot: int, twist: Twist2D) -> None:
        """Velocity for a quadcopter, from the next step on. Raises ValueError if not finite."""
        if not twist.is_finite:
            raise ValueError(f"command for quadcopter {robot} is not finite: {twist}")
        self._commands[robot] = limit_command(twist, self.params.flight)
        self._hover_step[robot] = self.step_count + self._command_steps
        self._next_hover_step = min(self._next_hover_step, self._hover_step[robot])

    def step(self) -> List[Contact]:
        """Advance by ``STEP_S``; returns the contacts that begin."""
        return self.advance(1)

    def advance(self, steps: int) -> List[Contact]:
        """Advance by so many ``STEP_S``; returns the contacts that begin."""
        end = self.step_count + steps
        contacts: List[Contact] = []
        while self.step_count < end:
            if self.step_count > self._next_hover_step:
                self._hover()
            in_engine = self._engine_until > self.step_count
            if not in_engine.any():
                self._fly_freely(in_engine, int(min(end, self._next_hover_step + 1)))
            elif in_engine.all() or self._fly_freely(in_engine, self.step_count + 1):
                contacts += self._step_with_engine(in_engine)
        return contacts

    def _fly_freely(self, in_engine: np.ndarray, end: int) -> bool:
        """All others up to a step; False if fewer, because the engine has to move more.

        With somebody in the engine that has to make the same step, time goes on there.
        """
        state, done, near = self._free_flight.advance(
            self._state, self._commands, in_engine, end - self.step_count
        )
        if done:
            self._world.engage(np.flatnonzero(in_engine).tolist(), self._state)
        self._engine_until[near] = self.step_count + done + _STEPS_NEAR
        self._state = state
        if not in_engine.any():
            self.step_count += done
        return not near

    def _step_with_engine(self, in_engine: np.ndarray) -> List[Contact]:
        forces, torques = self._law.thrust_and_torque(
            self._state, self._commands, self.scene.altitude_m
        )
        self._world.engage(np.flatnonzero(in_engine).tolist(), self._state)
        self._state = self._world.step(self._state, forces, torques)
        self.step_count += 1
        return self._contact_log.update(self.now_s, self._world.touches())

    def _hover(self) -> None:
        """Commands that are too old count for nothing from now on."""
        is_hovering = self.is_hovering
        self._commands[is_hovering] = 0.0
        self._next_hover_step = np.min(self._hover_step[~is_hovering], initial=math.inf)

    @property
    def body_state(self) -> BodyState:
        """All quadcopters as arrays, in ``map``."""
        return self._state

    @property
    def is_hovering(self) -> np.ndarray:
        """bool[n]: no command has come yet or the last one is too old."""
        return self.step_count > self._hover_step

    def state(self, robot: int) -> RobotState:
        return _robot_state(self._state.rows[robot])

    def scan(self, robot: int) -> Scan:
        """What the LIDAR of a quadcopter sees at this instant."""
        return self.scans([robot])[0]

    def scans(self, robots: Sequence[int]) -> List[Scan]:
        """What the LIDARs of several quadcopters see at this instant, in one go."""
        return self.lidars.scan(self._state, robots, self.now_s)

    def show_goals(self, spheres: Sequence[GoalSphere]) -> None:
        """Draw goals in the window."""
        self._world.show_goals(spheres)


def start_poses(
    scene: Scene, n_robots: int, jitter_m: float, seed: int, body_radius_m: float = BODY_RADIUS_M
) -> List[Pose2D]:
    """Start poses of the first robots, displaced within a disc of radius ``jitter_m``.

    Each stays clear of obstacles, walls and the robots before it. Raises
    ``InputError`` when the scene has too few starts or no free place is found.
    """
    if not 1 <= n_robots <= len(scene.starts):
        raise InputError(
            [
                (
                    f"robots: {n_robots}, expected 1 to {len(scene.starts)}, "
                    f"the start poses of scene {scene.name}"
                )
            ]
        )
    random = np.random.default_rng([seed, 0])
    starts: List[Pose2D] = []
    for robot in range(n_robots):
        starts.append(_displaced(scene, robot, starts, jitter_m, random, body_radius_m))
    return starts


def _displaced(
    scene: Scene,
    robot: int,
    others: Sequence[Pose2D],
    jitter_m: float,
    random: np.random.Generator,
    body_radius_m: float,
) -> Pose2D:
    start = scene.starts[robot]
    if jitter_m == 0.0:
        return start
    for _ in range(_START_TRIES):
        radius_m = jitter_m * math.sqrt(random.random())
        angle_rad = 2.0 * math.pi * random.random()
        x_m, y_m = (
            start.x_m + radius_m * math.cos(angle_rad),
            start.y_m + radius_m * math.sin(angle_rad),
        )
        pose = Pose2D(x_m, y_m, start.yaw_rad)
        if (
            scene.contains(x_m, y_m)
            and scene.surface_distance_m(x_m, y_m, scene.altitude_m) > body_radius_m + _START_GAP_M
            and all(pose.distance_to(o) > 2 * body_radius_m + _START_GAP_M for o in others)
        ):
            return pose
    raise InputError(
        [
            (
                f"jitter: {jitter_m:g} m leaves no free start for quadcopter {robot} around "
                f"({start.x_m:g}, {start.y_m:g}), expected a smaller one"
            )
        ]
    )
