"""Set-up of an offline flight, from what a person asks for."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, List, Optional, Sequence, Tuple

from quad_nav.config import Configuration
from quad_nav.config.other_robots import input_faults
from quad_nav.config.sources import config_label
from quad_nav.errors import InputError
from quad_nav.files.shipped import shipped
from quad_nav.files.values import value_faults
from quad_nav.mission.robot_goals import RobotGoals, goal_paths
from quad_nav.scenario import RANDOM
from quad_nav.scenario.coverage import scene_bounds
from quad_nav.scenario.rules import RULES, steps_per_scan
from quad_nav.scenario.scenario import (
    Scenario,
    ScenarioRequest,
    read_configurations,
    read_scenario,
    tried,
)
from quad_nav.scenario.scene_map import scene_map_problem
from quad_nav.sim.localization import LocalizationMaker
from quad_nav.sim.scene import Scene
from quad_nav.sim.simulation_params import SimulationParams
from quad_nav.sim.start_poses import start_poses
from quad_nav.sim.unseen import unseen_obstacles


@dataclass(frozen=True)
class FlightOptions:
    """Options of an offline flight, not yet checked.

    Attributes:
        scene: Scene file; None for the shipped arena, or a random mission if ``goals`` is None.
        goals: Folder or file of goals; None for the shipped ones, or a random mission.
        config: A shipped configuration, a folder or files, see ``config.sources``.
        parameters: (path, value) on top of it, as ("global_costmap/width", 60.0).
        robots: Number of robots; None for as many as ``goals`` has files.
        seed: Of jitter, noise and the random mission.
        size_m: Side of a random mission's arena; 0 for one with room for all robots.
        time_limit_s: Simulated time after which the flight ends.
        scans_per_s: Rate of the LIDARs in simulated time.
        simulation: Bodies and LIDARs.
        configurations: Configurations of the robots, if they are there already, instead of those
            that ``config`` and ``parameters`` name.
        strict: Refuse ``parameters`` that have no effect.
        localization: Makes what finds the robots' places; None if they know them.
    """

    scene: Optional[Path]
    goals: Optional[Path]
    config: str = "default"
    parameters: Tuple[Tuple[str, Any], ...] = ()
    robots: Optional[int] = None
    seed: int = 0
    size_m: float = 0.0
    time_limit_s: float = math.inf
    scans_per_s: float = 20.0
    simulation: SimulationParams = field(default_factory=SimulationParams)
    configurations: Tuple[Configuration, ...] = ()
    strict: bool = True
    localization: Optional[LocalizationMaker] = None


@dataclass(frozen=True)
class FlightSetup:
    """A flight that can be flown.

    ``simulation`` has the navigators' control period. ``config_name`` is the folder's name
    without its path, which recordings and reports do not disclose.
    """

    scene: Scene
    robots: Tuple[RobotGoals, ...]
    configurations: Tuple[Configuration, ...]
    config_name: str
    simulation: SimulationParams
    steps_per_scan: int
    seed: int = 0
    time_limit_s: float = math.inf
    warnings: Tuple[str, ...] = ()
    localization: Optional[LocalizationMaker] = None

    @property
    def robot_radius_m(self) -> float:
        """Radius of the robots' hulls."""
        return self.simulation.airframe.radius_m


def read_setup(options: FlightOptions) -> FlightSetup:
    """Read every file that a flight needs.

    Raises:
        InputError: Every fault in options, scene, goal files and configurations.
    """
    given_goals = options.goals
    options = with_default_files(options)
    problems = _value_faults(options)
    scenario, faults = read_scenario(_request(options), partial(_configurations, options))
    problems += faults
    scene, robots = scenario.scene, scenario.robots
    airframe = replace(options.simulation.airframe, radius_m=scenario.robot_radius_m)
    simulation = replace(options.simulation, airframe=airframe)
    if scene is not None and not problems:
        poses = partial(start_poses, scene, len(robots), simulation.jitter_m, options.seed)
        tried(partial(poses, airframe.radius_m), problems)
    configurations = tuple(one for one in scenario.configurations if one is not None)
    if scene is not None:
        problems += _map_faults(scene, configurations)
    if problems:
        raise InputError(problems + ([] if given_goals else _missing_goals(options, problems)))
    assert scene is not None
    longest_s = max(1.0 / one.navigator.controller_frequency_hz for one in configurations)
    told = (*scene.remarks, *unseen_obstacles(scene), *scenario.notes, *scenario.warnings)
    warnings = dict.fromkeys(line for one in configurations for line in one.warnings)
    return FlightSetup(
        scene,
        robots,
        configurations,
        config_label(options.config),
        replace(simulation, controller_period_s=longest_s),
        steps_per_scan(options.scans_per_s),
        options.seed,
        options.time_limit_s,
        warnings=(*told, *warnings),
        localization=options.localization,
    )


def _missing_goals(options: FlightOptions, problems: Sequence[str]) -> List[str]:
    """Explain faults of goals that the user did not ask for: the tutorial's."""
    if options.goals is None or not any(str(options.goals) in problem for problem in problems):
        return []
    return [
        "goals: not given, so that the goals of the tutorial's arena are flown; expected "
        "--goals FOLDER with quad0_goals.json and so on, for this scene"
    ]


def read_readable_parts(options: FlightOptions) -> Scenario:
    """Read what has no faults, to show it; ``read_setup`` has the faults."""
    options = with_default_files(options)
    return read_scenario(_request(options), partial(_configurations, options))[0]


def _map_faults(scene: Scene, configurations: Sequence[Configuration]) -> List[str]:
    """A message for each costmap whose static layers cannot hold the scene."""
    found = (
        (f"quad{number}: {name}", scene_map_problem(scene, costmap))
        for number, one in enumerate(configurations)
        for name, costmap in one.costmaps.items()
    )
    return [f"{place}: {problem}" for place, problem in found if problem]


def _value_faults(options: FlightOptions) -> List[str]:
    values = {
        "lidar_rate": options.scans_per_s,
        "jitter": options.simulation.jitter_m,
        "time_limit": options.time_limit_s,
    }
    return value_faults(values, {name: RULES[name] for name in values}, "")


def with_default_files(options: FlightOptions) -> FlightOptions:
    """Add the shipped scene or goals if only the other is given, and the number of robots."""
    scene, goals, robots = options.scene, options.goals, options.robots
    if goals is None and scene is not None:
        goals = shipped("goals")
    if scene is None and goals is not None:
        scene = shipped("scenes", "arena.yaml")
    if robots is None:
        robots = 1 if goals is None else len(goal_paths(goals.expanduser())[0]) or 1
    return replace(options, scene=scene, goals=goals, robots=robots)


def _request(options: FlightOptions) -> ScenarioRequest:
    return ScenarioRequest(
        RANDOM if options.scene is None else str(options.scene),
        RANDOM if options.goals is None else str(options.goals),
        options.robots,
        options.seed,
        options.size_m,
        options.simulation.airframe.radius_m,
        simulated=options.simulation.odom_drift.is_zero,
    )


def _configurations(
    options: FlightOptions, robots: int, scene: Optional[Scene]
) -> List[Configuration]:
    if options.configurations:
        return _given_configurations(options.configurations, robots)
    return read_configurations(
        options.config,
        robots,
        scene_bounds(scene) if scene else None,
        options.parameters,
        partial(_input_faults, options.config),
        strict=options.strict,
    )


def _given_configurations(
    configurations: Sequence[Configuration], robots: int
) -> List[Configuration]:
    """Check configurations that no file has.

    Raises:
        InputError: They are not one for each robot, or have frames or sensors of their own.
    """
    problems = []
    if len(configurations) != robots:
        problems = [f"config: {len(configurations)} configurations; expected {robots}, the robots"]
    for number, one in enumerate(configurations):
        problems += _input_faults("config", one, number)
    if problems:
        raise InputError(problems)
    return list(configurations)


def _input_faults(source: str, configuration: Configuration, number: int) -> List[str]:
    return [
        f"{source}: quad{number}: {path}: {problem}"
        for path, problem in input_faults(configuration.costmaps, number)
    ]
