"""Read the parameters of one robot from whatever the user names as its configuration.

Both shells read configurations here: ``quad fly`` and the nodes of a fleet call ``robot_tree``,
and ``launch/quad.launch`` runs ``quad_nav.scenario.robot_parameters``, which prints its result.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple

from quad_nav.config.files import (
    FileName,
    ParameterTree,
    PlacedFile,
    load_files,
    placed_files,
    set_value,
)
from quad_nav.errors import InputError
from quad_nav.files.shipped import config_folder

COMMAND_LINE = "the command line"
"""Origin of a parameter that the user gives with ``--set``."""


@dataclass(frozen=True)
class RobotSource:
    """Sources of one robot's parameters; a later one overrides an earlier one.

    Attributes:
        config: A folder's path, or the name of a shipped configuration.
        number: Number of the robot.
        robots: Number of robots that fly together; None if they are not to be told.
        numbered: Read only files with the robot's number in their names.
        override: File that is loaded last, with paths relative to the node.
        parameters: (path, value) on top of the files.
    """

    config: str
    number: int
    robots: Optional[int] = None
    numbered: bool = False
    override: Optional[Path] = None
    parameters: Sequence[Tuple[str, Any]] = ()


def robot_tree(source: RobotSource) -> ParameterTree:
    """Read the parameter tree of one robot.

    ``$(arg i)`` in a file is the robot's number.

    Raises:
        InputError: One line for every file that is missing or cannot be read.
    """
    substitutions = {"i": str(source.number)}
    files: List[FileName] = []
    problems: List[str] = []
    try:
        files += placed_files(config_folder(source.config), substitutions, source.numbered)
    except InputError as error:
        problems += error.problems
    if source.override is not None:
        files.append(PlacedFile(source.override.expanduser(), ("",)))
    try:
        tree = load_files(files, substitutions)
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


def is_users(origin: str, number: int, override: Optional[Path]) -> bool:
    """Return whether a value is the user's for one robot or flight, not the configuration's.

    Args:
        origin: Origin of the value, as in ``ParameterTree.origins``.
        number: Number of the robot.
        override: The robot's file of overrides.
    """
    path = origin.rpartition(":")[0]
    return origin == COMMAND_LINE or (
        path != "" and (Path(path).name == f"robot{number}.yaml" or path == str(override))
    )


def plain_tree(tree: Mapping[str, Any]) -> Dict[str, Any]:
    """Return a tree of plain dictionaries, which ``yaml.safe_dump`` accepts."""
    return {
        key: plain_tree(value) if isinstance(value, Mapping) else value
        for key, value in tree.items()
    }
