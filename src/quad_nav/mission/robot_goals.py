"""The goal files of all quadcopters of a mission."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from pathlib import Path
from typing import List, Optional, Sequence, Tuple

from quad_nav.errors import InputError
from quad_nav.mission.goal_file import PlaceCheck, WatchedGoalFile
from quad_nav.mission.goal_sequence import DEFAULT_SETTINGS, GoalSequence, SequenceSettings


@dataclass(frozen=True)
class RobotGoals:
    """One quadcopter's name, its goal file and what that said at the start."""

    name: str
    file: WatchedGoalFile
    sequence: GoalSequence


def goal_paths(folder: Path, robots: int) -> Tuple[List[Path], List[str]]:
    """``quad0_goals.json`` and so on as far as they are there, and what is missing."""
    if not folder.is_dir():
        return [], [
            f"goals: there is no folder {folder}; expected one with quad0_goals.json and so on"
        ]
    paths = [folder / f"quad{index}_goals.json" for index in range(robots)]
    missing = [path.name for path in paths if not path.exists()]
    if not missing:
        return paths, []
    there = sorted(path.name for path in folder.glob("*.json")) or ["no JSON file"]
    return (
        [path for path in paths if path.exists()],
        [
            f"{folder}: has no {_listed(missing)}; expected a goal file for each of {robots} "
            f"robots; there is {_listed(there)}"
        ],
    )


def load_robot_goals(
    paths: Sequence[Path],
    check_place: Optional[PlaceCheck] = None,
    settings: SequenceSettings = DEFAULT_SETTINGS,
) -> Tuple[List[RobotGoals], List[str]]:
    """Every quadcopter's goals that can be read, and every fault in the other files."""
    robots: List[RobotGoals] = []
    problems: List[str] = []
    for index, path in enumerate(paths):
        file = WatchedGoalFile(path, check_place, settings)
        try:
            robots.append(RobotGoals(f"quad{index}", file, file.load()))
        except InputError as error:
            problems += error.problems
    return robots, problems


def close_ends(robots: Sequence[RobotGoals], radius_m: float) -> List[str]:
    """Warnings about quadcopters that stay at their last goals and would touch there."""
    staying = [robot for robot in robots if robot.sequence.settings.loop is False]
    warnings = []
    for a, b in itertools.combinations(staying, 2):
        distance_m = a.sequence.goals[-1].pose.distance_to(b.sequence.goals[-1].pose)
        if distance_m < 2 * radius_m:
            warnings.append(
                f"the last goals of {a.name} and {b.name} are {distance_m:.2f} m apart: "
                f"they would touch there (two radii are {2 * radius_m:.2f} m)"
            )
    return warnings


def _listed(names: Sequence[str], at_most: int = 8) -> str:
    more = len(names) - at_most
    return ", ".join(names[:at_most]) + (f" and {more} more" if more > 0 else "")
