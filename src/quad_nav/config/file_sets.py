"""Find the sets of YAML files in a folder that belong to one robot each.

A folder with the four files of this package's launch files is one set, or one for each robot that
has files of its own. Other folders have other file names, a file for each of several robots or
maps, and folders of changes below a common one. Their files are classified by name and content.
Files of the same kind in one folder are alternatives: each set has one of them. A folder's files
are loaded after those of the folders above it.
"""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Dict, List, Mapping, Optional, Sequence, Set, Tuple

from quad_nav.config.files import (
    OPTIONAL,
    REQUIRED,
    PlacedFile,
    costmaps_named,
    files_of,
    top_level,
)
from quad_nav.config.planners import planner_keys
from quad_nav.config.tables.costmap import COSTMAP_TABLE
from quad_nav.config.tables.layers import INFLATION_LAYER_TABLE, OBSTACLE_LAYER_TABLE
from quad_nav.config.tables.move_base import MOVE_BASE_TABLE
from quad_nav.errors import InputError

_COSTMAPS = ("global_costmap", "local_costmap")
_OF_NODE = {parameter.name for parameter in MOVE_BASE_TABLE.parameters} | {
    "recovery_behaviors",
    *planner_keys({}),
    *_COSTMAPS,
}
_OF_COSTMAP = {
    parameter.name
    for table in (
        COSTMAP_TABLE,
        OBSTACLE_LAYER_TABLE,
        INFLATION_LAYER_TABLE,
    )
    for parameter in table.parameters
} | {"plugins", "map_type", "static_map"}
# Parameters that only costmaps have.
_OF_COSTMAP_ONLY = {
    "plugins",
    "observation_sources",
    "rolling_window",
    "inflation_radius",
    "obstacle_range",
}
_OF_ONE_COSTMAP = {"rolling_window", "static_map", "global_frame", "width"}
_NUMBERED = re.compile(f"(?:{'|'.join(REQUIRED + OPTIONAL)}|robot)([0-9]+)")

# A kind is (order of loading, more).
_COMMON, _ONE_COSTMAP, _NODE = 0, 1, 2
Kind = Tuple[int, Tuple[str, ...]]


@dataclass(frozen=True)
class FileSet:
    """Files of one robot, in the order of loading.

    Attributes:
        folder: Folder that was searched, None for files that were named.
        name: Name of the set in its folder, "" for the only one.
        files: The files.
        number: Number of the robot, for ``$(arg i)``.
    """

    folder: Optional[Path]
    name: str
    files: Tuple[PlacedFile, ...]
    number: str


@dataclass(frozen=True)
class _KnownFile:
    file: PlacedFile
    kind: Kind


def file_sets(top: Path, number: Optional[str] = None) -> Tuple[List[FileSet], List[Path]]:
    """Find the sets in a folder and in the folders below it.

    Args:
        top: The folder.
        number: Number of the robot; None for every robot that has files of its own.

    Returns:
        The sets, and the YAML files that are in none of them.
    """
    sets: List[FileSet] = []
    left: List[Path] = []
    above: Dict[Path, List[_KnownFile]] = {}  # with the files of the enclosing folders
    for folder, paths in _folders(top):
        standard = _standard_sets(folder, number)
        if standard:
            sets += standard
            used = {file.path for file_set in standard for file in file_set.files}
            left += [path for path in paths if path not in used]
            continue
        known = _known(paths, number or "0")
        left += [path for path in paths if path not in {one.file.path for one in known}]
        inherited = next((above[parent] for parent in folder.parents if parent in above), [])
        if known:
            above[folder] = inherited + known
    for folder, files in above.items():
        if not any(folder in other.parents for other in above):
            sets += _sets_of(folder, files, number)
    return sorted(sets, key=lambda one: (str(one.folder), one.name)), left


def _folders(top: Path) -> List[Tuple[Path, List[Path]]]:
    """List every folder that is not hidden, parents first, with its YAML files."""
    found = []
    for name, below, files in os.walk(top):
        below[:] = sorted(folder for folder in below if not folder.startswith("."))
        paths = [
            Path(name, file)
            for file in sorted(files)
            if file.endswith((".yaml", ".yml")) and not file.startswith(".")
        ]
        found.append((Path(name), paths))
    return found


def _standard_sets(folder: Path, number: Optional[str]) -> List[FileSet]:
    matches = [_NUMBERED.fullmatch(path.stem) for path in folder.glob("*.yaml")]
    numbers = sorted({match.group(1) for match in matches if match}, key=int)
    sets = []
    for one in [number] if number is not None else numbers or ["0"]:
        try:
            paths = files_of(folder, one)
        except InputError:
            continue
        files = tuple(
            PlacedFile(path, _COSTMAPS if path.name.startswith(REQUIRED[0]) else ("",))
            for path in paths
        )
        sets.append(FileSet(folder, f"robot {one}" if numbers else "", files, one))
    return sets


def _known(paths: Sequence[Path], number: str) -> List[_KnownFile]:
    known = []
    for path in paths:
        placed = _placed(path, number)
        if placed is not None:
            known.append(placed)
    return known


def _placed(path: Path, number: str) -> Optional[_KnownFile]:
    """Classify a file by name and content; None if it is not one of move_base."""
    named = costmaps_named(path)
    try:
        values = top_level(path, {"i": number})
    except InputError:  # check_set reports its faults
        by_name = named or "move_base" in path.stem or "planner" in path.stem
        return _known_file(path, named, {path.stem}) if by_name else None
    keys = set(values)
    costmaps = tuple(name for name in _COSTMAPS if name in keys)
    if costmaps:
        kind = _kind_of(costmaps if keys == set(costmaps) else (), keys)
        return _KnownFile(PlacedFile(path, ("",)), kind)
    if not named and not keys & _OF_NODE:
        if not keys & (_OF_COSTMAP if "costmap" in path.stem else _OF_COSTMAP_ONLY):
            return None
        named = _costmaps_meant(values)
    return _known_file(path, named, keys)


def _known_file(path: Path, costmaps: Tuple[str, ...], keys: Set[str]) -> _KnownFile:
    return _KnownFile(PlacedFile(path, costmaps or ("",)), _kind_of(costmaps, keys))


def _kind_of(costmaps: Tuple[str, ...], keys: Set[str]) -> Kind:
    if not costmaps:
        return (_NODE, tuple(sorted(keys)))
    return (_COMMON, ()) if len(costmaps) > 1 else (_ONE_COSTMAP, costmaps)


def _costmaps_meant(values: Mapping[str, Any]) -> Tuple[str, ...]:
    """Guess the costmaps of a file from its content: the rolling one is the local costmap."""
    if not _OF_ONE_COSTMAP.intersection(values):
        return _COSTMAPS
    return ("local_costmap",) if values.get("rolling_window") is True else ("global_costmap",)


def _sets_of(folder: Path, files: Sequence[_KnownFile], number: Optional[str]) -> List[FileSet]:
    """Make one set for each name of alternatives."""
    groups: Dict[Tuple[Kind, Path], List[PlacedFile]] = {}
    for one in files:
        groups.setdefault((one.kind, one.file.path.parent), []).append(one.file)
    ordered = sorted(groups, key=lambda group: (group[0], len(group[1].parts)))
    choices = [_alternatives(groups[group]) for group in ordered]
    names = list(dict.fromkeys(name for choice in choices if len(choice) > 1 for name in choice))
    if number in names:
        names = [number]
    return [
        FileSet(
            folder,
            name,
            tuple(choice.get(name, next(iter(choice.values()))) for choice in choices),
            number or "0",
        )
        for name in names or [""]
    ]


def _alternatives(files: Sequence[PlacedFile]) -> Dict[str, PlacedFile]:
    """Return name -> file; a name is the part of whole words or numbers that differs."""
    stems = [file.path.stem for file in files]
    cut = len(os.path.commonprefix(stems))
    if not all(stem[cut:].isdigit() for stem in stems):
        cut = stems[0].rfind("_", 0, cut) + 1
    return {stem[cut:]: file for stem, file in zip(stems, files)}
