"""Write tuned parameters as move_base's files, edited copies of the base's files."""

from __future__ import annotations

import os
import re
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple, Union

import yaml

from quad_nav import config
from quad_nav.config.file_sets import is_standard
from quad_nav.config.files import COMMON, OPTIONAL, REQUIRED, ParameterTree, set_value
from quad_nav.config.robot_tree import RobotSource, fitted, plain_tree, unfitted_tree
from quad_nav.config.sources import split_source
from quad_nav.errors import QuadError
from quad_nav.files.output import make_folder, write_text
from quad_tune.space import BOTH, COSTMAPS, costmap_paths
from quad_tune.yaml_edit import inserted, replaced

Source = Union[str, Path]
_FILE = re.compile(rf"({'|'.join((*REQUIRED, *OPTIONAL))}|robot)(\d*)\.yaml")
_PLANNERS = "base_local_planner_params"
_NODE = "move_base_params"
_OF_PLANNERS = re.compile(r"[A-Z]\w*")  # namespaces of planners are their classes' names


class FilesDiffer(QuadError):
    """The edited files do not load as intended; the base's YAML cannot be edited."""


@dataclass(frozen=True)
class Change:
    """New value of a parameter with its remark; ``path`` may name both costmaps."""

    path: str
    value: Any
    remark: str


def base_configuration(
    source: Source, fixed: Sequence[Tuple[str, Any]], robot: int = 0
) -> config.Configuration:
    """Load the configuration of the base.

    Raises:
        InputError: The configuration is invalid.
    """
    return config.load(fitted(_tree(source, fixed, robot), robot))


def base_value(tree: Mapping[str, Any], path: str) -> Any:
    """Return the effective value in a loaded tree, None if there is none.

    A costmap's own key may have moved into the layer that reads it.
    """
    single = costmap_paths(path)[0]
    value = _below(tree, single.split("/"))
    first, *rest = single.split("/")
    if value is None and first in COSTMAPS:
        layers = [layer for layer in tree.get(first, {}).values() if isinstance(layer, dict)]
        found = [value for value in (_below(layer, rest) for layer in layers) if value is not None]
        return found[0] if found else None
    return value


def write_parameters(base: Source, target: Path, changes: Sequence[Change]) -> None:
    """Write the base's files with ``changes`` into a folder.

    A base in another layout than that of the launch files is written in theirs.

    Raises:
        FilesDiffer: The files would not load as the base with these changes. Nothing is written.
        OSError: A file cannot be written. The folder keeps what it had.
    """
    files = _files_of(base)
    for change in changes:
        _change(files, change)
    partial = target.with_name(f"{target.name}.partial")
    make_folder(partial)
    try:
        for name, text in files.items():
            write_text(partial / name, text)
        _check(base, partial, changes)
        make_folder(target)
        for path in target.glob("*.yaml"):
            if path.name not in files:
                path.unlink()
        for name in files:
            os.replace(partial / name, target / name)
    finally:
        shutil.rmtree(partial)


def _files_of(base: Source) -> Dict[str, str]:
    """Return name -> text of the base's files."""
    folder, choice = split_source(str(base))
    if not choice and folder.is_dir() and is_standard(folder, "0"):
        return {
            path.name: path.read_text(encoding="utf-8")
            for path in sorted(folder.glob("*.yaml"))
            if _FILE.fullmatch(path.name)
        }
    tree = plain_tree(_tree(base, (), 0))
    contents: Dict[str, Dict[str, Any]] = {f"{stem}.yaml": {} for stem in REQUIRED}
    for key, value in tree.items():
        stem, _ = _home(f"{key}/x" if isinstance(value, dict) else key)
        contents.setdefault(f"{stem}.yaml", {})[key] = value
    return {
        name: yaml.safe_dump(content, sort_keys=False) if content else f"# Read from {base}.\n"
        for name, content in contents.items()
    }


def _change(files: Dict[str, str], change: Change) -> None:
    """Replace the value everywhere it is set, or insert it where it belongs."""
    home, home_path = _home(change.path)
    if not any(_stem(name) == home for name in files):
        files[f"{home}.yaml"] = ""
    for name, text in files.items():
        is_home = _stem(name) == home
        paths = [home_path] if is_home else []
        if _stem(name) != COMMON:
            paths += [single for single in costmap_paths(change.path) if single not in paths]
        found = False
        for path in paths:
            new = replaced(text, path.split("/"), change.value, change.remark)
            if new is not None:
                text, found = new, True
        if is_home and not found:
            text = inserted(text, home_path.split("/"), change.value, change.remark)
        files[name] = text


def _home(path: str) -> Tuple[str, str]:
    """Return the file that a parameter belongs to, and its path there."""
    first, _, rest = path.partition("/")
    if first == BOTH:
        return COMMON, rest
    if first in COSTMAPS:
        return f"{first}_params", path
    return (_PLANNERS if rest and _OF_PLANNERS.fullmatch(first) else _NODE), path


def _stem(name: str) -> str:
    match = _FILE.fullmatch(name)
    return match.group(1) if match else ""


def _check(base: Source, written: Path, changes: Sequence[Change]) -> None:
    """Load base and result, for every robot with files of its own and for one without."""
    numbers = {
        int(match.group(2))
        for match in map(_FILE.fullmatch, (path.name for path in written.glob("*.yaml")))
        if match and match.group(2)
    }
    assignments = [(change.path, change.value) for change in changes]
    for robot in sorted({0, 1, *numbers}):
        meant = config.load(fitted(_tree(base, assignments, robot), robot)).to_tree()
        found = config.load(fitted(_tree(written, (), robot), robot)).to_tree()
        if meant != found:
            raise FilesDiffer(
                f"{base}: cannot edit its files: robot {robot} would "
                f"get other parameters: {', '.join(_unlike(meant, found))}"
            )


def _tree(source: Source, assignments: Sequence[Tuple[str, Any]], robot: int) -> ParameterTree:
    tree = unfitted_tree(RobotSource(str(source), robot))
    for path, value in assignments:
        for single in costmap_paths(path):
            set_value(tree, single, value, "tuned")
    return tree


def _below(tree: Any, path: Sequence[str]) -> Optional[Any]:
    for key in path:
        tree = tree.get(key) if isinstance(tree, Mapping) else None
    return None if isinstance(tree, Mapping) else tree


def _unlike(meant: Mapping[str, Any], found: Mapping[str, Any], place: str = "") -> List[str]:
    lines: List[str] = []
    for key in sorted({*meant, *found}):
        expected, actual = meant.get(key), found.get(key)
        if isinstance(expected, dict) and isinstance(actual, dict):
            lines += _unlike(expected, actual, f"{place}{key}/")
        elif expected != actual:
            lines.append(f"{place}{key} {actual!r} instead of {expected!r}")
    return lines
