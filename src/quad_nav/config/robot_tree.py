"""Read the parameters of one robot from whatever the user names as its configuration.

Both shells read configurations here: ``quad fly`` and the nodes of a fleet call ``robot_tree``,
and the launch files run ``quad_nav.scenario.robot_parameters``, which prints its result.
Layouts other than that of the launch files, and configurations of other robots, need modules that
load slowly; those are imported when they are needed.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple

from quad_nav.config.files import (
    COSTMAPS,
    ParameterTree,
    PlacedFile,
    files_of,
    load_files,
    merge_tree,
    set_value,
)
from quad_nav.errors import InputError
from quad_nav.files.shipped import config_folder, is_shipped

COMMAND_LINE = "the command line"
"""Origin of a parameter that the user gives with ``--set``."""
BASE_FRAME = "base_link"
"""Frame of the robot if a configuration does not name it."""
_QUADCOPTER = re.compile(r"/*base_link\d+")


@dataclass(frozen=True)
class RobotSource:
    """Sources of one robot's parameters; a later one overrides an earlier one.

    Attributes:
        config: A shipped configuration, a folder or files, see ``sources``.
        number: Number of the robot.
        robots: Number of robots that fly together; None if they are not to be told.
        override: File that is loaded last, with paths relative to the node.
        parameters: (path, value) on top of the files.
    """

    config: str
    number: int
    robots: Optional[int] = None
    override: Optional[Path] = None
    parameters: Sequence[Tuple[str, Any]] = ()


def robot_tree(source: RobotSource) -> ParameterTree:
    """Read the parameter tree of one robot, fitted to a quadcopter.

    ``$(arg i)`` in a file is the robot's number.

    Raises:
        InputError: One line for every file that is missing or cannot be read.
    """
    return fitted(unfitted_tree(source), source.number)


def unfitted_tree(source: RobotSource) -> ParameterTree:
    """Read the parameter tree of one robot, as its files have it.

    Raises:
        InputError: One line for every file that is missing or cannot be read.
    """
    tree = ParameterTree()
    problems: List[str] = []
    try:
        merge_tree(tree, _configuration(source))
    except InputError as error:
        problems += error.problems
    if source.override is not None:
        try:
            file = PlacedFile(source.override.expanduser(), ("",))
            merge_tree(tree, load_files([file], {"i": str(source.number)}))
        except InputError as error:
            problems += error.problems
    if problems:
        raise InputError(problems)
    if source.robots is not None:
        set_value(tree, "robot", source.number, "the scenario")
        set_value(tree, "robots", source.robots, "the scenario")
    for path, value in source.parameters:
        set_value(tree, path, value, COMMAND_LINE)
    return tree


def fitted(tree: ParameterTree, number: int) -> ParameterTree:
    """Return a tree made for quadcopters as it is, and that of another robot adapted."""
    if is_of_quadcopter(tree):
        return tree
    from quad_nav.config.other_robots import adapted

    return adapted(tree, number)


def is_of_quadcopter(tree: Mapping[str, Any]) -> bool:
    """Tell by ``robot_base_frame`` if a configuration was made for quadcopters."""
    frames = [
        costmap.get("robot_base_frame", BASE_FRAME)
        for costmap in map(tree.get, COSTMAPS)
        if isinstance(costmap, dict)
    ]
    return any(isinstance(frame, str) and _QUADCOPTER.fullmatch(frame) for frame in frames)


def _configuration(source: RobotSource) -> ParameterTree:
    """Load the files of a configuration."""
    name, number = source.config, str(source.number)
    folder = Path(name).expanduser()
    if not folder.exists() and is_shipped(name):
        return load_files(files_of(config_folder(name), number), {"i": number})
    from quad_nav.config.sources import load_set, robot_set

    return load_set(robot_set(name, number))


def is_users(origin: str, number: int, override: Optional[Path]) -> bool:
    """Return whether a value is the user's for one robot or flight, not the configuration's.

    ``origin`` is one of ``ParameterTree.origins``, ``override`` the robot's file of overrides.
    """
    path = origin.rpartition(":")[0]
    own = [] if override is None else [str(override.expanduser())]
    return origin == COMMAND_LINE or Path(path).name == f"robot{number}.yaml" or path in own


def plain_tree(tree: Mapping[str, Any]) -> Dict[str, Any]:
    """Return a tree of plain dictionaries, which ``yaml.safe_dump`` accepts."""
    return {
        key: plain_tree(value) if isinstance(value, Mapping) else value
        for key, value in tree.items()
    }
