"""Set-up of flights through BARN's worlds: configuration, body and LIDAR."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, List, Tuple

from quad_bench.barn.protocol import (
    AREA,
    GOAL_M,
    GOAL_TOLERANCE_M,
    SAMPLE_STEP,
    START,
    TIME_LIMIT_S,
)
from quad_bench.barn.worlds import BarnWorld, load_worlds
from quad_nav.config import Configuration
from quad_nav.config.other_robots import sensor_faults
from quad_nav.config.sources import split_source
from quad_nav.control.dwa_planner_params import DwaParams
from quad_nav.control.trajectory_planner_params import TrajectoryPlannerParams
from quad_nav.costmap.static import StaticLayerParams
from quad_nav.errors import InputError
from quad_nav.mission.goal import Goal
from quad_nav.mission.goal_file import GoalSequence, SequenceSettings
from quad_nav.mission.robot_goals import RobotGoals, WatchedGoalFile
from quad_nav.scenario.flight_setup import FlightSetup
from quad_nav.scenario.goal_checks import goals_off_the_costmap
from quad_nav.scenario.rules import steps_per_scan
from quad_nav.scenario.scenario import read_configurations
from quad_nav.sim.flight import Airframe, FlightParams
from quad_nav.sim.lidar import LidarParams
from quad_nav.sim.simulation_params import SimulationParams

LIDAR = LidarParams(
    math.radians(270.0),
    math.radians(270.0) / 720,
    range_min_m=0.1,
    range_max_m=30.0,
    noise_std_m=0.001,
)
"""The Hokuyo UST-10 of the challenge's robot."""
SCANS_PER_S = 40


@dataclass(frozen=True)
class BarnOptions:
    """Options of a run of the benchmark, not yet checked.

    Attributes:
        worlds: File of the worlds.
        config: Name of a shipped configuration, or a folder's path.
        parameters: (path, value) on top of it.
        only: Numbers of worlds; () for all.
        sample: Fly through the worlds of the official sample.
        runs: Flights through each world.
        seed: Seed of the first run.
        body_radius_m: Radius of the robot's hull.
        strict: Refuse ``parameters`` that have no effect.
    """

    worlds: Path
    config: str = "barn"
    parameters: Tuple[Tuple[str, Any], ...] = ()
    only: Tuple[int, ...] = ()
    sample: bool = False
    runs: int = 1
    seed: int = 0
    body_radius_m: float = 0.20
    strict: bool = True


@dataclass(frozen=True)
class Contestant:
    """The robot and its configuration, which has the name, the same in all flights."""

    name: str
    configuration: Configuration
    simulation: SimulationParams
    seed: int


@dataclass(frozen=True)
class BarnSetup:
    """A contestant, the worlds, and the number of runs through each."""

    contestant: Contestant
    worlds: Tuple[Any, ...]
    runs: int

    @property
    def wanted(self) -> int:
        """Number of flights."""
        return self.runs * len(self.worlds)

    @property
    def warnings(self) -> Tuple[str, ...]:
        """Warnings about the configuration."""
        return self.contestant.configuration.warnings


def read_barn_setup(options: BarnOptions) -> BarnSetup:
    """Read worlds and configuration.

    Raises:
        InputError: Every fault in them.
    """
    problems: List[str] = []
    worlds: Tuple[BarnWorld, ...] = ()
    try:
        worlds = load_worlds(options.worlds, options.only)
    except InputError as error:
        problems += error.problems
    if options.sample:
        worlds = tuple(world for world in worlds if world.number % SAMPLE_STEP == 0)
        if not worlds and not problems:
            problems.append(f"{options.worlds}: none of the worlds is in the official sample")
    problems += _blocked_starts(worlds, options.body_radius_m, options.worlds)
    try:
        contestant = read_contestant(options, _GOALS, AREA)
    except InputError as error:
        raise InputError(problems + error.problems) from error
    if problems:
        raise InputError(problems)
    return BarnSetup(contestant, worlds, options.runs)


def flight_setup(contestant: Contestant, world: BarnWorld, run: int) -> FlightSetup:
    """Set up one flight; run 0 has the contestant's seed, run 1 the next one, in every world."""
    goals = RobotGoals("quad0", WatchedGoalFile("barn"), _GOALS)
    return FlightSetup(
        world.scene(),
        (goals,),
        (contestant.configuration,),
        contestant.name,
        contestant.simulation,
        steps_per_scan(SCANS_PER_S),
        contestant.seed + run,
    )


_GOALS = GoalSequence((Goal(*GOAL_M),), SequenceSettings(GOAL_TOLERANCE_M, TIME_LIMIT_S, retries=0))


def read_contestant(
    options: BarnOptions, sequence: GoalSequence, area: Tuple[float, float, float, float]
) -> Contestant:
    """Read the configuration, without the worlds.

    Args:
        options: The options.
        sequence: Goals, which the global costmap has to cover.
        area: Least x and y, greatest x and y in m, that a global costmap gets if it does not.

    Raises:
        InputError: Every fault in the configuration.
    """
    folder, _ = split_source(options.config)
    goals = RobotGoals("quad0", WatchedGoalFile(folder), sequence)

    def faults(configuration: Configuration, _number: int) -> List[str]:
        return [
            *_static_layer_faults(configuration, folder),
            *(
                f"{folder}: {path}: {problem}"
                for path, problem in sensor_faults(configuration.costmaps)
            ),
            *goals_off_the_costmap([goals], [configuration]),
        ]

    (configuration,) = read_configurations(
        options.config, 1, area, options.parameters, faults, strict=options.strict
    )
    simulation = SimulationParams(
        LIDAR,
        _limits(configuration.local_planner),
        Airframe(radius_m=options.body_radius_m),
        controller_period_s=1.0 / configuration.navigator.controller_frequency_hz,
    )
    return Contestant(options.config, configuration, simulation, options.seed)


def _limits(local_planner: Any) -> FlightParams:
    """Limit the body to the velocities of the local planner's parameters.

    A user's planner has no known velocities; then the body's own limits apply.
    """
    if isinstance(local_planner, TrajectoryPlannerParams):
        speed_mps = max(local_planner.max_vel_x_mps, -local_planner.escape_vel_mps)
    elif isinstance(local_planner, DwaParams):
        speed_mps = (
            local_planner.max_vel_trans_mps
            if local_planner.max_vel_trans_mps >= 0.0
            else math.hypot(local_planner.max_vel_x_mps, local_planner.max_vel_y_mps)
        )
    else:
        return FlightParams()
    yaw_rate_radps = local_planner.max_vel_theta_radps
    return replace(FlightParams(), max_speed_mps=speed_mps, max_yaw_rate_radps=yaw_rate_radps)


def _static_layer_faults(configuration: Configuration, folder: Path) -> List[str]:
    """A message for each static layer: robots do not know these worlds beforehand."""
    return [
        f"{folder}: {name}: the worlds have no map; expected static_map: false, or plugins "
        "without a static layer"
        for costmap in (configuration.global_costmap, configuration.local_costmap)
        for name, layer in costmap.layers
        if isinstance(layer, StaticLayerParams)
    ]


def _blocked_starts(worlds: Tuple[BarnWorld, ...], radius_m: float, path: Path) -> List[str]:
    problems = []
    for world in worlds:
        distance_m = world.scene().flight_surface_distance_m(START.x_m, START.y_m)
        if distance_m <= radius_m:
            problems.append(
                f"{path}: world {world.number}: a cylinder is {distance_m:.2f} m from "
                f"the start; expected more than the body's radius, {radius_m:g} m"
            )
    return problems
