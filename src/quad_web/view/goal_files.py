"""Goal files of a mission that a person edits on a page: read, checked, and written whole.

A source of a page delegates ``goal_files``, ``check_goals`` and ``save_goals`` of its ``Actions``
to a ``GoalFiles``. The sequencer watches the files, so it flies what was saved.
"""

from __future__ import annotations

import hashlib
import threading
from pathlib import Path
from typing import Callable, List, Mapping, Optional, Sequence, Tuple

from quad_nav.errors import InputError
from quad_nav.files.output import reason, write_bytes
from quad_nav.files.user_files import read_bytes
from quad_nav.mission.goal import goal_faults
from quad_nav.mission.goal_file import MAX_BYTES, GoalSequence, PlaceCheck, parse_goals
from quad_web.view.actions import Answer, GoalChange, GoalFileView
from quad_web.view.goal_edit import edited_text


class GoalFiles:
    """The goal files of a mission; safe to use from several threads.

    Nothing is kept between two calls: a file is identified by a hash of its content, so an edit of
    content that has changed meanwhile is refused.

    Attributes:
        files: Goal files by the robots' numbers.
    """

    def __init__(
        self, files: Mapping[int, Path], check_of: Callable[[int], Optional[PlaceCheck]]
    ) -> None:
        """Keep the paths; no file is read yet.

        Args:
            files: Goal files by the robots' numbers.
            check_of: Return the check for positions of a robot's goals that ``quad fly`` has, as
                ``scenario.goal_checks.place_check`` or ``MissionPreview.check``.
        """
        self.files = dict(files)
        self._check_of = check_of
        self._lock = threading.Lock()

    def goal_files(self) -> List[GoalFileView]:
        """Return the files as they are now, with what is wrong where one cannot be edited."""
        return [self._view(robot) for robot in sorted(self.files)]

    def check_goals(self, robot: int, version: str, goals: Sequence[GoalChange]) -> List[str]:
        """Return the fault of each goal, as ``quad fly`` has it, "" for a good one.

        Args:
            robot: Number of the robot.
            version: Not used: positions are checked against the scene.
            goals: All goals of the edited file, in order.
        """
        check_place = self._check_of(robot)
        return [_fault(goal, check_place) for goal in goals]

    def save_goals(self, robot: int, version: str, goals: Sequence[GoalChange]) -> Answer:
        """Check the goals of a robot, and write its file if they are good.

        Args:
            robot: Number of the robot.
            version: Version of the file that was edited.
            goals: All goals of the new file, in order.
        """
        try:
            with self._lock:
                self.write(robot, self.edited(robot, version, goals))
        except InputError as error:
            return Answer(False, "not saved: " + "; ".join(error.problems))
        count = len(goals)
        text = f"{self.files[robot]}: saved, {count} goal{'s' * (count != 1)}"
        return Answer(True, text)

    def content(self, robot: int) -> bytes:
        """Return the content of a robot's file.

        Raises:
            InputError: There is no such file, or it cannot be read.
        """
        if robot not in self.files:
            raise InputError([f"quad{robot}: has no goal file that can be edited"])
        return read_bytes(self.files[robot], MAX_BYTES)

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
            InputError: The file has another version, or the new content has faults.
        """
        content = self.content(robot)
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
            for fault in goal_faults(_entry(goal))
        ]
        if faults:
            raise InputError(faults)
        new = edited_text(content.decode("utf-8"), goals).encode("utf-8")
        parse_goals(new, str(path), self._check_of(robot) if places else None)
        return new

    def write(self, robot: int, content: bytes) -> None:
        """Write a robot's file; a reader sees all of it or none of it.

        Raises:
            InputError: It cannot be written.
        """
        path = self.files[robot]
        try:
            write_bytes(path, content)
        except OSError as error:
            raise InputError([f"{path}: cannot be written: {reason(error)}"]) from error

    def _view(self, robot: int) -> GoalFileView:
        path = str(self.files[robot])
        try:
            content = self.content(robot)
            goals = _poses(parse_goals(content, path))
        except InputError as error:
            return GoalFileView(robot, path, "", [], "; ".join(error.problems))
        return GoalFileView(robot, path, version_of(content), goals)


def version_of(content: bytes) -> str:
    """Return what identifies the content of a goal file."""
    return hashlib.sha256(content).hexdigest()


def _poses(sequence: GoalSequence) -> List[Tuple[float, float, Optional[float]]]:
    return [(goal.x_m, goal.y_m, goal.yaw_rad) for goal in sequence.goals]


def _entry(goal: GoalChange) -> List[Optional[float]]:
    return [goal.x_m, goal.y_m, goal.yaw_rad]


def _fault(goal: GoalChange, check_place: Optional[PlaceCheck]) -> str:
    faults = [fault[len(": ") :] for fault in goal_faults(_entry(goal))]
    if not faults and check_place is not None:
        faults = [check_place(goal.x_m, goal.y_m) or ""]
    return "; ".join(faults)
