"""Fly from Python: the names of ``quad_nav`` itself, such as ``quad_nav.fly``.

    import quad_nav

    setup = quad_nav.prepare(goals=[[[3.0, 6.5], [9.0, 5.5]]], seed=3)
    result = quad_nav.fly(setup)
    result.summary.success, result.trajectories[0]

``prepare`` reads a mission, ``fly`` flies it to its end, ``Flight`` flies it step by step with
commands of the caller. ``docs/python.md`` has examples. Importing ``quad_nav`` loads none of this;
the first use of a name does.
"""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from types import MappingProxyType
from typing import Any, Dict, Mapping, Optional, Sequence, Union

from quad_nav.api.flight import Command, Flight, Observation
from quad_nav.api.result import TRAJECTORY_COLUMNS, FlightResult, TrajectoryObserver
from quad_nav.config import Configuration
from quad_nav.errors import InputError
from quad_nav.files.shipped import shipped
from quad_nav.geometry import Pose2D, Scan
from quad_nav.loop.worker_process import processes_for
from quad_nav.mission.goal import Goal, goal_entry
from quad_nav.mission.goal_file import SETTINGS, GoalSequence, SequenceSettings, load_goals
from quad_nav.mission.summary import MissionSummary
from quad_nav.offline.flight import FlightObserver
from quad_nav.offline.run import fly as fly_setup
from quad_nav.scenario.flight_setup import FlightOptions, FlightSetup, read_setup
from quad_nav.scenario.scenario import read_configurations
from quad_nav.sim.contacts import Contact
from quad_nav.sim.lidar import LidarParams
from quad_nav.sim.obstacles import Box, Cylinder, Sphere
from quad_nav.sim.scene import Scene, Walls
from quad_nav.sim.scene_file import load_scene
from quad_nav.sim.scene_writer import write_scene
from quad_nav.sim.simulation_params import SimulationParams

__all__ = [
    "TRAJECTORY_COLUMNS",
    "Box",
    "Command",
    "Configuration",
    "Contact",
    "Cylinder",
    "Flight",
    "FlightObserver",
    "FlightResult",
    "FlightSetup",
    "Goal",
    "GoalSequence",
    "InputError",
    "MissionSummary",
    "Observation",
    "Pose2D",
    "Scan",
    "Scene",
    "SequenceSettings",
    "Sphere",
    "Walls",
    "fly",
    "lidar_simulation",
    "load_configuration",
    "load_goals",
    "load_scene",
    "prepare",
]

Goals = Union[GoalSequence, Mapping[str, Any], Sequence[Any]]
"""Goals of one robot: as loaded, as the object in a goal file, or as the list of its goals."""
_NONE: Mapping[str, Any] = MappingProxyType({})


def load_configuration(
    name: Union[str, Path] = "default", parameters: Mapping[str, Any] = _NONE, robot: int = 0
) -> Configuration:
    """Read a configuration of move_base.

    Args:
        name: "default", "tutorial", another shipped one, a folder or files of any robot.
        parameters: Values on top of it by their paths, as {"global_costmap/width": 60.0}.
        robot: Number of the robot that it is for; frames and topics have it in their names.

    Raises:
        InputError: Every fault in files and values.
    """
    return read_configurations(str(name), robot + 1, None, tuple(parameters.items()))[robot]


def prepare(
    scene: Union[str, Path, Scene, None] = None,
    goals: Union[str, Path, Sequence[Goals], None] = None,
    config: Union[str, Path, Sequence[Configuration]] = "default",
    parameters: Mapping[str, Any] = _NONE,
    *,
    robots: Optional[int] = None,
    seed: int = 0,
    time_limit_s: float = math.inf,
    size_m: float = 0.0,
    scans_per_s: float = 20.0,
    simulation: Optional[SimulationParams] = None,
) -> FlightSetup:
    """Read and check a mission; without arguments it is that of ``quad fly``.

    Args:
        scene: File or scene; None for the shipped arena, or a random one for many robots.
        goals: Folder of goal files, or the goals of each robot.
        config: Name or folder of a configuration, or the configuration of each robot.
        parameters: Values on top of a named one, as {"global_costmap/width": 60.0}.
        robots: Number of robots; by default one for each goal file or list of goals.
        seed: Of jitter, noise, drift and random missions.
        time_limit_s: Simulated time after which the flight ends.
        size_m: Side of a random mission's arena; 0 for one with room for all.
        scans_per_s: Rate of the LIDARs.
        simulation: Bodies, LIDARs, jitter and drift, see ``lidar_simulation``.

    Raises:
        InputError: Every fault in the files and values.
    """
    name, given = (str(config), ()) if isinstance(config, (str, Path)) else ("", tuple(config))
    options = FlightOptions(None, None, name or "default", tuple(parameters.items()), robots, seed)
    options = replace(options, size_m=size_m, time_limit_s=time_limit_s, configurations=given)
    if simulation is not None:
        options = replace(options, simulation=simulation)
    return _read(replace(options, scans_per_s=scans_per_s), scene, goals)


def fly(
    setup: Optional[FlightSetup] = None,
    observers: Sequence[FlightObserver] = (),
    processes: Optional[int] = None,
) -> FlightResult:
    """Fly a mission to its end, as ``quad fly`` does.

    Args:
        setup: The mission; by default that of ``quad fly``.
        observers: Called as the flight goes on, see ``FlightObserver``.
        processes: Processes that share the navigators; by default one for each core. The
            flight does not depend on it.
    """
    setup = setup or prepare()
    trajectories = TrajectoryObserver()
    summary = fly_setup(
        setup, [trajectories, *observers], processes or processes_for(len(setup.robots))
    )
    return FlightResult(summary, trajectories.trajectories())


def lidar_simulation(
    beams: int = 512,
    scan_range_rad: float = 2.0 * math.pi,
    range_noise_m: float = 0.0,
    jitter_m: float = 0.0,
) -> SimulationParams:
    """Return parameters for ``prepare`` with these LIDARs and random starts.

    Args:
        beams: Beams of a scan.
        scan_range_rad: Field of view.
        range_noise_m: Standard deviation of the ranges.
        jitter_m: Largest displacement of a start.

    Raises:
        InputError: A value is out of range.
    """
    lidar = LidarParams(scan_range_rad, scan_range_rad / beams, noise_std_m=range_noise_m)
    return SimulationParams(lidar, jitter_m=jitter_m)


def _read(
    options: FlightOptions,
    scene: Union[str, Path, Scene, None],
    goals: Union[str, Path, Sequence[Goals], None],
) -> FlightSetup:
    """Read a mission; faults in objects name the files that they would be in."""
    with TemporaryDirectory() as folder:
        try:
            return read_setup(_with_files(options, scene, goals, Path(folder)))
        except InputError as error:
            problems = [problem.replace(f"{folder}/", "") for problem in error.problems]
            raise InputError(problems) from None


def _with_files(
    options: FlightOptions,
    scene: Union[str, Path, Scene, None],
    goals: Union[str, Path, Sequence[Goals], None],
    folder: Path,
) -> FlightOptions:
    """Name the files of scene and goals; objects become files, so that the same rules hold."""
    if isinstance(scene, Scene):
        write_scene(scene, folder / "scene.yaml")
        scene = folder / "scene.yaml"
    robots = options.robots
    if goals is not None and not isinstance(goals, (str, Path)):
        robots = len(goals) if robots is None else robots
        for number, one in enumerate(goals):
            (folder / f"quad{number}_goals.json").write_text(json.dumps(_document(one)))
        goals = folder
    if scene is None and goals is None and (robots or 0) <= 2 and not options.size_m:
        goals = shipped("goals")
    return replace(
        options,
        scene=None if scene is None else Path(scene),
        goals=None if goals is None else Path(goals),
        robots=robots,
    )


def _entry(goal: Any) -> Any:
    if isinstance(goal, Goal):
        return goal_entry(goal)
    return list(goal) if isinstance(goal, tuple) else goal


def _document(goals: Goals) -> Mapping[str, Any]:
    """Return goals as a goal file has them."""
    if isinstance(goals, Mapping):
        return goals
    if not isinstance(goals, GoalSequence):
        return {"goals": [_entry(goal) for goal in goals]}
    settings: Dict[str, Any] = {
        key: getattr(goals.settings, setting.field) for key, setting in SETTINGS.items()
    }
    entries = [goal_entry(goal) for goal in goals.goals]
    return {"goals": entries, **{key: one for key, one in settings.items() if one is not None}}
