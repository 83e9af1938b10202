"""Simulation of quadcopters: commands in; poses, scans and contacts out.

Time advances in steps of 1/240 s. Equal arguments and equal calls give bit-identical results.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import List, Optional, Sequence

import numpy as np
from numpy.typing import NDArray

from quad_nav.geometry import Pose2D, Scan, Twist2D
from quad_nav.sim.autopilot import Autopilot, flight_params
from quad_nav.sim.body import GoalSphere, World
from quad_nav.sim.casters import Caster, KernelCaster, Lidars, WorldCaster
from quad_nav.sim.contacts import Contact, ContactLog
from quad_nav.sim.flight import BodyState, FlightLaw, limit_command
from quad_nav.sim.free_flight import FreeFlight
from quad_nav.sim.movers import Movers
from quad_nav.sim.odometry import FIXED_FRAMES, Odometry, OdomFrames
from quad_nav.sim.robot_state import RobotState, RobotStates, robot_state
from quad_nav.sim.scene import Scene
from quad_nav.sim.simulation_params import (
    STEP_S,
    STEPS_PER_ODOMETRY,
    STEPS_PER_S,
    SimulationParams,
)
from quad_nav.sim.start_poses import start_poses

_STEPS_NEAR = 12
"""Steps that the engine moves a quadcopter after it came near something, before a new check."""


class Simulation:
    """Quadcopters in a scene.

    Attributes:
        odometry: What the quadcopters measure of their motion; None if that is exact.

    Args:
        scene: The scene.
        n_robots: Number of quadcopters.
        params: Parameters.
        seed: Seed of the LIDARs' noise, the starts' displacements, the odometry's drift, and the
            phases of moving obstacles.
        gui: Open the engine's window.
        start_step: Step at which the clock starts.

    Raises:
        InputError: The scene has fewer start poses than quadcopters, there is no free position
            near a start with ``jitter_m``, or there is no display for the window.
    """

    def __init__(
        self,
        scene: Scene,
        n_robots: int,
        params: SimulationParams = SimulationParams(),
        seed: int = 0,
        gui: bool = False,
        start_step: int = 0,
    ) -> None:
        self.scene = scene
        self.params = params
        self.seed = seed
        self.step_count = start_step
        self.movers = Movers(scene, seed, start_step / STEPS_PER_S)
        self._law = FlightLaw(params.airframe, flight_params(params.airframe, params.flight))
        self.wait_for_commands(params.controller_period_s)
        self._starts = start_poses(scene, n_robots, params.jitter_m, seed, params.airframe.radius_m)
        self._world = World(scene, self._starts, params.airframe, STEP_S, gui)
        # The engine's window and rays need the bodies in the engine.
        self._always_in_engine = gui or params.lidar_caster == "bullet"
        self._caster = self._new_caster()
        self._begin()

    def _begin(self) -> None:
        n = self.n_robots
        self._commands = np.zeros((n, 3))
        self._hover_step = np.full(n, -math.inf)  # last step for which a command is valid
        self._next_hover_step = math.inf
        self._contact_log = ContactLog()
        self.lidars = Lidars(self.params.lidar, self._caster, n, self.seed)
        self._state = self._world.state()
        self._place_obstacles()
        self.odometry = self._new_odometry()
        self._free_flight = FreeFlight(
            self.scene, n, self.params.airframe.radius_m, self._law, STEP_S
        )
        response = self.params.airframe.response
        self._autopilot = Autopilot(response, self._law, n, STEP_S) if response else None
        # Step up to which the engine moves a quadcopter, and the last of these.
        self._engine_end = math.inf if self._always_in_engine else -math.inf
        self._engine_until = np.full(n, self._engine_end)
        self._none = np.zeros(n, dtype=bool)

    def _new_odometry(self) -> Optional[Odometry]:
        errors = self.params.odom_drift
        if errors.is_zero:
            return None
        return Odometry(errors, RobotStates(self._state).poses, self.now_s, self.seed)

    def _new_caster(self) -> Caster:
        params = self.params
        if params.lidar_caster == "kernel":
            return KernelCaster(params.lidar, self.scene, self.n_robots, params.airframe.radius_m)
        return WorldCaster(params.lidar, self._world.cast)

    @property
    def n_robots(self) -> int:
        """Number of quadcopters."""
        return len(self._starts)

    @property
    def now_s(self) -> float:
        """Simulated time."""
        return self.step_count / STEPS_PER_S

    @property
    def contacts(self) -> List[Contact]:
        """Contacts since the start or the last reset, in the order in which they began."""
        return self._contact_log.contacts

    def reset(self, seed: Optional[int] = None, start_step: Optional[int] = None) -> None:
        """Return to the start poses without commands, contacts or drift.

        Moving obstacles go on, unless there is a new seed or clock, with which they start again.

        Args:
            seed: New seed, for other starts and noise; None for the same starts again.
            start_step: Step at which the clock starts; None for a clock that continues.

        Raises:
            InputError: There is no free position near a start with ``jitter_m``.
        """
        if seed is not None and seed != self.seed:
            radius_m, params, n = self.params.airframe.radius_m, self.params, self.n_robots
            self._starts = start_poses(self.scene, n, params.jitter_m, seed, radius_m)
            self.seed = seed
        if start_step is not None:
            self.step_count = start_step
        if seed is not None or start_step is not None:
            self.movers = Movers(self.scene, self.seed, self.now_s)
        self._world.reset(self._starts)
        self._begin()

    def close(self) -> None:
        """Free the physics engine; call nothing else afterwards."""
        self._world.close()

    @property
    def is_open(self) -> bool:
        """False after the window was closed."""
        return self._world.is_open

    def wait_for_commands(self, period_s: float) -> float:
        """Let commands be valid for the controllers' period and ``command_timeout_s``; return both.

        Args:
            period_s: Period of the slowest controller.
        """
        valid_s = self.params.command_timeout_s + period_s
        self._command_steps = math.floor(valid_s * STEPS_PER_S + 1e-9)
        return valid_s

    def set_command(self, robot: int, twist: Twist2D) -> None:
        """Set the commanded velocity of a quadcopter, from the next step on.

        Raises:
            ValueError: The velocity is not finite.
        """
        if not twist.is_finite:
            raise ValueError(f"quad{robot}: command is not finite: {twist}")
        self._commands[robot] = limit_command(twist, self.params.flight)
        if self._autopilot is not None:
            self._autopilot.receive(robot, self._commands[robot], self._state, self.step_count)
        self._hover_step[robot] = self.step_count + self._command_steps
        self._next_hover_step = min(self._next_hover_step, self._hover_step[robot])

    def place(self, robots: Sequence[int], rows: NDArray[np.float64]) -> None:
        """Put quadcopters that others fly where they are; they move on from there.

        Called again and again, it leads a body from pose to pose. Others see it and touch it.

        Args:
            robots: Their numbers.
            rows: float64[len(robots), 13], their states as in ``BodyState``.
        """
        placed = self._state.rows.copy()
        placed[list(robots)] = rows
        self._state = replace(self._state, rows=placed)
        # The engine takes over the state of a body that it gets anew.
        kept = np.flatnonzero(self._engine_until > self.step_count).tolist()
        self._world.engage([robot for robot in kept if robot not in robots], self._state)

    def step(self) -> List[Contact]:
        """Advance by one step; return the contacts that begin."""
        return self.advance(1)

    def advance(self, steps: int) -> List[Contact]:
        """Advance by a number of steps; return the contacts that begin."""
        end = self.step_count + steps
        contacts: List[Contact] = []
        while self.step_count < end:
            contacts += self._advance_to(min(end, self._let_people_react(), self._next_odometry()))
            if self.odometry is not None and self.step_count % STEPS_PER_ODOMETRY == 0:
                self.odometry.update(RobotStates(self._state).poses, self.now_s)
        if self.movers:
            self._state = replace(self._state, obstacles=self.movers.poses(self.now_s))
        return contacts

    def _next_odometry(self) -> float:
        """Return the step at which odometry is computed next."""
        if self.odometry is None:
            return math.inf
        return (self.step_count // STEPS_PER_ODOMETRY + 1) * STEPS_PER_ODOMETRY

    def _let_people_react(self) -> float:
        """Return the step up to which the poses of moving obstacles are known then."""
        radius_m = self.params.airframe.radius_m
        known_s = self.movers.react(self.now_s, self._state.rows, radius_m)
        return known_s if known_s == math.inf else round(known_s * STEPS_PER_S)

    def _advance_to(self, end: float) -> List[Contact]:
        contacts: List[Contact] = []
        while self.step_count < end:
            if self.step_count > self._next_hover_step:
                self._hover()
            if self._engine_end <= self.step_count:
                self._fly_freely(self._none, int(min(end, self._next_change())))
                continue
            in_engine = self._engine_until > self.step_count
            if in_engine.all() or self._fly_freely(in_engine, self.step_count + 1):
                contacts += self._step_with_engine(in_engine)
        return contacts

    def _next_change(self) -> float:
        """Return the step up to which the flight controller's commands are constant."""
        return self.step_count + 1 if self._autopilot else self._next_hover_step + 1

    def _tracked_commands(self) -> NDArray[np.float64]:
        """Return the flight controller's commands float64[n, 3] for the next step."""
        if self._autopilot is None:
            return self._commands
        return self._autopilot.commands(self._state, self.step_count)

    def _place_obstacles(self) -> None:
        """Move the obstacles that move to where they are at the present step."""
        if self.movers:
            poses = self.movers.poses(self.now_s)
            self._state = replace(self._state, obstacles=poses)
            self._world.place_obstacles(poses)

    def _moving_poses(self, steps: int) -> NDArray[np.float64]:
        """Return the poses float64[steps, m, 3] of the moving obstacles after the next steps."""
        return self.movers.poses_at((self.step_count + np.arange(1, steps + 1)) / STEPS_PER_S)

    def _fly_freely(self, in_engine: NDArray[np.bool_], end: int) -> bool:
        """Move quadcopters that are not in the engine up to a step.

        The step count advances here only if no quadcopter is in the engine.

        Returns:
            False if a quadcopter came near something before that step and is in the engine now.
        """
        commands, steps = self._tracked_commands(), end - self.step_count
        state, done, near = self._free_flight.advance(
            self._state, commands, in_engine, steps, self._moving_poses
        )
        is_all = in_engine is self._none
        if done:
            engaged = [] if is_all else np.flatnonzero(in_engine).tolist()
            self._world.engage(engaged, self._state)
        if near:
            until = self.step_count + done + _STEPS_NEAR
            self._engine_until[near] = until
            self._engine_end = max(self._engine_end, until)
        self._state = state
        if is_all:
            self.step_count += done
        return not near

    def _step_with_engine(self, in_engine: NDArray[np.bool_]) -> List[Contact]:
        forces, torques = self._law.thrust_and_torque(
            self._state, self._tracked_commands(), self.scene.altitude_m
        )
        self._world.engage(np.flatnonzero(in_engine).tolist(), self._state)
        self.step_count += 1
        if self.movers:
            self._world.place_obstacles(self.movers.poses(self.now_s))
        self._state = self._world.step(self._state, forces, torques)
        return self._contact_log.update(self.now_s, self._world.touches())

    def _hover(self) -> None:
        """Replace commands that have timed out by zero velocity."""
        is_hovering = self.is_hovering
        if self._autopilot is not None:
            for robot in np.flatnonzero(is_hovering & self._commands.any(axis=1)).tolist():
                self._autopilot.receive(robot, np.zeros(3), self._state, self.step_count)
        self._commands[is_hovering] = 0.0
        self._next_hover_step = np.min(self._hover_step[~is_hovering], initial=math.inf)

    @property
    def body_state(self) -> BodyState:
        """State of all quadcopters in ``map``."""
        return self._state

    @property
    def commands(self) -> NDArray[np.float64]:
        """Commands in force float64[n, 3], (vx, vy, vyaw) in the bodies' frames; a copy."""
        return self._commands.copy()

    @property
    def is_hovering(self) -> NDArray[np.bool_]:
        """Mask bool[n] of the quadcopters without a command, or with one that has timed out."""
        return self.step_count > self._hover_step

    def state(self, robot: int) -> RobotState:
        """Return the state of a quadcopter."""
        return robot_state(self._state.rows[robot])

    @property
    def odom_frames(self) -> OdomFrames:
        """The odometry frames of all quadcopters now."""
        return FIXED_FRAMES if self.odometry is None else self.odometry.frames

    def map_from_frame(self, frame: str, robot: int) -> Pose2D:
        """Return the present pose of a frame of a quadcopter in ``map``, see ``OdomFrames``."""
        return self.odom_frames.map_from_frame(frame, robot)

    def scan(self, robot: int) -> Scan:
        """Return a scan of a quadcopter's LIDAR at the present time."""
        return self.scans([robot])[0]

    def scans(self, robots: Sequence[int]) -> List[Scan]:
        """Return scans of some quadcopters' LIDARs at the present time."""
        return self.lidars.scan(self._state, robots, self.now_s)

    def show_goals(self, spheres: Sequence[GoalSphere]) -> None:
        """Replace the goals drawn in the window."""
        self._world.show_goals(spheres)
