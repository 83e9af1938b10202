"""What a sequencer is asked to fly: its parameters, goal files and scene, all checked.

Everything is read before anything flies, and every fault is listed at once.
"""

from __future__ import annotations

import difflib
import json
import math
import os
import time
import zlib
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, Dict, List, Mapping, Optional, Tuple

import rospkg

from quad_nav import config
from quad_nav.errors import InputError
from quad_nav.mission.distances import SurfaceDistance
from quad_nav.mission.goal_file import SETTINGS, PlaceCheck, read_settings
from quad_nav.mission.goal_sequence import SequenceSettings
from quad_nav.mission.robot_goals import (
    RobotGoals,
    goal_paths,
    last_goal_conflicts,
    load_robot_goals,
)
from quad_nav.scenario.costmap_cover import uncovered
from quad_nav.scenario.fleet_setup import (
    MISSION_RULES,
    RANDOM,
    configurations,
    mission_of,
    scene_of,
)
from quad_nav.scenario.scene_check import scene_check
from quad_nav.sim.scene import BODY_RADIUS_M, Scene

DEFAULTS: Dict[str, Any] = {
    "robots": 2,
    "goals": "",
    "scene": "",  # file, or random
    "seed": 0,  # of a random mission, as the next
    "size": 0.0,
    "config": "",  # folder of a fleet's navigators
    "robot_radius": BODY_RADIUS_M,
    "simulation": True,
    "ready_timeout": 60.0,
    "exit_when_done": False,
    "result": "",
    "resume": False,
    "journal": "",
}


@dataclass(frozen=True)
class MissionSetup:
    """A mission that can be flown; ``parameters`` are the navigators' trees, {} if unknown."""

    robots: Tuple[RobotGoals, ...]
    robot_radius_m: float
    altitude_m: Optional[float]
    surface_distance: Optional[SurfaceDistance]
    simulation: bool
    ready_timeout_s: float
    exit_when_done: bool
    warnings: Tuple[str, ...]
    journal: Path
    resume: bool
    parameters: Tuple[Mapping[str, Any], ...] = ()


def result_path(parameters: Mapping[str, Any]) -> Path:
    """Where the summary goes; also for parameters that are otherwise of no use."""
    given = parameters.get("result")
    if isinstance(given, str) and given:
        return Path(given).expanduser()
    stamp = time.strftime("%Y%m%d-%H%M%S")
    return Path(rospkg.get_log_dir()) / "quad" / f"mission-{stamp}-{os.getpid()}.json"


def _journal_path(values: Mapping[str, Any]) -> Path:
    """Where the journal is; without a name of its own it has one for each mission."""
    if values["journal"]:
        return Path(values["journal"]).expanduser()
    goals = values["goals"] if isinstance(values["goals"], list) else [values["goals"]]
    paths = [path if path == RANDOM else str(Path(path).expanduser().resolve()) for path in goals]
    mission = [values["robots"], paths, values["scene"], values["seed"], values["size"]]
    number = zlib.crc32(json.dumps(mission).encode())
    return Path(rospkg.get_ros_home()) / "quad" / f"journal-{number:08x}.jsonl"


def read_setup(
    parameters: Mapping[str, Any],
    name: str,
    result: Path,
    all_parameters: Mapping[str, Any] = MappingProxyType({}),
) -> MissionSetup:
    """The mission that a node's private parameters describe; ``result`` is its summary's place.

    ``all_parameters`` is the whole parameter tree; the navigators' parts of it, ``move_base{i}``,
    are checked as well, because a navigator that does not start is noticed late. With ``config``
    the navigators are a fleet that reads its parameters from that folder itself.

    Raises:
        InputError: every fault in the parameters, the scene and the goal files.
    """
    values = {**DEFAULTS, **parameters}
    problems = _faults(values, name) + _result_faults(result, name)
    given = {key: values[key] for key in SETTINGS if key in values}
    settings, faults = read_settings(given, name)
    problems += faults
    scene = _scene(values, problems)
    radius_m = BODY_RADIUS_M if faults or problems else float(values["robot_radius"])
    check = scene_check(scene, radius_m) if scene else None
    robots = _robots(values, name, check, settings, problems)
    navigators = _navigators(values, all_parameters, problems)
    if problems:
        raise InputError(problems)
    return MissionSetup(
        tuple(robots),
        radius_m,
        scene.altitude_m if scene else None,
        scene.flight_surface_distances_m if scene else None,
        values["simulation"],
        float(values["ready_timeout"]),
        values["exit_when_done"],
        (
            *_unknown(parameters, name),
            *last_goal_conflicts(robots, radius_m),
            *(uncovered(scene, navigators) if scene else []),
        ),
        _journal_path(values),
        values["resume"],
        tuple(
            one.to_tree() if values["config"] or name in all_parameters else {}
            for name, one in navigators.items()
        ),
    )


def _faults(values: Mapping[str, Any], name: str) -> List[str]:
    def is_number(value: Any) -> bool:
        return (
            isinstance(value, (int, float)) and not isinstance(value, bool) and 0 < value < math.inf
        )

    def is_paths(value: Any) -> bool:
        if isinstance(value, list):
            return all(isinstance(path, str) for path in value)
        return isinstance(value, str) and value != ""

    rules = {
        "robots": (lambda v: is_number(v) and isinstance(v, int), "a whole number, 1 or more"),
        "goals": (is_paths, "a folder with quad0_goals.json and so on, or a list of files"),
        "scene": (lambda v: isinstance(v, str), f"a scene file, {RANDOM}, or nothing"),
        **MISSION_RULES,
        "config": (lambda v: isinstance(v, str), "a folder of YAML files, or nothing"),
        "robot_radius": (is_number, "a number of metres above 0"),
        "simulation": (lambda v: isinstance(v, bool), "true or false"),
        "ready_timeout": (is_number, "a number of seconds above 0"),
        "exit_when_done": (lambda v: isinstance(v, bool), "true or false"),
        "result": (lambda v: isinstance(v, str), "a file to write, or nothing"),
        "resume": (lambda v: isinstance(v, bool), "true or false"),
        "journal": (lambda v: isinstance(v, str), "a file to write, or nothing"),
    }
    return [
        f"{name}: {key}: is {values[key]!r}; expected {expected}"
        for key, (accepts, expected) in rules.items()
        if not accepts(values[key])
    ]


def _result_faults(result: Path, name: str) -> List[str]:
    try:
        result.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        expected = "a file in a folder that exists or can be made"
        return [
            (f"{name}: result: {result} cannot be written: {error.strerror}; expected {expected}")
        ]
    if result.is_dir() or not os.access(result.parent, os.W_OK):
        return [f"{name}: result: {result} cannot be written; expected a file to write"]
    return []


def _unknown(parameters: Mapping[str, Any], name: str) -> List[str]:
    """No faults: a parameter server keeps what earlier launches set."""
    known = [*DEFAULTS, *SETTINGS]
    warnings = []
    for key in sorted(set(parameters) - set(known)):
        near = difflib.get_close_matches(key, known, n=1) or [f"one of {', '.join(known)}"]
        warnings.append(
            f"{name}: {key}: is not a parameter of the sequencer and does nothing; "
            f"expected {near[0]}"
        )
    return warnings


def _scene(values: Mapping[str, Any], problems: List[str]) -> Optional[Scene]:
    if (
        not isinstance(values["scene"], str)
        or not values["scene"]
        or (values["scene"] == RANDOM and problems)
    ):
        return None
    try:
        return scene_of(values)
    except InputError as error:
        problems += error.problems
        return None


def _robots(
    values: Mapping[str, Any],
    name: str,
    check: Optional[PlaceCheck],
    settings: SequenceSettings,
    problems: List[str],
) -> List[RobotGoals]:
    if values["goals"] != RANDOM:
        paths, missing = _goal_files(values, name)
        robots, faults = load_robot_goals(paths, check, settings)
        problems += missing + faults
        return robots
    if values["scene"] != RANDOM:
        problems.append(
            f"{name}: goals: {RANDOM} with scene {values['scene']!r}; expected a "
            f"folder of goal files, or scene {RANDOM}"
        )
    if problems:
        return []
    mission = mission_of(values)
    assert mission is not None
    return mission.robot_goals(settings)


def _navigators(
    values: Mapping[str, Any], all_parameters: Mapping[str, Any], problems: List[str]
) -> Dict[str, config.Configuration]:
    navigators: Dict[str, config.Configuration] = {}
    count = values["robots"] if isinstance(values["robots"], int) else 0
    if values["config"]:
        try:
            fleet = configurations(values["config"], count, mission_of(values))
            navigators = {f"move_base{index}": one for index, one in enumerate(fleet)}
        except InputError as error:
            problems += error.problems
        return navigators
    for index in range(count):
        name = f"move_base{index}"
        try:
            navigators[name] = config.load(all_parameters.get(name, {}), f"/{name}")
        except InputError as error:
            problems += error.problems
    return navigators


def _goal_files(values: Mapping[str, Any], name: str) -> Tuple[List[Path], List[str]]:
    """The goal files as far as they are there, and what is missing."""
    goals, count = values["goals"], values["robots"]
    if not isinstance(count, int):
        return [], []
    if isinstance(goals, str) and goals:
        return goal_paths(Path(goals).expanduser(), count)
    if not isinstance(goals, list):
        return [], []
    problems = (
        []
        if len(goals) == count
        else [f"{name}: goals: lists {len(goals)} files; expected one for each of {count} robots"]
    )
    return [Path(path).expanduser() for path in goals if isinstance(path, str)], problems
