"""Goal files of a mission that a person edits on a page: read, checked, and written whole.

The sequencer watches the files, so it flies what was saved.
"""

from __future__ import annotations

import hashlib
import threading
from pathlib import Path
from typing import Callable, List, Mapping, Optional, Sequence

from quad_nav.errors import InputError
from quad_nav.files.output import reason, write_bytes
from quad_nav.files.user_files import read_bytes
from quad_nav.mission.goal import goal_faults
from quad_nav.mission.goal_file import MAX_BYTES, parse_goals
from quad_nav.mission.place_check import PlaceCheck
from quad_web.view.actions import Actions, Answer, GoalChange, GoalFileView
from quad_web.view.goal_edit import edited_text


class GoalFiles:
    """The goal files of a mission by the robots' numbers; safe to use from several threads.

    Nothing is kept between two calls: a file is identified by a hash of its content, so an edit of
    content that has changed meanwhile is refused.
    """

    def __init__(
        self, files: Mapping[int, Path], check_of: Callable[[int], Optional[PlaceCheck]]
    ) -> None:
        """Keep the paths; ``check_of`` returns the check for positions of a robot's goals."""
        self.files = dict(files)
        self._check_of = check_of
        self._lock = threading.Lock()

    def goal_files(self) -> List[GoalFileView]:
        """Return the files as they are now, with what is wrong where one cannot be edited."""
        return [self._view(robot) for robot in sorted(self.files)]

    def check_goals(self, robot: int, goals: Sequence[GoalChange]) -> List[str]:
        """Return the fault of each goal, as ``quad fly`` has it, "" for a good one."""
        check_place = self._check_of(robot)
        return [_fault(goal, check_place) for goal in goals]

    def save_goals(self, robot: int, version: str, goals: Sequence[GoalChange]) -> Answer:
        """Check the goals of a robot, and write its file if they are good."""
        try:
            with self._lock:
                content = self.edited(robot, version, goals)
                path = self.files[robot]
                try:
                    write_bytes(path, content)  # a reader sees all of it or none of it
                except OSError as error:
                    raise InputError([f"{path}: cannot be written: {reason(error)}"]) from error
        except InputError as error:
            return Answer(False, "not saved: " + "; ".join(error.problems))
        count = len(goals)
        return Answer(True, f"{path}: saved, {count} goal{'s' * (count != 1)}")

    def edited(
        self, robot: int, version: str, goals: Sequence[GoalChange], places: bool = True
    ) -> bytes:
        """Return the new content of a robot's file, after the checks of ``quad fly``.

        Args:
            robot: Number of the robot.
            version: Version of the file that was edited.
            goals: All goals of the new file, in order.
            places: Whether the goals' positions are checked too.

        Raises:
            InputError: There is no such file, it cannot be read or has another version, or the new
                content has faults.
        """
        if robot not in self.files:
            raise InputError([f"quad{robot}: has no goal file that can be edited"])
        content = read_bytes(self.files[robot], MAX_BYTES)
        path = self.files[robot]
        if version_of(content) != version:
            raise InputError(
                [f"{path}: has changed since the page was loaded; reload the page to edit it"]
            )
        before = parse_goals(content, str(path))
        if not {goal.source for goal in goals} - {None} <= set(range(len(before.goals))):
            raise InputError([f"quad{robot}: a goal is not one of the file's; reload the file"])
        faults = [
            f"{path}: goals[{index}] (goal {index + 1}){fault}"
            for index, goal in enumerate(goals)
            for fault in goal_faults([goal.x_m, goal.y_m, goal.yaw_rad])
        ]
        if faults:
            raise InputError(faults)
        new = edited_text(content.decode("utf-8"), goals).encode("utf-8")
        parse_goals(new, str(path), self._check_of(robot) if places else None)
        return new

    def _view(self, robot: int) -> GoalFileView:
        path = str(self.files[robot])
        try:
            content = read_bytes(self.files[robot], MAX_BYTES)
            sequence = parse_goals(content, path)
            if sequence.read_as:
                expected = "expected a goal file to edit, as of quad goals convert"
                raise InputError([f"{path}: {sequence.read_as}; {expected}"])
            goals = [(goal.x_m, goal.y_m, goal.yaw_rad) for goal in sequence.goals]
        except InputError as error:
            return GoalFileView(robot, path, "", [], "; ".join(error.problems))
        return GoalFileView(robot, path, version_of(content), goals)


class GoalEditing(Actions):
    """Base of sources with ``GoalFiles``, which it keeps in ``_files``."""

    _files = GoalFiles({}, lambda robot: None)

    def goal_files(self) -> List[GoalFileView]:
        """Return the goal files of the mission as they are now."""
        return self._files.goal_files()

    def check_goals(self, robot: int, version: str, goals: Sequence[GoalChange]) -> List[str]:
        """Return the fault of each goal, "" for a good one."""
        return self._files.check_goals(robot, goals)

    def save_goals(self, robot: int, version: str, goals: Sequence[GoalChange]) -> Answer:
        """Check the goals of a robot, and write its file if they are good."""
        return self._files.save_goals(robot, version, goals)


def version_of(content: bytes) -> str:
    """Return what identifies the content of a goal file."""
    return hashlib.sha256(content).hexdigest()


def _fault(goal: GoalChange, check_place: Optional[PlaceCheck]) -> str:
    values = [goal.x_m, goal.y_m, goal.yaw_rad]
    faults = [fault[len(": ") :] for fault in goal_faults(values)]
    if not faults and check_place is not None:
        faults = [check_place(goal.x_m, goal.y_m) or ""]
    return "; ".join(faults)
