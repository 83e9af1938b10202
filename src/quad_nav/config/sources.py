"""Read a robot's configuration from whatever a person names, for both shells.

default                        a shipped configuration
my_robot/moving.yaml           an overlay on the folder my_robot/default beside it
my_robot/config                a folder, see ``file_sets``
my_robot/config:burger         one of the alternatives in a folder, or of its subfolders
my_robot/config:prefix=a_      with values of $(arg prefix) in its files
my_robot.yaml                  one file, or a dump of a parameter server
common.yaml,local_costmap=house.yaml    files in the order of loading
my_robot.launch:model=burger   a launch file, with values of its arguments
fleet.launch:robot1            one of its move_base nodes; otherwise that of robot i is the i-th
"""

from __future__ import annotations

import contextlib
import re
from dataclasses import replace
from pathlib import Path
from typing import List, Optional, Sequence, Tuple

from quad_nav.config.file_sets import FileSet, file_sets, is_standard, standard_set
from quad_nav.config.files import (
    COSTMAPS,
    ParameterTree,
    PlacedFile,
    is_overlay,
    load_files,
)
from quad_nav.config.launch_file import in_order, is_launch_file, load_launch_file, navigators
from quad_nav.errors import InputError
from quad_nav.files.shipped import config_folder

_MOST_LISTED = 12


def load_set(files: FileSet) -> ParameterTree:
    """Load the parameter tree of a set.

    Raises:
        InputError: One line for every file that cannot be read.
    """
    first = files.files[0].path
    if is_launch_file(first):
        return load_launch_file(first, files.number, files.arguments, files.name)
    return load_files(files.files, {**dict(files.arguments), "i": files.number})


def robot_set(name: str, number: str) -> FileSet:
    """Find the one set that a robot flies with.

    Raises:
        InputError: There is none, or the user has to choose one of several.
    """
    path, choice = split_source(name)
    if not choice and _is_standard(path, number):
        return standard_set(path, number)
    sets, _ = sets_of(name, number)
    if len(sets) == 1:
        return sets[0]
    numbered = _of_numbered_folders(sets)
    if int(number) < len(numbered):
        return numbered[int(number)]
    lines = [f"--config {path}:{label(one, path)}" for one in sets[:_MOST_LISTED]]
    more = f" and {len(sets) - _MOST_LISTED} more" if len(sets) > _MOST_LISTED else ""
    raise InputError(
        [f"config: {name}: {len(sets)} configurations; expected one: {' or '.join(lines)}{more}"]
    )


def _is_standard(path: Path, number: str) -> bool:
    return is_overlay(path) or (path.is_dir() and is_standard(path, number))


def sets_of(name: str, number: Optional[str] = None) -> Tuple[List[FileSet], List[Path]]:
    """Find the sets that a name stands for.

    Args:
        name: What a person names, see the module's docstring.
        number: Number of the robot; None for every robot that has files of its own.

    Returns:
        The sets, at least one, and the YAML files of a folder that are in none of them.

    Raises:
        InputError: There is no such file or folder, or no set in it.
    """
    path, choice = split_source(name)
    if not choice and is_overlay(path):
        return [standard_set(path, number or "0")], []
    if is_launch_file(path):
        return _sets_of_launch_file(path, choice, number), []
    if not path.is_dir():
        return [_set_of_files(path, number or "0")], []
    sets, left = file_sets(path, number)
    if not sets:
        expected = "expected files such as costmap_common_params.yaml"
        raise InputError([f"{path}: no move_base parameters found; {expected}"])
    if not is_standard(path, number or "0"):
        sets = _with_folder_above(path, number) or sets
    words = choice.split(",") if choice else []
    given = _arguments(path, ",".join(word for word in words if "=" in word))
    sets = [replace(one, arguments=given) for one in sets]
    choice = ",".join(word for word in words if "=" not in word)
    if choice:
        chosen = [one for one in sets if _is_chosen(one, path, choice)]
        if not chosen:
            known = ", ".join(label(one, path) for one in sets) or "no alternatives"
            raise InputError([f"config: {name}: no configuration {choice!r}; there are {known}"])
        sets = chosen
    return sets, left


def split_source(name: str) -> Tuple[Path, str]:
    """Split a name into a path and what is chosen there.

    Several files with commas between them are returned as they are.

    Raises:
        InputError: There is neither such a file or folder nor a shipped configuration.
    """
    path = Path(name).expanduser()
    if path.exists() or "," in name and all(one.is_file() for one in _paths(name)):
        return path, ""
    for end, letter in enumerate(name):
        head = Path(name[:end]).expanduser()
        if letter == ":" and name[:end] and head.exists():
            # FOLDER:NAME:arg=VALUE is FOLDER:NAME,arg=VALUE
            return head, re.sub(r":(?=\w+=)", ",", name[end + 1 :].lstrip(":"))
    return config_folder(name), ""


def source_paths(name: str) -> List[Path]:
    """Return what a study's flights depend on: the folder of a configuration, or its files.

    Raises:
        InputError: There is no such configuration.
    """
    path, choice = split_source(name)
    if not choice and path.is_dir() and is_standard(path, "0"):
        return [path]
    return [file.path for file in robot_set(name, "0").files]


def config_label(name: str) -> str:
    """Return the name without the folders above it, which recordings do not disclose."""
    try:
        path, choice = split_source(name)
    except InputError:  # a name that a caller of the Python interface gives
        return Path(name).name
    return f"{path.name}:{choice}" if choice else path.name


def label(files: FileSet, top: Path) -> str:
    """Return the words after ``FOLDER:`` that choose a set."""
    folder = files.folder or top
    inner = folder.relative_to(top).as_posix() if top in folder.parents else ""
    return ",".join(part for part in (inner, files.name) if part)


def _is_chosen(files: FileSet, top: Path, choice: str) -> bool:
    """True if each word names the set's folder, an alternative, or one of its files."""
    folder = files.folder or top
    inner = folder.relative_to(top).as_posix() if top in folder.parents else "."
    known = {inner, folder.name if inner != "." else ".", *files.name.split(",")}
    for file in files.files:
        known |= {file.path.name, file.path.stem}
    return all(word.strip() in known for word in choice.split(","))


def _with_folder_above(folder: Path, number: Optional[str]) -> List[FileSet]:
    """Return the sets of a folder whose files change those of the same names in the one above."""
    above = folder.resolve().parent
    names = {path.name for pattern in ("*.yaml", "*.yml") for path in folder.glob(pattern)}
    if not any((above / name).is_file() for name in names) or is_standard(above, number or "0"):
        return []
    return [
        one
        for one in file_sets(above, number, only=folder.resolve())[0]
        if one.folder == folder.resolve()
    ]


def _of_numbered_folders(sets: Sequence[FileSet]) -> List[FileSet]:
    """Return sets in the order of their folders' numbers, [] if nothing but those tells them."""
    folders = {str(one.folder): one for one in sets}
    kinds = {(re.sub("[0-9]+$", "", folder), one.name) for folder, one in folders.items()}
    if len(folders) < len(sets) or len(kinds) > 1 or not all(one[-1:].isdigit() for one in folders):
        return []
    return [folders[folder] for folder in in_order(folders)]


def _sets_of_launch_file(path: Path, choice: str, number: Optional[str]) -> List[FileSet]:
    """Return the set of a robot, or that of each move_base node if no robot is named."""
    words = choice.split(",")
    arguments = _arguments(path, ",".join(word for word in words if "=" in word))
    one = ",".join(word for word in words if "=" not in word)
    nodes: List[str] = []
    if number is None and not one:
        with contextlib.suppress(InputError):  # load_set reports it
            nodes = navigators(path, arguments)
    file = PlacedFile(path, ())
    if len(nodes) < 2:
        return [FileSet(None, one, (file,), number or "0", arguments)]
    return [FileSet(None, node, (file,), str(k), arguments) for k, node in enumerate(nodes)]


def _set_of_files(path: Path, number: str) -> FileSet:
    """Return the set of one file, or of files with commas between them."""
    words = [str(path)] if path.is_file() else str(path).split(",")
    return FileSet(None, "", tuple(placed_file(word.strip()) for word in words), number)


def placed_file(word: str) -> PlacedFile:
    """Return a file, or a costmap's name, "=" and a file."""
    namespace, equals, name = word.partition("=")
    if equals and namespace in COSTMAPS:
        return PlacedFile(Path(name).expanduser(), (namespace,))
    return PlacedFile(Path(word).expanduser(), ())


def _paths(name: str) -> List[Path]:
    return [placed_file(word.strip()).path for word in name.split(",")]


def _arguments(path: Path, words: str) -> Tuple[Tuple[str, str], ...]:
    """Parse ``model=burger,slam=true``.

    Raises:
        InputError: A word has another form.
    """
    found = []
    for word in filter(None, words.split(",")):
        name, equals, value = word.replace(":=", "=").partition("=")
        if not equals or not name:
            raise InputError([f"config: {path}:{word}: expected NAME=VALUE of an argument"])
        found.append((name.strip(), value.strip()))
    return tuple(found)
