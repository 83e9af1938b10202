"""What a person can do to a fleet, and what comes of it.

A source implements the methods that it can and names them in ``available``. Each returns an
``Answer``, whose text a person reads; nothing is raised for bad input. Methods may block for a few
seconds: the page calls them in a thread.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass, field
from typing import Any, FrozenSet, List, Mapping, Optional, Sequence, Tuple

from quad_nav.geometry import Pose2D
from quad_web.view.goal_edit import GoalEdit


class Role(enum.Enum):
    """What a person may do."""

    STEER = "steer"
    WATCH = "watch"


@dataclass(frozen=True)
class Answer:
    """What came of an action: whether it was carried out, and one sentence about it."""

    ok: bool
    text: str


@dataclass(frozen=True)
class ParameterView:
    """A parameter that can be changed in flight.

    Attributes:
        namespace: Below the robot's navigator, "" for its own ones.
        name: Name in the namespace.
        kind: "bool", "int", "double" or "str".
        value: Value in force.
        file_value: Value that was loaded.
        minimum: Least value, None without a limit.
        maximum: Greatest value, None without a limit.
        choices: Names and values of an enumeration, empty without one.
        doc: What it does, one sentence.
    """

    namespace: str
    name: str
    kind: str
    value: Any
    file_value: Any
    minimum: Optional[float] = None
    maximum: Optional[float] = None
    choices: Tuple[Tuple[str, Any], ...] = ()
    doc: str = ""


@dataclass(frozen=True)
class GoalFileView:
    """A goal file that can be edited.

    Attributes:
        robot: Number of the robot.
        path: The file.
        version: Identifies its content; a save names the version that it changes.
        goals: x, y and yaw (None: any) of each goal.
        problem: Why the file cannot be edited, "" if it can.
    """

    robot: int
    path: str
    version: str
    goals: List[Tuple[float, float, Optional[float]]] = field(default_factory=list)
    problem: str = ""


GoalChange = GoalEdit
"""One goal of an edited file: its number in the file (None: a new one), and its pose."""


FLIGHT_ACTIONS = frozenset(
    {
        "start",
        "pause",
        "reset",
        "set_rate",
        "send_goal",
        "cancel",
        "stop_all",
        "clear_costmaps",
        "enable_lidar",
        "parameters",
        "set_parameters",
        "goal_files",
        "check_goals",
        "save_goals",
    }
)
"""Actions of a flight, with ROS and offline; a recording has others."""


class Actions:
    """What a person can do; the base class can do nothing.

    Attributes:
        available: Names of the methods that work here, such as "start" or "send_goal".
    """

    available: FrozenSet[str] = frozenset()
    _refusal = "not possible here"

    def start(self) -> Answer:
        """Start the simulation or play the recording, also after a pause."""
        return self._refused("start")

    def pause(self) -> Answer:
        """Stop the clock."""
        return self._refused("pause")

    def reset(self) -> Answer:
        """Put every robot back to its start pose."""
        return self._refused("reset")

    def set_rate(self, rate: float) -> Answer:
        """Set simulated seconds per second; 0 is as fast as it goes."""
        return self._refused("set_rate")

    def seek(self, time_s: float) -> Answer:
        """Go to a time of a recording."""
        return self._refused("seek")

    def send_goal(self, robot: Optional[int], pose: Pose2D) -> Answer:
        """Send a robot to a pose in ``map``; None sends the one that is nearest to it."""
        return self._refused("send_goal")

    def cancel(self, robot: int) -> Answer:
        """Cancel the goal of a robot, which then hovers; its mission goes on as documented."""
        return self._refused("cancel")

    def stop_all(self) -> Answer:
        """Cancel all goals, end all missions: every robot hovers."""
        return self._refused("stop_all")

    def clear_costmaps(self, robot: int) -> Answer:
        """Clear the obstacles in a robot's costmaps."""
        return self._refused("clear_costmaps")

    def enable_lidar(self, robot: int, is_on: bool) -> Answer:
        """Switch a robot's LIDAR on or off."""
        return self._refused("enable_lidar")

    def parameters(self, robot: int) -> Sequence[ParameterView]:
        """Return the parameters of a robot's navigator that can be changed in flight."""
        return ()

    def set_parameters(self, robot: int, namespace: str, values: Mapping[str, Any]) -> Answer:
        """Change parameters of one namespace."""
        return self._refused("set_parameters")

    def goal_files(self) -> Sequence[GoalFileView]:
        """Return the goal files of the mission as they are now."""
        return ()

    def check_goals(self, robot: int, version: str, goals: Sequence[GoalChange]) -> List[str]:
        """Return the fault of each goal, "" for a good one."""
        return [""] * len(goals)

    def save_goals(self, robot: int, version: str, goals: Sequence[GoalChange]) -> Answer:
        """Check the goals of a robot, and write its file if they are good."""
        return self._refused("save_goals")

    def _refused(self, name: str) -> Answer:
        return Answer(False, f"{name}: {self._refusal}")


class WatchOnly(Actions):
    """Tells what another one tells and refuses everything, for a page that may only watch."""

    _refusal = "this page may only watch"

    def __init__(self, actions: Actions) -> None:
        self._actions = actions

    def parameters(self, robot: int) -> Sequence[ParameterView]:
        """Return the parameters of a robot's navigator."""
        return self._actions.parameters(robot)

    def goal_files(self) -> Sequence[GoalFileView]:
        """Return the goal files of the mission as they are now."""
        return self._actions.goal_files()
