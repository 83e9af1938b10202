"""Goal files: ``{"goals": [[x, y], [x, y, yaw], ...]}``, metres and radians in ``map``.

A goal with further settings is an object: ``{"x": 1.0, "y": 2.0, "yaw": null, "wait_s": 5.0}``.
Other people's lists of waypoints are read as well, see ``waypoint_list``. A file with a fault is
refused as a whole. The error lists every fault as ``file: place: what is wrong; what was
expected``. ``goals/schema.json`` describes the format for editors, ``docs/goals.md`` for people.
"""

from __future__ import annotations

import dataclasses
import json
import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Dict, Iterable, Iterator, List, Mapping, Optional, Tuple, Union

import numpy as np

from quad_nav.errors import InputError
from quad_nav.files.user_files import read_bytes
from quad_nav.files.values import expected_name, is_number
from quad_nav.mission.goal import (
    ALTITUDES,
    MAX_TIMEOUT_S,
    YAW_TOLERANCE,
    Goal,
    Setting,
    altitude_fault,
    goal_faults,
    position_tolerance,
    read_goal,
    show,
)
from quad_nav.mission.place_check import PlaceCheck
from quad_nav.mission.waypoint_list import WaypointList, read_waypoints

MAX_BYTES = 4 * 1024 * 1024
MAX_GOALS = 10_000
DEFAULT_YAW_TOLERANCE_RAD = 0.1
"""Tolerance of a robot whose local planner is unknown or has no ``yaw_goal_tolerance``."""

_OWN_NAME = re.compile(r"quad\d+_goals\.json$")


@dataclass(frozen=True)
class SequenceSettings:
    """Tolerance, retries and repetition; times are simulated if there is a simulation.

    Attributes:
        goal_tolerance_m: Distance from the goal within which it counts as reached.
        goal_timeout_s: Time for one attempt.
        retries: Further attempts before the goal is skipped.
        loop: Start again with the first goal after the last one.
        yaw_tolerance_rad: Error of the yaw within which a goal with a yaw counts as reached; None
            for ``DEFAULT_YAW_TOLERANCE_RAD``.
    """

    goal_tolerance_m: float = 0.4
    goal_timeout_s: float = 120.0
    retries: int = 1
    loop: bool = False
    yaw_tolerance_rad: Optional[float] = None


DEFAULT_SETTINGS = SequenceSettings()


@dataclass(frozen=True)
class GoalSequence:
    """Content of a goal file; ``read_as`` says so of a list of waypoints, "" for a goal file."""

    goals: Tuple[Goal, ...]
    settings: SequenceSettings = DEFAULT_SETTINGS
    read_as: str = ""

    def tolerance_m(self, goal: Goal) -> float:
        """Return the distance from a goal within which it counts as reached."""
        return self.settings.goal_tolerance_m if goal.tolerance_m is None else goal.tolerance_m

    def yaw_tolerance_rad(self, goal: Goal) -> float:
        """Return the error of the yaw within which a goal with a yaw counts as reached."""
        for tolerance_rad in (goal.yaw_tolerance_rad, self.settings.yaw_tolerance_rad):
            if tolerance_rad is not None:
                return tolerance_rad
        return DEFAULT_YAW_TOLERANCE_RAD

    def warnings(self, planner_m: float, planner_rad: float) -> Iterator[str]:
        """Yield what may be a mistake in the file: tolerances that the local planner may miss.

        They are no faults: the robot usually stops nearer than the planner's tolerance demands.

        Args:
            planner_m: ``xy_goal_tolerance`` of the local planner.
            planner_rad: Its ``yaw_goal_tolerance``.
        """
        near_m = min(map(self.tolerance_m, self.goals))
        turned = [goal for goal in self.goals if goal.yaw_rad is not None]
        near_rad = min(map(self.yaw_tolerance_rad, turned), default=math.inf)
        for value, planners, unit, name in (
            (near_m, planner_m, "m", "xy_goal_tolerance"),
            (near_rad, planner_rad, "rad", "yaw_goal_tolerance"),
        ):
            if value < planners:
                yield (
                    f"a tolerance of {value:g} {unit} is below the local planner's {name}, "
                    f"{planners:g} {unit}: the quadcopter may stop outside, and the goal would be "
                    f"skipped; expected {planners:g} {unit} or more, or a smaller {name}"
                )


SETTINGS: Dict[str, Setting] = {
    "goal_tolerance": position_tolerance("goal_tolerance_m"),
    "yaw_tolerance": YAW_TOLERANCE,
    "goal_timeout": Setting(
        "goal_timeout_s",
        lambda v: is_number(v) and 0 < v <= MAX_TIMEOUT_S,
        f"a number of seconds above 0, {MAX_TIMEOUT_S:g} at most",
    ),
    "retries": Setting(
        "retries",
        lambda v: is_number(v) and 0 <= v <= MAX_GOALS and v == int(v),
        f"a whole number, 0 to {MAX_GOALS}",
    ),
    "loop": Setting("loop", lambda v: isinstance(v, bool), "true or false"),
}
KEYS: Tuple[str, ...] = ("goals", "$schema", *SETTINGS)


def load_goals(
    path: Union[str, Path],
    check_place: Optional[PlaceCheck] = None,
    defaults: SequenceSettings = DEFAULT_SETTINGS,
    robot: int = 0,
) -> GoalSequence:
    """Read a goal file, or a list of waypoints.

    Args:
        path: The file.
        check_place: Check for the positions of goals.
        defaults: Settings that the file does not give.
        robot: Which of the robots of a list of waypoints.

    Returns:
        The goals as in the file, see ``parse_goals``.

    Raises:
        InputError: The file cannot be read, or has faults; lists all of them.
    """
    return parse_goals(read_bytes(Path(path), MAX_BYTES), str(path), check_place, defaults, robot)


def parse_goals(
    content: Union[bytes, str],
    name: str,
    check_place: Optional[PlaceCheck] = None,
    defaults: SequenceSettings = DEFAULT_SETTINGS,
    robot: int = 0,
) -> GoalSequence:
    """Parse the content of a goal file, or of a list of waypoints.

    Args:
        content: The content, UTF-8 if bytes.
        name: Name of the file, for messages.
        check_place: Check for the positions of goals.
        defaults: Settings that the content does not give.
        robot: Which of the robots of a list of waypoints.

    Returns:
        The goals as in the file, nothing added or moved: the page writes them back.

    Raises:
        InputError: Every fault of the content.
    """
    text = decoded(content, name)
    waypoints = _waypoints(text, name)
    if waypoints is not None:
        return goals_of(waypoints, name, check_place, defaults, robot)
    sequence, problems = _read_sequence(text, name, check_place, defaults)
    if problems:
        raise InputError(problems)
    return sequence


def readable_goals(path: Union[str, Path], robot: int = 0) -> Optional[GoalSequence]:
    """Read the goals of a file up to the first faulty one, to show them; None without any.

    ``load_goals`` has the faults, those in other keys included.
    """
    try:
        text = decoded(read_bytes(Path(path), MAX_BYTES), str(path))
        if _waypoints(text, str(path)) is not None:
            return load_goals(path, robot=robot)
        sequence, _ = _read_sequence(text, str(path))
    except InputError:
        return None
    return sequence if sequence.goals else None


def _waypoints(text: str, name: str) -> Optional[WaypointList]:
    """Read a list of another program; a mistake in a file with our name is no other format."""
    return None if _OWN_NAME.search(name) else read_waypoints(text, name)


def _read_sequence(
    text: str,
    name: str,
    check_place: Optional[PlaceCheck] = None,
    defaults: SequenceSettings = DEFAULT_SETTINGS,
) -> Tuple[GoalSequence, List[str]]:
    """Return what can be read, and the faults.

    Raises:
        InputError: The content is no JSON object.
    """
    tree, problems = _tree(text, name)
    if not isinstance(tree, dict):
        raise InputError([f'{name}: is {_kind(tree)}; expected {{"goals": [[x, y], ...]}}'])
    problems += [_unknown_key(name, key) for key in tree if key not in KEYS]
    if not isinstance(tree.get("$schema", ""), str):
        problems.append(f"{name}: $schema: is {show(tree['$schema'])}; expected a string")
    given = {key: tree[key] for key in SETTINGS if key in tree}
    settings, faults = read_settings(given, name, defaults)
    goals, faults_in_goals = _read_goals(tree, name, check_place)
    problems += faults + faults_in_goals
    sequence = GoalSequence(tuple(goals), settings)
    if not problems and settings.loop:
        problems += _loop_faults(sequence, name)
    return sequence, problems


def read_settings(
    values: Mapping[str, Any], name: str, defaults: SequenceSettings = DEFAULT_SETTINGS
) -> Tuple[SequenceSettings, List[str]]:
    """Return the settings with these names in a goal file, and the faults in their values."""
    problems = [
        f"{name}: {key}: is {show(value)}; expected {SETTINGS[key].expected}"
        for key, value in values.items()
        if not SETTINGS[key].accepts(value)
    ]
    if problems:
        return defaults, problems
    fields = {SETTINGS[key].field: value for key, value in values.items()}
    if "retries" in fields:
        fields["retries"] = int(fields["retries"])
    return dataclasses.replace(defaults, **fields), []


def goals_of(
    waypoints: WaypointList,
    name: str,
    check_place: Optional[PlaceCheck] = None,
    defaults: SequenceSettings = DEFAULT_SETTINGS,
    robot: int = 0,
) -> GoalSequence:
    """Return the goals of one robot of a list of waypoints; the arguments are ``parse_goals``'s.

    Raises:
        InputError: Its waypoints have faults, or there is no such robot.
    """
    if robot >= len(waypoints.robots):
        count = len(waypoints.robots)
        expected = f"expected one for each of {robot + 1} robots or more"
        raise InputError([f"{name}: has goals of {count} robot{'s' * (count > 1)}; {expected}"])
    entries = waypoints.entries(robot)
    if not 0 < len(entries) <= MAX_GOALS:
        found = "; ".join([f"{name}: has {len(entries)} waypoints", *waypoints.notes])
        raise InputError([f"{found}; expected 1 to {MAX_GOALS}"])
    goals: List[Goal] = []
    problems: List[str] = []
    for number, (value, place, faults) in enumerate(entries, 1):
        where = f"{name}: {place} (goal {number})"
        problems += [where + fault for fault in faults]
        if not faults:
            problems += _add_goal(goals, value, where, check_place)
    if problems:
        raise InputError(problems)
    read_as = waypoints.line(robot)
    spread_m = max(math.dist((goals[0].x_m, goals[0].y_m), (one.x_m, one.y_m)) for one in goals)
    if 0.0 < spread_m < defaults.goal_tolerance_m:
        read_as += f"; all of them within {spread_m:.2g} m: expected metres"
    return GoalSequence(tuple(goals), defaults, read_as)


def decoded(content: Union[bytes, str], name: str) -> str:
    """Return the text of a file.

    Raises:
        InputError: It is too long, or not UTF-8.
    """
    if len(content) > MAX_BYTES:
        raise InputError([f"{name}: has {len(content)} bytes; expected {MAX_BYTES} at most"])
    try:
        return content.decode("utf-8-sig") if isinstance(content, bytes) else content
    except UnicodeDecodeError as error:
        raise InputError(
            [f"{name}: byte {error.start} is not UTF-8; expected a JSON text"]
        ) from error


def _tree(text: str, name: str) -> Tuple[Any, List[str]]:
    """Decode JSON with every number a float; also return a fault for each repeated key."""
    problems: List[str] = []

    def unique(pairs: Iterable[Tuple[str, Any]]) -> Dict[str, Any]:
        tree: Dict[str, Any] = {}
        for key, value in pairs:
            if key in tree:
                problems.append(f"{name}: {key}: is given twice; expected once")
            tree[key] = value
        return tree

    # The tutorial prints its goal files without the outer braces.
    bare = text.lstrip().startswith('"goals"')
    try:
        # parse_int=float: an integer with a thousand digits becomes infinity, as 1e999 does.
        return json.loads(
            "{" + text + "}" if bare else text, object_pairs_hook=unique, parse_int=float
        ), problems
    except json.JSONDecodeError as error:
        column = error.colno - (bare and error.lineno == 1)
        problem = f"{name}:{error.lineno}:{column}: is not JSON: {error.msg}; "
        raise InputError([problem + 'expected {"goals": [[x, y], [x, y, yaw], ...]}']) from error
    except RecursionError as error:
        raise InputError(
            [f'{name}: is nested too deeply; expected {{"goals": [[x, y], ...]}}']
        ) from error


def _read_goals(
    tree: Dict[str, Any], name: str, check_place: Optional[PlaceCheck]
) -> Tuple[List[Goal], List[str]]:
    if "goals" not in tree:
        return [], [f'{name}: has no goals; expected "goals": [[x, y], ...]']
    entries = tree["goals"]
    if not isinstance(entries, list):
        return [], [f"{name}: goals: is {_kind(entries)}; expected a list [[x, y], ...]"]
    if not entries:
        return [], [f"{name}: goals: is empty; expected at least one goal [x, y]"]
    if len(entries) > MAX_GOALS:
        return [], [f"{name}: goals: are {len(entries)}; expected {MAX_GOALS} at most"]
    goals: List[Goal] = []
    problems: List[str] = []
    for index, entry in enumerate(entries):
        place = f"{name}: goals[{index}] (goal {index + 1})"
        # Behind a faulty one the number of a goal would be wrong.
        problems += _add_goal(goals if len(goals) == index else [], entry, place, check_place)
    return goals, problems


def _add_goal(
    goals: List[Goal], entry: Any, place: str, check_place: Optional[PlaceCheck]
) -> List[str]:
    """Add the goal of an entry, if its values are good, and return its faults."""
    faults = list(goal_faults(entry))
    if not faults:
        goal = read_goal(entry)
        goals.append(goal)
        fault = check_place(goal.x_m, goal.y_m) if check_place else None
        faults = [f": ({goal.x_m:g}, {goal.y_m:g}) {fault}"] if fault else []
    return [place + fault for fault in faults]


def _loop_faults(sequence: GoalSequence, name: str) -> List[str]:
    """Refuse a loop whose goals are all reached at one pose: it would never end there."""
    goals = sequence.goals
    places = np.array([(goal.x_m, goal.y_m) for goal in goals])
    near_m = np.array([sequence.tolerance_m(goal) for goal in goals])
    yaws = np.array([math.nan if goal.yaw_rad is None else goal.yaw_rad for goal in goals])
    near_rad = np.array([sequence.yaw_tolerance_rad(goal) for goal in goals])
    for place, tolerance_m, yaw_rad, tolerance_rad in zip(places, near_m, yaws, near_rad):
        turns_rad = np.abs(np.remainder(yaws - yaw_rad + math.pi, 2 * math.pi) - math.pi)
        is_apart = np.hypot(*(places - place).T) > near_m + tolerance_m
        if (is_apart | (turns_rad > near_rad + tolerance_rad)).any():
            return []
    least_m = 2 * sequence.settings.goal_tolerance_m
    expected = f"two goals more than twice the goal_tolerance apart ({least_m:g} m)"
    return [f"{name}: loop: all goals are reached at one position; expected {expected}"]


def _unknown_key(name: str, key: str) -> str:
    if key.lower() in ALTITUDES:
        return f"{name}: {altitude_fault(key)}"
    return f"{name}: {key}: is not a key of goal files; expected {expected_name(key.lower(), KEYS)}"


def _kind(value: Any) -> str:
    if isinstance(value, dict):
        return "an object"
    if isinstance(value, list):
        return "a list"
    return show(value)
