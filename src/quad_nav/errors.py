"""Every error that this package raises on purpose, and what it means to a goal.

A planner's failure is an exception, so that no caller can mistake it for a
plan. A goal that ends in one of them is aborted, with its words.
"""

from __future__ import annotations

from typing import List, Sequence

MAX_PROBLEMS = 100
_LONGEST_LINE = 2000


class QuadError(Exception):
    """Root of the tree."""


class InputError(QuadError):
    """Something that a person wrote cannot be used: file, place, what was expected.

    ``problems`` holds one line per fault; nothing is reported one at a time. What a
    terminal would take for a command is written as an escape, and lists without an end end.
    """

    def __init__(self, problems: Sequence[str]):
        self.problems: List[str] = [_line(problem) for problem in problems[:MAX_PROBLEMS]]
        if len(problems) > MAX_PROBLEMS:
            self.problems.append(f"... and {len(problems) - MAX_PROBLEMS} faults more")
        super().__init__("\n".join(self.problems))


class NavigationError(QuadError):
    """Something that happens while navigating."""


class PlanningError(NavigationError):
    """No global plan."""


class StartOutsideMap(PlanningError):
    """The robot is not on the global costmap."""


class GoalOutsideMap(PlanningError):
    """The goal is not on the global costmap."""


class NoPath(PlanningError):
    """The goal cannot be reached from the robot's cell."""


class ControlError(NavigationError):
    """No velocity command."""


class NoValidTrajectory(ControlError):
    """Every sampled trajectory collides or leaves the costmap."""


class NoLocalPlan(ControlError):
    """The global plan has no part in the local window, or there is none."""


class InvalidGoal(NavigationError):
    """The goal's pose cannot be used: not a rotation, not finite, unknown frame."""


def _line(problem: str) -> str:
    if len(problem) > _LONGEST_LINE:
        problem = problem[:_LONGEST_LINE] + " ..."
    return "".join(
        c if c.isprintable() or c == "\n" else c.encode("unicode_escape").decode() for c in problem
    )
