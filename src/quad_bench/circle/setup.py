"""Set-up of a swap of sides: robots on a circle, each with the opposite point as its goal."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, List, Sequence, Tuple

from quad_bench.circle.orca import HORIZON_S, OrcaParams, load_pyrvo
from quad_nav.config import Configuration
from quad_nav.config.other_robots import input_faults
from quad_nav.config.sources import config_label
from quad_nav.control.dwa_planner_params import DwaParams
from quad_nav.control.trajectory_planner_params import TrajectoryPlannerParams
from quad_nav.errors import InputError
from quad_nav.geometry import Pose2D
from quad_nav.mission.goal import Goal
from quad_nav.mission.goal_file import DEFAULT_SETTINGS, GoalSequence
from quad_nav.mission.robot_goals import RobotGoals, WatchedGoalFile
from quad_nav.scenario.flight_setup import FlightSetup
from quad_nav.scenario.rules import MAX_ROBOTS, steps_per_scan
from quad_nav.scenario.scenario import read_configurations
from quad_nav.sim.flight import Airframe
from quad_nav.sim.scene import BODY_RADIUS_M, Scene, Walls
from quad_nav.sim.simulation_params import SimulationParams
from quad_nav.sim.start_poses import start_poses

QUAD, ORCA, ORCA_POINTS = "quad", "orca", "orca-points"
METHODS = (QUAD, ORCA, ORCA_POINTS)
"""Our navigator; ORCA's velocities flown by our quadcopters; ORCA's points with exact positions."""
ARRIVED_M = DEFAULT_SETTINGS.goal_tolerance_m
"""Distance from its goal within which a robot has arrived, by every method."""
FOOTPRINT_MARGIN_M = 0.05
"""By which the configuration's ``robot_radius`` exceeds the hull, as in ``config/default``."""
SMALL_RADIUS_M, LARGE_RADIUS_M = 4.0, 8.0
MOST_ON_SMALL = 16
_BORDER_M = 3.0  # between circle and walls
_ALTITUDE_M = 1.0
_SCANS_PER_S = 20.0


@dataclass(frozen=True)
class CircleOptions:
    """Options of the flights, not yet checked.

    Attributes:
        robots: Numbers of robots, each flown with every seed.
        radius_m: Radius of the circle; 0 for ``fitting_radius_m``.
        methods: Of ``METHODS``.
        config: Name of a shipped configuration, or a folder's path.
        parameters: (path, value) on top of it.
        runs: Flights of each number of robots, with seeds counted up from ``seed``.
        seed: Seed of the first run.
        jitter_m: Largest random displacement of a start.
        body_radius_m: Radius of the hulls.
        time_limit_s: Simulated time after which a flight ends.
        orca_horizon_s: Time for which ORCA's velocities are free of collisions.
    """

    robots: Tuple[int, ...] = (8,)
    radius_m: float = 0.0
    methods: Tuple[str, ...] = METHODS
    config: str = "default"
    parameters: Tuple[Tuple[str, Any], ...] = ()
    runs: int = 1
    seed: int = 0
    jitter_m: float = 0.1
    body_radius_m: float = BODY_RADIUS_M
    time_limit_s: float = 300.0
    orca_horizon_s: float = HORIZON_S


@dataclass(frozen=True)
class Circle:
    """Robots on one circle, with their configurations.

    Attributes:
        radius_m: Radius of the circle.
        starts: Start poses, not displaced, in ``map``; the circle's centre is its origin.
        flight: Flight with the seed of the first run.
        orca: Parameters of ORCA: the speed, the period and the footprint of the navigators.
    """

    radius_m: float
    starts: Tuple[Pose2D, ...]
    flight: FlightSetup
    orca: OrcaParams

    @property
    def goals_m(self) -> Tuple[Tuple[float, float], ...]:
        """Goals (x, y) in ``map``: opposite to the starts."""
        return tuple(opposite(start) for start in self.starts)

    def flight_of(self, run: int) -> FlightSetup:
        """Return the flight of a run; run 0 has the first seed, run 1 the next one."""
        return replace(self.flight, seed=self.flight.seed + run)

    def starts_of(self, run: int) -> List[Pose2D]:
        """Return the displaced starts of a run, the same for every method."""
        flight = self.flight_of(run)
        simulation = flight.simulation
        return start_poses(
            flight.scene,
            len(self.starts),
            simulation.jitter_m,
            flight.seed,
            simulation.airframe.radius_m,
        )


def fitting_radius_m(robots: int) -> float:
    """Return the smaller circle while neighbours have 1.5 m from centre to centre on it."""
    return SMALL_RADIUS_M if robots <= MOST_ON_SMALL else LARGE_RADIUS_M


def circle_starts(robots: int, radius_m: float) -> Tuple[Pose2D, ...]:
    """Spread poses evenly on a circle around the origin; each faces the opposite point."""
    angles = [2.0 * math.pi * k / robots for k in range(robots)]
    return tuple(
        Pose2D(
            radius_m * math.cos(angle),
            radius_m * math.sin(angle),
            math.atan2(-math.sin(angle), -math.cos(angle)),
        )
        for angle in angles
    )


def opposite(start: Pose2D) -> Tuple[float, float]:
    """Return the opposite point of a circle around the origin."""
    return -start.x_m, -start.y_m


def read_circles(options: CircleOptions) -> List[Circle]:
    """Read the configuration and set up every number of robots.

    Raises:
        InputError: Every fault in options and configuration, or a package is missing.
    """
    if set(options.methods) & {ORCA, ORCA_POINTS}:
        load_pyrvo()
    problems: List[str] = []
    circles: List[Circle] = []
    for robots in dict.fromkeys(options.robots):
        try:
            circles.append(_circle(options, robots))
        except InputError as error:
            problems += error.problems
    if problems:
        raise InputError(list(dict.fromkeys(problems)))
    return circles


def _circle(options: CircleOptions, robots: int) -> Circle:
    if not 2 <= robots <= MAX_ROBOTS:
        raise InputError([f"--robots {robots}: expected 2 to {MAX_ROBOTS}"])
    radius_m = options.radius_m or fitting_radius_m(robots)
    starts = circle_starts(robots, radius_m)
    side_m = 2.0 * (radius_m + _BORDER_M)
    low_m = -side_m / 2.0
    name = f"circle of {robots} robots, radius {radius_m:g} m"
    scene = Scene(name, side_m, side_m, _ALTITUDE_M, Walls(), (), starts, low_m, low_m)
    configurations = _configurations(options, robots, (low_m, low_m, -low_m, -low_m))
    simulation = SimulationParams(
        airframe=Airframe(radius_m=options.body_radius_m),
        jitter_m=options.jitter_m,
        controller_period_s=1.0 / configurations[0].navigator.controller_frequency_hz,
    )
    start_poses(scene, robots, options.jitter_m, options.seed, options.body_radius_m)
    flight = FlightSetup(
        scene,
        _goals(starts, options.time_limit_s),
        tuple(configurations),
        config_label(options.config),
        simulation,
        steps_per_scan(_SCANS_PER_S),
        options.seed,
        options.time_limit_s,
        configurations[0].warnings,
    )
    orca = OrcaParams(
        options.body_radius_m + FOOTPRINT_MARGIN_M,
        _speed_mps(configurations[0]),
        simulation.controller_period_s,
        options.orca_horizon_s,
    )
    return Circle(radius_m, starts, flight, orca)


def _goals(starts: Sequence[Pose2D], time_limit_s: float) -> Tuple[RobotGoals, ...]:
    settings = replace(DEFAULT_SETTINGS, goal_timeout_s=time_limit_s)
    return tuple(
        RobotGoals(
            f"quad{k}",
            WatchedGoalFile(f"quad{k}_goals.json"),
            GoalSequence((Goal(*opposite(start)),), settings),
        )
        for k, start in enumerate(starts)
    )


def _configurations(
    options: CircleOptions, robots: int, area: Tuple[float, float, float, float]
) -> List[Configuration]:
    radius_m = options.body_radius_m + FOOTPRINT_MARGIN_M
    hull = tuple((f"{name}/robot_radius", radius_m) for name in ("global_costmap", "local_costmap"))
    return read_configurations(
        options.config,
        robots,
        area,
        (*hull, *options.parameters),
        lambda one, number: [
            f"{options.config}: quad{number}: {path}: {problem}"
            for path, problem in input_faults(one.costmaps, number)
        ],
    )


def _speed_mps(configuration: Configuration) -> float:
    """Return the local planner's greatest speed.

    Raises:
        InputError: It is a plugin, whose speed is not known.
    """
    planner = configuration.local_planner
    if isinstance(planner, TrajectoryPlannerParams):
        return planner.max_vel_x_mps
    if isinstance(planner, DwaParams):
        return planner.max_vel_trans_mps
    raise InputError(["--config: the local planner's speed is not known, which limits ORCA's too"])
