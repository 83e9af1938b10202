"""What a sequencer is asked to fly: its parameters, goal files and scene, all checked.

Everything is read before anything flies, and every fault is listed at once.
"""
from __future__ import annotations

import difflib
import itertools
import math
import os
import time
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, Dict, List, Mapping, Optional, Tuple

import rospkg

from quad_nav import config
from quad_nav.errors import InputError
from quad_nav.mission.flight_log import Clearance
from quad_nav.mission.goal_file import (
    SETTINGS,
    PlaceCheck,
    WatchedGoalFile,
    clearance_check,
    read_settings,
)
from quad_nav.mission.goal_sequence import GoalSequence, SequenceSettings
from quad_nav.sim.scene import BODY_RADIUS_M, Scene
from quad_nav.sim.scene_file import load_scene

DEFAULTS: Dict[str, Any] = {
    "robots": 2,
    "goals": "",
    "scene": "",
    "robot_radius": BODY_RADIUS_M,
    "simulation": True,
    "ready_timeout": 60.0,
    "exit_when_done": False,
    "result": "",
}


@dataclass(frozen=True)
class RobotGoals:
    """One quadcopter's name, its goal file and what that said at the start."""

    name: str
    file: WatchedGoalFile
    sequence: GoalSequence


@dataclass(frozen=True)
class MissionSetup:
    """A mission that can be flown."""

    robots: Tuple[RobotGoals, ...]
    robot_radius_m: float
    altitude_m: Optional[float]
    clearance_m: Optional[Clearance]
    simulation: bool
    ready_timeout_s: float
    exit_when_done: bool
    warnings: Tuple[str, ...]


def result_path(parameters: Mapping[str, Any]) -> Path:
    """Where the summary goes; also for parameters that are otherwise of no use."""
    given = parameters.get("result")
    if isinstance(given, str) and given:
        return Path(given).expanduser()
    stamp = time.strftime("%Y%m%d-%H%M%S")
    return Path(rospkg.get_log_dir()) / "quad" / f"mission-{stamp}-{os.getpid()}.json"


def read_setup(parameters: Mapping[str, Any], name: str, result: Path,
               all_parameters: Mapping[str, Any] = MappingProxyType({})) -> MissionSetup:
    """The mission that a node's private parameters describe; ``result`` is its summary's place.

    ``all_parameters`` is the whole parameter tree; the navigators' parts of it, ``move_base{i}``,
    are checked as well, because a navigator that does not start is noticed late.

    Raises:
        InputError: every fault in the parameters, the scene and the goal files.
    """
    values = {**DEFAULTS, **parameters}
    problems = _faults(values, name) + _result_faults(result, name)
    given = {key: values[key] for key in SETTINGS if key in values}
    settings, faults = read_settings(given, name)
    problems += faults
    scene = _scene(values["scene"], problems)
    radius_m = BODY_RADIUS_M if faults or problems else float(values["robot_radius"])
    check = _place_check(scene, radius_m) if scene else None
    robots = _robots(values, name, check, settings, problems)
    problems += _navigator_faults(values["robots"], all_parameters)
    if problems:
        raise InputError(problems)
    clearance = _clearance(scene) if scene else None
    return MissionSetup(tuple(robots), radius_m, scene.altitude_m if scene else None, clearance,
                        values["simulation"], float(values["ready_timeout"]),
                        values["exit_when_done"],
                        (*_unknown(parameters, name), *_close_ends(robots, radius_m)))


def _faults(values: Mapping[str, Any], name: str) -> List[str]:
    def is_number(value: Any) -> bool:
        return (isinstance(value, (int, float)) and not isinstance(value, bool)
                and 0 < value < math.inf)

    def is_paths(value: Any) -> bool:
        if isinstance(value, list):
            return all(isinstance(path, str) for path in value)
        return isinstance(value, str) and value != ""

    rules = {
        "robots": (lambda v: is_number(v) and isinstance(v, int), "a whole number, 1 or more"),
        "goals": (is_paths, "a folder with quad0_goals.json and so on, or a list of files"),
        "scene": (lambda v: isinstance(v, str), "a scene file, or nothing"),
        "robot_radius": (is_number, "a number of metres above 0"),
        "simulation": (lambda v: isinstance(v, bool), "true or false"),
        "ready_timeout": (is_number, "a number of seconds above 0"),
        "exit_when_done": (lambda v: isinstance(v, bool), "true or false"),
        "result": (lambda v: isinstance(v, str), "a file to write, or nothing"),
    }
    return [f"{name}: {key}: is {values[key]!r}; expected {expected}"
            for key, (accepts, expected) in rules.items() if not accepts(values[key])]


def _result_faults(result: Path, name: str) -> List[str]:
    try:
        result.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        expected = "a file in a folder that exists or can be made"
        return [(f"{name}: result: {result} cannot be written: {error.strerror}; "
                f"expected {expected}")]
    if result.is_dir() or not os.access(result.parent, os.W_OK):
        return [f"{name}: result: {result} cannot be written; expected a file to write"]
    return []


def _unknown(parameters: Mapping[str, Any], name: str) -> List[str]:
    """No faults: a parameter server keeps what earlier launches set."""
    known = [*DEFAULTS, *SETTINGS]
    warnings = []
    for key in sorted(set(parameters) - set(known)):
        near = difflib.get_close_matches(key, known, n=1) or [f"one of {', '.join(known)}"]
        warnings.append(f"{name}: {key}: is not a parameter of the sequencer and does nothing; "
                        f"expected {near[0]}")
    return warnings


def _scene(path: Any, problems: List[str]) -> Optional[Scene]:
    if not isinstance(path, str) or not path:
        return None
    try:
        return load_scene(path)
    except InputError as error:
        problems += error.problems
        return None


def _navigator_faults(count: Any, all_parameters: Mapping[str, Any]) -> List[str]:
    problems: List[str] = []
    for index in range(count if isinstance(count, int) else 0):
        name = f"move_base{index}"
        try:
            config.load(all_parameters.get(name, {}), f"/{name}")
        except InputError as error:
            problems += error.problems
    return problems


def _clearance(scene: Scene) -> Clearance:
    return lambda x_m, y_m: scene.clearance_m(x_m, y_m, scene.altitude_m)


def _place_check(scene: Scene, robot_radius_m: float) -> PlaceCheck:
    arena = f"x 0 to {scene.size_x_m:g} m, y 0 to {scene.size_y_m:g} m"
    return clearance_check(scene.contains, _clearance(scene), robot_radius_m, arena)


def _robots(values: Mapping[str, Any], name: str, check: Optional[PlaceCheck],
            settings: SequenceSettings, problems: List[str]) -> List[RobotGoals]:
    robots = []
    for index, path in enumerate(_goal_paths(values, name, problems)):
        file = WatchedGoalFile(path, check, settings)
        try:
            robots.append(RobotGoals(f"quad{index}", file, file.load()))
        except InputError as error:
            problems += error.problems
    return robots


def _goal_paths(values: Mapping[str, Any], name: str, problems: List[str]) -> List[Path]:
    goals, count = values["goals"], values["robots"]
    if not goals or not isinstance(count, int):
        return []
    if isinstance(goals, list):
        if len(goals) != count:
            problems.append(f"{name}: goals: lists {len(goals)} files; expected one for each of "
                            f"{count} robots")
        return [Path(path).expanduser() for path in goals if isinstance(path, str)]
    if not isinstance(goals, str):
        return []
    folder = Path(goals).expanduser()
    if not folder.is_dir():
        problems.append(f"{name}: goals: there is no folder {folder}; expected one with "
                        "quad0_goals.json and so on")
        return []
    paths = [folder / f"quad{index}_goals.json" for index in range(count)]
    missing = [path.name for path in paths if not path.exists()]
    if missing:
        there = sorted(path.name for path in folder.glob("*.json")) or ["no JSON file"]
        problems.append(f"{folder}: has no {', '.join(missing)}; expected a goal file for each of "
                        f"{count} robots; there is {', '.join(there)}")
    return [path for path in paths if path.exists()]


def _close_ends(robots: List[RobotGoals], radius_m: float) -> List[str]:
    """Quadcopters that stay at their last goals would touch there."""
    staying = [robot for robot in robots if robot.sequence.settings.loop is False]
    warnings = []
    for a, b in itertools.combinations(staying, 2):
        apart_m = a.sequence.goals[-1].pose.distance_to(b.sequence.goals[-1].pose)
        if apart_m < 2 * radius_m:
            warnings.append(f"the last goals of {a.name} and {b.name} are {apart_m:.2f} m apart: "
                            f"they would touch there (two radii are {2 * radius_m:.2f} m)")
    return warnings
