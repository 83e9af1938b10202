"""Find the sets of YAML files in a folder that belong to one robot each.

A folder with the four files of this package's launch files is one set, or one for each robot that
has files of its own. Other folders have other file names, a file for each of several robots or
maps, and folders of changes below a common one. Their files are classified by name and content.
Files of the same kind in one folder that set the same parameters are alternatives: each set has one
of them. ``planner_slow.yaml`` beside ``planner.yaml`` changes it and is loaded after it. A folder's
files are loaded after those of the folders above it. Folders without costmaps, such as
``planners`` beside ``costmaps``, are parts of one set.
"""

from __future__ import annotations

import itertools
import os
import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Dict, Iterator, List, Mapping, Optional, Sequence, Set, Tuple

from quad_nav.config.configuration import MOVE_BASE_TABLE
from quad_nav.config.costmaps import COSTMAP_TABLE
from quad_nav.config.files import (
    COSTMAPS,
    OPTIONAL,
    REQUIRED,
    PlacedFile,
    costmaps_named,
    files_of,
    leaves,
    read_file,
)
from quad_nav.config.layers import LAYERS
from quad_nav.config.planners import SLOTS, planner_keys
from quad_nav.errors import InputError

_OF_NODE = {parameter.name for parameter in MOVE_BASE_TABLE.parameters} | {
    "recovery_behaviors",
    *planner_keys({}),
    *COSTMAPS,
}
_OF_COSTMAP = {
    parameter.name
    for table in (
        COSTMAP_TABLE,
        LAYERS["costmap_2d::ObstacleLayer"],
        LAYERS["costmap_2d::InflationLayer"],
    )
    for parameter in table.parameters
} | {"plugins", "map_type", "static_map"}
# Names of our parameters that files of other nodes have, too: robot_localization's for instance.
_OF_OTHERS = {"sensor_timeout", "robot", "robots"}
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
_OF_LAUNCH_FILES = re.compile(rf"(?:{'|'.join(REQUIRED + OPTIONAL)})[0-9]*\.yaml|robot[0-9]+\.yaml")

# A kind is (order of loading, its costmaps, the keys of a file of the node).
_COMMON, _ONE_COSTMAP, _NODE = 0, 1, 2
Kind = Tuple[int, Tuple[str, ...], Tuple[str, ...]]
_MOST_SETS = 50


@dataclass(frozen=True)
class FileSet:
    """Files of one robot, in the order of loading.

    Attributes:
        folder: Folder that was searched, None for files that were named.
        name: Name of the set in its folder, "" for the only one.
        files: The files.
        number: Number of the robot, for ``$(arg i)``.
        arguments: (name, value) of a launch file's arguments.
    """

    folder: Optional[Path]
    name: str
    files: Tuple[PlacedFile, ...]
    number: str
    arguments: Tuple[Tuple[str, str], ...] = ()


@dataclass(frozen=True)
class _KnownFile:
    file: PlacedFile
    kind: Kind
    leaves: Mapping[str, Any]

    @property
    def stem(self) -> str:
        return self.file.path.stem

    def changes(self, other: _KnownFile) -> bool:
        """True if this file changes a few parameters of another: ``planner_slow``, ``planner``."""
        return self.stem.startswith(f"{other.stem}_") and not set(other.leaves) <= set(self.leaves)

    def is_alternative_to(self, other: _KnownFile) -> bool:
        """True if both set the same parameters, or choose different planners."""
        if (self.kind[:2], self.file.path.parent) != (other.kind[:2], other.file.path.parent):
            return False
        mine, others = self.leaves, other.leaves
        if any(key in mine and key in others and mine[key] != others[key] for key in SLOTS):
            return True
        shared = len(set(mine) & set(others))
        return shared > 0 and 2 * shared >= min(len(mine), len(others))


def file_sets(
    top: Path, number: Optional[str] = None, only: Optional[Path] = None
) -> Tuple[List[FileSet], List[Path]]:
    """Find the sets in a folder and in the folders below it.

    Args:
        top: The folder.
        number: Number of the robot; None for every robot that has files of its own.
        only: The only folder below it to search; None for all.

    Returns:
        The sets, and the YAML files that are in none of them.
    """
    sets: List[FileSet] = []
    left: List[Path] = []
    above: Dict[Path, List[_KnownFile]] = {}  # with the files of the enclosing folders
    for folder, paths in _folders(top, only):
        standard = _standard_sets(folder, number)
        if standard:
            sets += standard
            used = {file.path for file_set in standard for file in file_set.files}
            left += [path for path in paths if path not in used]
            continue
        placed = [_placed(path, number or "0") for path in paths]
        known = [one for one in placed if one is not None]
        left += [path for path, one in zip(paths, placed) if one is None]
        inherited = next((above[parent] for parent in folder.parents if parent in above), [])
        if known:
            above[folder] = inherited + known
    for folder, files in _joined(above).items():
        sets += _sets_of(folder, files, number)
    return sorted(sets, key=lambda one: (str(one.folder), one.name)), left


def _joined(above: Mapping[Path, List[_KnownFile]]) -> Dict[Path, List[_KnownFile]]:
    """Return the files of each set's folder; those without costmaps join the nearest with them."""
    found = {
        folder: files
        for folder, files in above.items()
        if not any(folder in other.parents for other in above)
    }
    for folder in list(found):
        if folder not in found or _has_costmap(found[folder]):
            continue
        for parent in folder.parents:
            beside = [one for one in found if parent in one.parents]
            if any(_has_costmap(found[one]) for one in beside):
                files = [file for one in beside for file in found.pop(one)]
                found[parent] = list({file.file.path: file for file in files}.values())
                break
    return found


def _has_costmap(files: Sequence[_KnownFile]) -> bool:
    paths = (path for one in files for path in one.leaves)
    return any(one.kind[1] for one in files) or any(path.startswith(COSTMAPS) for path in paths)


def _folders(top: Path, only: Optional[Path]) -> List[Tuple[Path, List[Path]]]:
    """List every folder that is not hidden, parents first, with its YAML files."""
    found = []
    for name, below, files in os.walk(top):
        below[:] = sorted(folder for folder in below if not folder.startswith("."))
        if only is not None:
            below[:] = [one for one in below if Path(name, one) in (only, *only.parents)]
        paths = [
            Path(name, file)
            for file in sorted(files)
            if file.endswith((".yaml", ".yml")) and not file.startswith(".")
        ]
        found.append((Path(name), paths))
    return found


def is_standard(folder: Path, number: str) -> bool:
    """True for a folder with the four files of the launch files, or with a robot's own of them.

    One that has parameters of move_base in files of other names, too, is none: launch files load
    those beside the four.
    """
    if _has_others(folder, number):
        return False
    if _numbers(folder):
        return True
    try:
        return bool(files_of(folder, number))
    except InputError:
        return False


def _has_others(folder: Path, number: str) -> bool:
    """Tell whether a file that is not one of the launch files has parameters of move_base."""
    return any(
        _placed(path, number) is not None
        for pattern in ("*.yaml", "*.yml")
        for path in folder.glob(pattern)
        if not _OF_LAUNCH_FILES.fullmatch(path.name) and not path.name.startswith(".")
    )


def standard_set(folder: Path, number: str, name: str = "") -> FileSet:
    """Return the set of a folder with the four files of the launch files.

    Raises:
        InputError: One of them is missing.
    """
    return FileSet(folder, name, tuple(files_of(folder, number)), number)


def _numbers(folder: Path) -> List[str]:
    """List the robots with files of their own beside or instead of the four files."""
    matches = [_NUMBERED.fullmatch(path.stem) for path in folder.glob("*.yaml")]
    return sorted({match.group(1) for match in matches if match}, key=int)


def _standard_sets(folder: Path, number: Optional[str]) -> List[FileSet]:
    if _has_others(folder, number or "0"):
        return []
    numbers = _numbers(folder)
    sets = []
    for one in [number] if number is not None else numbers or ["0"]:
        try:
            sets.append(standard_set(folder, one, f"robot {one}" if numbers else ""))
        except InputError:
            continue
    return sets


def _placed(path: Path, number: str) -> Optional[_KnownFile]:
    """Classify a file by name and content; None if it is not one of move_base."""
    named = costmaps_named(path)
    try:
        tree = read_file(path, {"i": number})
    except InputError:  # check_set reports its faults
        by_name = named or "move_base" in path.stem or "planner" in path.stem
        return _known_file(path, named, {path.stem}) if by_name else None
    keys, found = set(tree), dict(leaves(tree))
    costmaps = tuple(name for name in COSTMAPS if name in keys)
    if costmaps:
        meant = costmaps if keys == set(costmaps) else ()
        return replace(_known_file(path, meant, keys, found), file=PlacedFile(path, ("",)))
    if not named and not (keys & _OF_NODE - _OF_OTHERS or keys <= _OF_NODE):
        if not keys & (_OF_COSTMAP if "costmap" in path.stem else _OF_COSTMAP_ONLY):
            return None
        named = _costmaps_meant(tree)
    return _known_file(path, named, keys, found)


def _known_file(
    path: Path, costmaps: Tuple[str, ...], keys: Set[str], found: Mapping[str, Any] = {}
) -> _KnownFile:
    order = _NODE if not costmaps else _COMMON if len(costmaps) > 1 else _ONE_COSTMAP
    kind = (order, costmaps, () if costmaps else tuple(sorted(keys)))
    return _KnownFile(PlacedFile(path, costmaps or ("",)), kind, found)


def _costmaps_meant(values: Mapping[str, Any]) -> Tuple[str, ...]:
    """Guess the costmaps of a file from its content: the rolling one is the local costmap."""
    if not _OF_ONE_COSTMAP.intersection(values):
        return COSTMAPS
    return ("local_costmap",) if values.get("rolling_window") is True else ("global_costmap",)


Choice = Dict[str, Tuple[PlacedFile, ...]]
"""Alternatives: name -> files; one without a choice has one name."""


def _sets_of(folder: Path, files: Sequence[_KnownFile], number: Optional[str]) -> List[FileSet]:
    """Make one set for each combination of alternatives; those of one name belong together."""
    choices = [_alternatives(group) for group in _groups(files)]
    classes: List[List[str]] = []  # names that belong together
    for choice in choices:
        if len(choice) == 1:
            continue
        linked = [one for one in classes if set(one) & set(choice)]
        place = classes.index(linked[0]) if linked else len(classes)
        classes = [one for one in classes if one not in linked]
        merged = dict.fromkeys(name for names in (*linked, choice) for name in names)
        classes.insert(place, list(merged))
    classes = [[number] if number in names else names for names in classes]
    combinations = itertools.islice(itertools.product(*classes), _MOST_SETS)
    return [
        FileSet(
            folder,
            ",".join(names),
            tuple(file for choice in choices for file in _chosen(choice, names)),
            number or "0",
        )
        for names in combinations
    ]


def _chosen(choice: Choice, names: Sequence[str]) -> Tuple[PlacedFile, ...]:
    """Return the files of the name that fits best: ``waffle`` fits ``waffle_pi``."""
    for name in names:
        if name in choice:
            return choice[name]
    near = [one for one in choice for name in names if name.startswith(one)]
    return choice[max(near, key=len)] if near else next(iter(choice.values()))


def _groups(files: Sequence[_KnownFile]) -> Iterator[List[_KnownFile]]:
    """Yield files that are alternatives to each other, in the order of loading."""
    left = sorted(files, key=lambda one: (one.kind, len(one.file.path.parts), str(one.file.path)))
    while left:
        group = [left.pop(0)]
        for one in group:
            more = [other for other in left if one.is_alternative_to(other)]
            group += more
            left = [other for other in left if other not in more]
        yield group


def _alternatives(group: Sequence[_KnownFile]) -> Choice:
    """Return name -> files; a name is the part of whole words or numbers that differs."""
    stems = [one.stem for one in group]
    cut = len(os.path.commonprefix(stems))
    if not all(stem[cut:].isdigit() for stem in stems):
        cut = stems[0].rfind("_", 0, cut) + 1
    return {
        one.stem[cut:]: (*(other.file for other in group if one.changes(other)), one.file)
        for one in group
    }
