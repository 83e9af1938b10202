"""Goal files of all robots of a mission, and edits of them during the mission."""

from __future__ import annotations

import itertools
import re
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple, Union

from quad_nav.errors import InputError
from quad_nav.files.user_files import read_bytes, read_text
from quad_nav.mission.goal_file import (
    DEFAULT_SETTINGS,
    MAX_BYTES,
    GoalSequence,
    SequenceSettings,
    load_goals,
)
from quad_nav.mission.place_check import PlaceCheck
from quad_nav.mission.waypoint_list import read_waypoints

_SUFFIXES = {".json", ".yaml", ".yml", ".csv", ".txt", ".plan", ".waypoints"}


class GoalSource(NamedTuple):
    """A file with goals, and which of the robots in it."""

    path: Path
    robot: int = 0


class WatchedGoalFile:
    """Goal file that a person may edit during the mission."""

    def __init__(
        self,
        path: Union[str, Path],
        check_place: Optional[PlaceCheck] = None,
        defaults: SequenceSettings = DEFAULT_SETTINGS,
        robot: int = 0,
    ) -> None:
        """Keep what ``load_goals`` needs; ``robot`` is the one of those in the file."""
        self.path = Path(path)
        self._robot = robot
        self._check_place = check_place
        self._defaults = defaults
        self._checked: Optional[bytes] = None
        self._seen: Optional[bytes] = None

    def load(self) -> GoalSequence:
        """Read the file; later polls compare with this content.

        Raises:
            InputError: The file cannot be read, or has faults; lists all of them.
        """
        self._checked = self._seen = self._content()
        return load_goals(self.path, self._check_place, self._defaults, self._robot)

    def poll(self) -> Optional[GoalSequence]:
        """Return the new sequence if the file has changed, else None.

        A change counts when two polls have read the same content, so that a file is not read
        while an editor is writing it.

        Raises:
            InputError: The new content has faults. Raised once for each change.
        """
        content = self._content()
        is_stable, self._seen = content == self._seen, content
        if not is_stable or content == self._checked:
            return None
        self._checked = content
        return load_goals(self.path, self._check_place, self._defaults, self._robot)

    def _content(self) -> Optional[bytes]:
        # A missing file counts as a change; load_goals raises the error.
        try:
            return read_bytes(self.path, MAX_BYTES)
        except InputError:
            return None


@dataclass(frozen=True)
class RobotGoals:
    """Name of a robot, its goal file and the goals in the file at the start."""

    name: str
    file: WatchedGoalFile
    sequence: GoalSequence


def goal_paths(
    goals: Path, robots: Optional[int] = None
) -> Tuple[Dict[int, GoalSource], List[str]]:
    """Find the goals of robots in a folder, or in one file.

    Args:
        goals: A folder with ``quad0_goals.json`` and so on, or with the lists of waypoints of
            robots, by the numbers in their names or by their names; or a file, which may have the
            waypoints of several robots.
        robots: Number of robots; None for as many as have goals.

    Returns:
        The files, by the robots' numbers, and a fault for those missing.
    """
    if goals.is_file():
        found = _sources(goals)
        return dict(enumerate(found[:robots])), _too_few(goals, len(found), robots)
    if not goals.is_dir():
        return {}, [
            f"goals: folder {goals} does not exist; expected one with quad0_goals.json and so on"
        ]
    found = [] if any(goals.glob("quad*_goals.json")) else _sources_in(goals)
    if not found:
        return _named_paths(goals, robots)
    return dict(enumerate(found[:robots])), _too_few(goals, len(found), robots)


def _named_paths(folder: Path, robots: Optional[int]) -> Tuple[Dict[int, GoalSource], List[str]]:
    """Return the goal files with our names, those before the first gap if ``robots`` is None."""
    if robots is None:
        robots = 1
        while (folder / f"quad{robots}_goals.json").exists():
            robots += 1
    wanted = [folder / f"quad{number}_goals.json" for number in range(robots)]
    paths = {k: GoalSource(path) for k, path in enumerate(wanted) if path.exists()}
    missing = [path.name for path in wanted if not path.exists()]
    if not missing:
        return paths, []
    present = sorted(path.name for path in folder.glob("*.json")) or ["no JSON file"]
    return paths, [
        f"{folder}: has no {_listed(missing)}; expected a goal file for each of {robots} "
        f"robots; the folder has {_listed(present)}"
    ]


def _sources_in(folder: Path) -> List[GoalSource]:
    """Return the robots of the lists of waypoints in a folder, by the numbers in the files' names.

    Files without numbers come in the order of their names.
    """
    known = (path for path in folder.iterdir() if path.suffix.lower() in _SUFFIXES)
    files = sorted(path for path in known if _has_goals(path))
    numbers = {path: [int(one) for one in re.findall(r"\d+", path.stem)] for path in files}
    if all(numbers.values()):
        files.sort(key=lambda path: numbers[path])
    return [one for path in files for one in _sources(path)]


def _has_goals(path: Path) -> bool:
    """Return whether a file of a folder has goals, perhaps with faults."""
    try:
        text = read_text(path, MAX_BYTES)
        return read_waypoints(text, str(path)) is not None or '"goals"' in text
    except InputError:
        return True


def _sources(path: Path) -> List[GoalSource]:
    """Return the robots of a file; one for a goal file, and for a file with faults."""
    try:
        waypoints = read_waypoints(read_text(path, MAX_BYTES), str(path))
    except InputError:
        return [GoalSource(path)]
    return [GoalSource(path, k) for k in range(len(waypoints.robots) if waypoints else 1)]


def _too_few(goals: Path, found: int, robots: Optional[int]) -> List[str]:
    if robots is None or found >= robots:
        return []
    return [f"{goals}: has goals of {found} robot{'s' * (found != 1)}; expected {robots}, --robots"]


def load_robot_goals(
    paths: Mapping[int, GoalSource],
    checks: Mapping[int, PlaceCheck] = MappingProxyType({}),
    settings: Mapping[int, SequenceSettings] = MappingProxyType({}),
) -> Tuple[List[RobotGoals], List[str]]:
    """Read the goal files of several robots.

    Args:
        paths: The files, by the robots' numbers.
        checks: Checks for the positions of goals, by the robots' numbers.
        settings: Settings that a file does not give, by the robots' numbers.

    Returns:
        The goals of each readable file, and all faults in the other files.
    """
    robots: List[RobotGoals] = []
    problems: List[str] = []
    for number, (path, robot) in paths.items():
        own = settings.get(number, DEFAULT_SETTINGS)
        file = WatchedGoalFile(path, checks.get(number), own, robot)
        try:
            robots.append(RobotGoals(f"quad{number}", file, file.load()))
        except InputError as error:
            problems += error.problems
    return robots, problems


def last_goal_conflicts(robots: Sequence[RobotGoals], radius_m: float) -> List[str]:
    """Return a warning for each pair of robots whose last goals are too close to stay at both."""
    staying = [robot for robot in robots if robot.sequence.settings.loop is False]
    warnings = []
    for a, b in itertools.combinations(staying, 2):
        distance_m = a.sequence.goals[-1].pose.distance_to(b.sequence.goals[-1].pose)
        if distance_m < 2 * radius_m:
            warnings.append(
                f"{a.name}, {b.name}: their last goals are {distance_m:.2f} m apart, so the robots "
                f"would collide there; expected at least two radii, {2 * radius_m:.2f} m"
            )
    return warnings


def _listed(names: Sequence[str], at_most: int = 8) -> str:
    more = len(names) - at_most
    return ", ".join(names[:at_most]) + (f" and {more} more" if more > 0 else "")
