"""What is to be flown offline: scene, goals, configurations and sensors, all checked."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Callable, List, Optional, Sequence, Tuple, TypeVar

from quad_nav import config
from quad_nav.config import Configuration
from quad_nav.config.files import set_value
from quad_nav.costmap.layered import CostmapParams
from quad_nav.costmap.obstacle import ObstacleLayerParams
from quad_nav.costmap.static import StaticLayerParams
from quad_nav.errors import InputError
from quad_nav.files.shipped import config_folder, shipped
from quad_nav.mission.robot_goals import (
    RobotGoals,
    goal_paths,
    last_goal_conflicts,
    load_robot_goals,
)
from quad_nav.scenario.random_mission import random_mission
from quad_nav.scenario.scene_check import scene_check
from quad_nav.sim.scene import Scene
from quad_nav.sim.scene_file import load_scene
from quad_nav.sim.simulation import STEPS_PER_S, SimulationParams, start_poses

T = TypeVar("T")


@dataclass(frozen=True)
class FlightOptions:
    """What a person asks for.

    ``config``: the name of a shipped folder of parameters, or a folder's path;
    ``parameters``: (path, value) on top of it, as ("global_costmap/width", 60.0).
    ``robots`` None: as many as there are goal files in ``goals``. ``time_limit_s`` is
    simulated time. Without ``scene`` and ``goals`` there is a random mission for so many,
    and ``size_m`` is the arena's side, 0 for one that has room for them.
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


@dataclass(frozen=True)
class FlightSetup:
    """A flight that can be flown; ``simulation`` has the navigators' control period.

    ``config_name`` is the folder's name alone: where it is, recordings and reports do not tell.
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

    @property
    def robot_radius_m(self) -> float:
        """The radius of the hulls."""
        return self.simulation.airframe.radius_m


def read_setup(options: FlightOptions) -> FlightSetup:
    """Reads every file that a flight needs.

    Raises:
        InputError: every fault in options, scene, goal files and parameters.
    """
    problems = _faults(options)
    radius_m = options.simulation.airframe.radius_m
    if options.scene is None and options.goals is None:
        options, scene, robots = _random(options, problems)
    else:
        scene = _tried(
            lambda: load_scene(options.scene or shipped("scenes", "arena.yaml")), problems
        )
        robots = _read_goals(options, scene, problems)
    count = options.robots if options.robots is not None else max(len(robots), 1)
    if scene is not None and not problems:
        _tried(
            lambda: start_poses(scene, count, options.simulation.jitter_m, options.seed, radius_m),
            problems,
        )
    configurations = _read_configurations(options, count, problems)
    problems += goals_off_the_costmap(robots, configurations)
    if problems:
        raise InputError(list(dict.fromkeys(problems)))
    assert scene is not None
    slowest_s = max(1.0 / one.navigator.controller_frequency_hz for one in configurations)
    warnings = dict.fromkeys(line for one in configurations for line in one.warnings)
    return FlightSetup(
        scene,
        tuple(robots),
        tuple(configurations),
        Path(options.config).name,
        replace(options.simulation, controller_period_s=slowest_s),
        round(STEPS_PER_S / options.scans_per_s),
        options.seed,
        options.time_limit_s,
        warnings=(*scene.remarks, *last_goal_conflicts(robots, radius_m), *warnings),
    )


def _faults(options: FlightOptions) -> List[str]:
    problems = []
    steps = STEPS_PER_S / options.scans_per_s if options.scans_per_s > 0 else 0.0
    if steps < 1 or abs(steps - round(steps)) > 1e-9:
        problems.append(
            f"lidar rate: {options.scans_per_s:g}, expected scans per second that "
            f"divide {STEPS_PER_S}, such as 10 or 20"
        )
    if not options.time_limit_s > 0:
        problems.append(f"time limit: {options.time_limit_s:g}, expected seconds above 0")
    if options.robots is not None and options.robots < 1:
        problems.append(f"robots: {options.robots}, expected 1 or more")
    return problems


def _random(
    options: FlightOptions, problems: List[str]
) -> Tuple[FlightOptions, Optional[Scene], List[RobotGoals]]:
    """A random mission, and options with global costmaps that hold it."""
    mission = _tried(
        lambda: random_mission(options.robots or 1, options.seed, options.size_m), problems
    )
    if mission is None:
        return options, None, []
    size = (
        ("global_costmap/width", mission.scene.size_x_m),
        ("global_costmap/height", mission.scene.size_y_m),
    )
    options = replace(options, parameters=(*size, *options.parameters))
    return options, mission.scene, mission.robot_goals()


def _read_goals(
    options: FlightOptions, scene: Optional[Scene], problems: List[str]
) -> List[RobotGoals]:
    folder = options.goals or shipped("goals")
    count = options.robots
    if count is None:
        count = 1
        while (folder / f"quad{count}_goals.json").exists():
            count += 1
    paths, missing = goal_paths(folder, count)
    robots, faults = load_robot_goals(
        paths, scene_check(scene, options.simulation.airframe.radius_m) if scene else None
    )
    problems += missing + faults
    return robots


def _read_configurations(
    options: FlightOptions, count: int, problems: List[str]
) -> List[Configuration]:
    folder = _tried(lambda: config_folder(options.config), problems)
    configurations: List[Configuration] = []
    if folder is None:
        return configurations
    for index in range(count):
        try:
            configurations.append(_read_configuration(folder, index, options.parameters))
        except InputError as error:
            problems += error.problems
            break  # the other robots' files are mostly the same ones
    return configurations


def _read_configuration(
    folder: Path, index: int, parameters: Sequence[Tuple[str, Any]]
) -> Configuration:
    tree = config.load_files(folder, {"i": str(index)})
    for path, value in parameters:
        set_value(tree, path, value, "the command line")
    configuration = config.load(tree)
    problems = [
        fault
        for costmap in (configuration.global_costmap, configuration.local_costmap)
        for fault in _unknown_inputs(costmap, index, folder)
    ]
    if problems:
        raise InputError(problems)
    return configuration


def goals_off_the_costmap(
    robots: Sequence[RobotGoals], configurations: Sequence[Configuration]
) -> List[str]:
    """Goals that no plan can lead to, because the global costmap ends before them."""
    problems = []
    for robot, configuration in zip(robots, configurations):
        costmap = configuration.global_costmap
        if costmap.rolling_window or any(
            isinstance(layer, StaticLayerParams) for _, layer in costmap.layers
        ):
            continue  # it moves, or takes the size of its map
        low_x, low_y = costmap.origin_x_m, costmap.origin_y_m
        high_x, high_y = low_x + costmap.width_m, low_y + costmap.height_m
        problems += [
            f"{robot.file.path}: goals[{number - 1}] (goal {number}): ({goal.x_m:g}, "
            f"{goal.y_m:g}) is off the global costmap, x {low_x:g} to {high_x:g} m, "
            f"y {low_y:g} to {high_y:g} m; expected a larger global_costmap/width and height"
            for number, goal in enumerate(robot.sequence.goals, start=1)
            if not (low_x <= goal.x_m < high_x and low_y <= goal.y_m < high_y)
        ]
    return problems


def _unknown_inputs(costmap: CostmapParams, index: int, folder: Path) -> List[str]:
    """Frames and sensors that are not there; on ROS the navigator would wait for ever."""
    known = {"global_frame": ("map", f"odom{index}"), "robot_base_frame": (f"base_link{index}",)}
    given = {"global_frame": costmap.global_frame, "robot_base_frame": costmap.robot_base_frame}
    problems = [
        f"{folder}: {key} of robot {index}: {given[key]}, expected {' or '.join(names)}"
        for key, names in known.items()
        if given[key].lstrip("/") not in names
    ]
    lidar = f"Lidar{index}"
    for name, layer in costmap.layers:
        for source in layer.sources if isinstance(layer, ObstacleLayerParams) else ():
            if source.data_type != "LaserScan":
                problems.append(
                    f"{folder}: {name}/{source.name} of robot {index}: data_type "
                    f"{source.data_type}, expected LaserScan, the only sensor here"
                )
            elif source.sensor_frame.lstrip("/") not in ("", lidar):
                problems.append(
                    f"{folder}: {name}/{source.name} of robot {index}: sensor_frame "
                    f"{source.sensor_frame}, expected {lidar} or none"
                )
    return problems


def _tried(read: Callable[[], T], problems: List[str]) -> Optional[T]:
    """What ``read`` returns, or None with its faults added to ``problems``."""
    try:
        return read()
    except InputError as error:
        problems += error.problems
        return None
