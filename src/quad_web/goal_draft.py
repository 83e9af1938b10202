"""The goals of one file while a person edits them, before they are saved."""

from __future__ import annotations

from typing import Any, Dict, List, Mapping, Optional, Sequence

from quad_nav.mission.goal import goal_faults
from quad_web.view.actions import GoalChange, GoalFileView

FIELDS = ("x", "y", "yaw")


class GoalDraft:
    """An edited goal file.

    Attributes:
        file: The file as it was read.
        goals: ``{"source", "x", "y", "yaw"}`` of each goal in order; ``source`` is its number in
            the file (None: a new one), and a value that is no number is kept as it was typed.
        faults: What is wrong with each goal, "" for a good one.
    """

    def __init__(self, file: GoalFileView) -> None:
        """Begin with the file's goals."""
        self.file = file
        self.goals: List[Dict[str, Any]] = _entries(file)
        self.faults: List[str] = [""] * len(self.goals)

    @property
    def is_changed(self) -> bool:
        """Whether the goals differ from the file's."""
        return self.goals != _entries(self.file)

    @property
    def fault_count(self) -> int:
        """Number of goals with a fault."""
        return sum(map(bool, self.faults))

    def take(self, goals: Sequence[GoalChange]) -> None:
        """Take the goals of the arena, where goals are dragged, added and deleted."""
        self.goals = [
            {"source": goal.source, "x": goal.x_m, "y": goal.y_m, "yaw": goal.yaw_rad}
            for goal in goals
        ]
        self._check_values()

    def set(self, index: int, field: str, value: Any) -> None:
        """Set x, y or yaw of a goal; None takes its yaw away."""
        self.goals[index][field] = value
        self._check_values()

    def add(self, x_m: float, y_m: float, yaw_rad: Optional[float] = None) -> None:
        """Append a goal."""
        self.goals.append({"source": None, "x": x_m, "y": y_m, "yaw": yaw_rad})
        self._check_values()

    def delete(self, index: int) -> None:
        """Delete a goal."""
        del self.goals[index]
        self._check_values()

    def move(self, index: int, by: int) -> None:
        """Move a goal towards the start (-1) or the end (1) of the list."""
        to = index + by
        if 0 <= to < len(self.goals):
            self.goals[index], self.goals[to] = self.goals[to], self.goals[index]
            self._check_values()

    def changes(self) -> Optional[List[GoalChange]]:
        """Return the goals to save, None if a value is no valid number."""
        changes = self.valid_changes()
        return changes if len(changes) == len(self.goals) else None

    def valid_changes(self) -> List[GoalChange]:
        """Return the goals whose values are valid numbers, to check their positions."""
        return [
            GoalChange(goal["source"], goal["x"], goal["y"], goal["yaw"])
            for goal in self.goals
            if not _value_fault(goal)
        ]

    def found(self, faults: Sequence[str]) -> None:
        """Take the faults of the positions of ``valid_changes``."""
        found = iter(faults)
        self.faults = [_value_fault(goal) or next(found, "") for goal in self.goals]

    def _check_values(self) -> None:
        self.faults = [_value_fault(goal) for goal in self.goals]


def entry_fault(entry: List[Any]) -> str:
    """Return what a file's reader says about x, y and yaw of a goal, "" if nothing."""
    return "; ".join(fault[len(": ") :] for fault in goal_faults(entry))


def _value_fault(goal: Mapping[str, Any]) -> str:
    return entry_fault([goal[name] for name in FIELDS])


def _entries(file: GoalFileView) -> List[Dict[str, Any]]:
    return [
        {"source": index, "x": x_m, "y": y_m, "yaw": yaw_rad}
        for index, (x_m, y_m, yaw_rad) in enumerate(file.goals)
    ]
