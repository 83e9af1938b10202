"""Errors that this package raises on purpose, and their effect on a goal.

The failure of a planner is an exception, so that no caller can mistake it for a plan. A goal
that ends in one of them is aborted, with its message.
"""

from __future__ import annotations

import os
from contextlib import contextmanager
from typing import Any, Iterator, List, NoReturn, Sequence

MAX_PROBLEMS = 100
_MAX_LENGTH = 2000


class QuadError(Exception):
    """Base class of all errors."""


class InputError(QuadError):
    """Invalid user input: file, place, what was expected.

    The message has one line for each problem, all at once. Control characters are escaped, and
    long lists and lines are cut, because the input may come from others.

    Attributes:
        problems: One line for each problem.
    """

    def __init__(self, problems: Sequence[str]) -> None:
        """Create an error from one line for each problem."""
        self.problems: List[str] = [_line(problem) for problem in problems[:MAX_PROBLEMS]]
        if len(problems) > MAX_PROBLEMS:
            self.problems.append(f"... and {len(problems) - MAX_PROBLEMS} more problems")
        super().__init__("\n".join(self.problems))


class NavigationError(QuadError):
    """Failure while navigating."""


class PluginError(QuadError):
    """Mistake in a plugin of a user, with its file and line.

    Attributes:
        summary: Summary of the flight that it ended, if any: a ``MissionSummary``.
    """

    summary: Any = None


class PlanningError(NavigationError):
    """No global plan."""


class StartOutsideMap(PlanningError):
    """The robot is outside of the global costmap."""


class GoalOutsideMap(PlanningError):
    """The goal is outside of the global costmap."""


class NoPath(PlanningError):
    """No path leads from the robot's cell to the goal."""


class ControlError(NavigationError):
    """No velocity command."""


class NoValidTrajectory(ControlError):
    """Every sampled trajectory collides or leaves the costmap."""


class NoLocalPlan(ControlError):
    """No part of the global plan is inside the local costmap, or there is no plan."""


class InvalidGoal(NavigationError):
    """The pose of a goal is invalid: no rotation, not finite, or in an unknown frame."""


def assert_never(value: NoReturn) -> NoReturn:
    """Tell mypy that every kind of value is handled before; Python 3.11 has it in ``typing``."""
    raise AssertionError(f"{value!r} is not handled")


def printable(text: object, keep: str = "") -> str:
    """Escape each character that a terminal would obey instead of show.

    These are control characters, line ends, and marks that change the direction of text. Everything
    that goes to a terminal passes through here, because keys, names and messages may come from
    others. Escaping twice changes nothing.

    Args:
        text: Text, or an object with one.
        keep: Characters that stay, such as the line ends of a table.
    """
    return "".join(
        c if c.isprintable() or c in keep else c.encode("unicode_escape").decode()
        for c in str(text)
    )


def excerpt(text: str, limit: int = 200, keep: str = "") -> str:
    """Cut a long text and escape the rest, for strings of messages in logs.

    Args:
        text: Text of unknown origin.
        limit: Number of characters that are kept.
        keep: Characters that are not escaped.
    """
    if len(text) > limit:
        text = f"{text[:limit]} ... ({len(text)} characters)"
    return text if text.isprintable() else printable(text, keep)


def _line(problem: str) -> str:
    """Cut a long problem and escape what would not stay in its line."""
    if len(problem) > _MAX_LENGTH:
        problem = problem[:_MAX_LENGTH] + " ..."
    return printable(problem)


@contextmanager
def discarded_stderr() -> Iterator[None]:
    """Discard what C code prints to standard error meanwhile; exceptions are not affected."""
    try:
        kept = os.dup(2)
    except OSError:  # standard error is closed
        yield
        return
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 2)
    try:
        yield
    finally:
        os.dup2(kept, 2)
        os.close(null)
        os.close(kept)
