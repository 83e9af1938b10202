"""Goal files of all robots of a mission, and edits of them during the mission."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Dict, List, Mapping, Optional, Sequence, Tuple, Union

from quad_nav.errors import InputError
from quad_nav.files.user_files import read_bytes
from quad_nav.mission.goal_file import (
    DEFAULT_SETTINGS,
    MAX_BYTES,
    GoalSequence,
    PlaceCheck,
    SequenceSettings,
    load_goals,
)


class WatchedGoalFile:
    """Goal file that a person may edit during the mission."""

    def __init__(
        self,
        path: Union[str, Path],
        check_place: Optional[PlaceCheck] = None,
        defaults: SequenceSettings = DEFAULT_SETTINGS,
    ) -> None:
        self.path = Path(path)
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
        return load_goals(self.path, self._check_place, self._defaults)

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
        return load_goals(self.path, self._check_place, self._defaults)

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


def goal_paths(folder: Path, robots: int) -> Tuple[Dict[int, Path], List[str]]:
    """Find ``quad0_goals.json`` and so on in a folder.

    Returns:
        The existing files, by the robots' numbers, and a fault for those missing.
    """
    if not folder.is_dir():
        return {}, [
            f"goals: folder {folder} does not exist; expected one with quad0_goals.json and so on"
        ]
    paths = {number: folder / f"quad{number}_goals.json" for number in range(robots)}
    missing = [path.name for path in paths.values() if not path.exists()]
    if not missing:
        return paths, []
    present = sorted(path.name for path in folder.glob("*.json")) or ["no JSON file"]
    return (
        {number: path for number, path in paths.items() if path.exists()},
        [
            f"{folder}: has no {_listed(missing)}; expected a goal file for each of {robots} "
            f"robots; the folder has {_listed(present)}"
        ],
    )


def load_robot_goals(
    paths: Mapping[int, Path],
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
    for number, path in paths.items():
        file = WatchedGoalFile(path, checks.get(number), settings.get(number, DEFAULT_SETTINGS))
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
