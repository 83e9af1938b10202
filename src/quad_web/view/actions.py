"""What a person can do to a fleet, and what comes of it."""

from __future__ import annotations

import enum
from dataclasses import dataclass, field
from typing import Any, Dict, FrozenSet, List, Optional, Tuple

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

LABELS: Dict[str, str] = {
    "start": "start",
    "pause": "pause",
    "reset": "reset",
    "set_rate": "rate",
    "seek": "go to a time",
    "send_goal": "send a goal",
    "cancel": "cancel the goal",
    "stop_all": "stop all",
    "clear_costmaps": "clear costmaps",
    "enable_lidar": "switch the LIDAR",
    "set_parameters": "change parameters",
    "set_pose": "set the pose",
    "set_uniform": "global localization",
    "save_goals": "save goals",
}
"""The actions that change something, with their names for people."""

READS = ("parameters", "goal_files", "check_goals")
"""The actions that change nothing and return lists."""

FLIGHT_ACTIONS = frozenset({*LABELS, *READS} - {"seek"})
"""Actions of a flight, with ROS and offline; a recording has others."""


class Actions:
    """What a person can do; the base class can do nothing.

    A source has a method for each name in ``available``, with these arguments and results:

    * ``start()``, also after a pause, ``pause()``, ``reset()`` to the start poses,
      ``set_rate(rate)`` in simulated seconds per second (0: as fast as it goes), ``seek(time_s)``
    * ``send_goal(robot, pose)`` in ``map``, None for the nearest robot; ``cancel(robot)``;
      ``stop_all()``; ``clear_costmaps(robot)``; ``enable_lidar(robot, is_on)``
    * ``set_pose(robot, pose)`` tells a robot where it is; ``set_uniform(robot)`` lets it search the
      whole map
    * ``parameters(robot)`` returns a list of ``ParameterView``, ``set_parameters(robot, namespace,
      values)`` changes those of one namespace
    * ``goal_files()`` returns a list of ``GoalFileView``, ``check_goals(robot, version, goals)``
      the fault of each goal ("" for a good one), ``save_goals(robot, version, goals)`` writes the
      file if they are good

    All others return an ``Answer``, whose text a person reads; nothing is raised for bad input.
    They may block for a few seconds: the page calls them in a thread.
    """

    available: FrozenSet[str] = frozenset()
    refusal = "not possible here"

    def call(self, name: str, *arguments: Any) -> Any:
        """Return what comes of an action, by its name."""
        if name in self.available:
            return getattr(self, name)(*arguments)
        return [] if name in READS else Answer(False, f"{name}: {self.refusal}")


class WatchOnly(Actions):
    """Tells what another one tells and refuses everything, for a page that may only watch."""

    refusal = "this page may only watch"

    def __init__(self, actions: Actions) -> None:
        self._actions = actions

    def call(self, name: str, *arguments: Any) -> Any:
        """Return parameters and goal files, and refuse the others."""
        if name in ("parameters", "goal_files"):
            return self._actions.call(name, *arguments)
        return super().call(name)
