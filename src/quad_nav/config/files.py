"""Read a robot's YAML files as the launch files load them, without ROS.

``costmap_common_params`` goes into both costmaps. The other files name their namespaces, or are at
the node's level. Later files override earlier ones key by key. Files are numbered by hand
(``costmap_common_params0.yaml``), or they are one template in which roslaunch replaces ``$(arg i)``
by the robot's number.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Dict, Iterable, List, Mapping, Optional, Sequence, Tuple, Union

import yaml

from quad_nav.config.notes import CAUTION, Remark
from quad_nav.errors import MAX_PROBLEMS, InputError
from quad_nav.files.document import MAX_TEXT_LENGTH, yaml_fault
from quad_nav.files.plain_yaml import MAX_BYTES, MAX_LEVELS, PlainLoader
from quad_nav.files.user_files import read_text

COMMON = "costmap_common_params"
REQUIRED = (COMMON, "local_costmap_params", "global_costmap_params", "base_local_planner_params")
OPTIONAL = ("move_base_params",)
BASE = "default"
"""Folder of the configuration that a file beside it is an overlay on."""
COSTMAPS = ("global_costmap", "local_costmap")
_NODE = re.compile(r"/?move_base(_node)?\d*")
SUBSTITUTION = re.compile(r"\$\(([^()]*(?:\([^()]*\)[^()]*)*)\)")
"""``$(...)`` of roslaunch, with calls inside."""


@dataclass(frozen=True)
class PlacedFile:
    """File and the namespaces that it is loaded into; "" is the node's level.

    Without namespaces they follow from the file's name and keys: the file of a costmap may leave
    the namespace to roslaunch.
    """

    path: Path
    namespaces: Tuple[str, ...]


FileName = Union[str, Path, PlacedFile]


class ParameterTree(Dict[str, Any]):
    """Parameter tree with the origin of its values.

    Attributes:
        origins: Path -> "file:line".
        remarks: Remarks on the files.
    """

    def __init__(self) -> None:
        super().__init__()
        self.origins: Dict[str, str] = {}
        self.remarks: List[Remark] = []


def load_files(
    source: Union[str, Path, Sequence[FileName]], substitutions: Optional[Mapping[str, str]] = None
) -> ParameterTree:
    """Load the parameter tree of one robot.

    Args:
        source: A folder with the four files, and optionally ``move_base_params.yaml`` and
            ``robot{i}.yaml``; or a list of files in the order of loading. In a folder a file
            with the robot's number replaces the one without.
        substitutions: Values of ``$(arg name)``, such as ``{"i": "0"}``.

    Raises:
        InputError: One line for every file that is missing or cannot be read.
    """
    arguments = {} if substitutions is None else dict(substitutions)
    tree = ParameterTree()
    problems: List[str] = []
    for file in placed_files(source, arguments):
        try:
            document = _read(file.path, arguments)
        except InputError as error:
            problems.extend(error.problems)
            continue
        for namespace in file.namespaces or _namespaces(document):
            _merge(tree, document, namespace)
        for line, key in document.duplicates:
            tree.remarks.append(
                Remark(key, CAUTION, "set twice; YAML uses the last value", f"{file.path}:{line}")
            )
    if problems:
        raise InputError(problems)
    return tree


def merge_tree(tree: ParameterTree, other: ParameterTree) -> None:
    """Merge another tree key by key; ``tree`` is changed in place."""
    _merge_namespace(tree, other)
    tree.origins.update(other.origins)
    tree.remarks += other.remarks


def _merge_namespace(namespace: Dict[str, Any], other: Mapping[str, Any]) -> None:
    for key, value in other.items():
        if isinstance(value, dict) and isinstance(namespace.get(key), dict):
            _merge_namespace(namespace[key], value)
        elif isinstance(value, dict) and (value or key not in namespace):
            namespace[key] = {}
            _merge_namespace(namespace[key], value)
        elif not isinstance(value, dict):
            namespace[key] = value


def merge_text(tree: ParameterTree, text: str, path: Path, namespace: str) -> None:
    """Load YAML into a namespace; ``path`` is the file that has it, for messages.

    Raises:
        InputError: The text is not YAML.
    """
    document = _parsed(text, path)
    _merge(tree, document, namespace)
    for line, key in document.duplicates:
        tree.remarks.append(
            Remark(key, CAUTION, "set twice; YAML uses the last value", f"{path}:{line}")
        )


def placed_files(
    source: Union[str, Path, Sequence[FileName]], arguments: Mapping[str, str]
) -> List[PlacedFile]:
    """List the files of a robot with their namespaces, in the order of loading.

    Args:
        source: As for ``load_files``.
        arguments: As for ``load_files``.

    Raises:
        InputError: The folder or one of its four files is missing.
    """
    if isinstance(source, (str, Path)):
        return [
            PlacedFile(path, COSTMAPS if path.name.startswith(COMMON) else ("",))
            for path in files_of(Path(source), arguments.get("i"))
        ]
    return [file if isinstance(file, PlacedFile) else PlacedFile(Path(file), ()) for file in source]


def set_value(tree: ParameterTree, path: str, value: Any, origin: str) -> None:
    """Set one parameter as a file loaded last does; ``path`` is like ``global_costmap/width``."""
    keys = tuple(key for key in path.split("/") if key)
    _namespace(tree, keys[:-1])[keys[-1]] = value
    tree.origins["/".join(keys)] = origin


def is_overlay(path: Path) -> bool:
    """Tell if a file changes the configuration in the folder ``default`` beside it."""
    return path.is_file() and (path.parent / BASE / f"{COMMON}.yaml").is_file()


def files_of(folder: Path, number: Optional[str] = None) -> List[Path]:
    """List the files of a robot in a folder, in the order of loading.

    Args:
        folder: The folder, or an overlay on the one called ``default`` beside it.
        number: Number of the robot.

    Raises:
        InputError: The folder or one of the four files is missing.
    """
    if is_overlay(folder):
        return [*files_of(folder.parent / BASE, number), folder]
    if not folder.is_dir():
        raise InputError([f"{folder}: no such folder; expected a folder with {REQUIRED[0]}.yaml"])
    paths: List[Path] = []
    problems: List[str] = []
    for stem in REQUIRED + OPTIONAL:
        plain = folder / f"{stem}.yaml"
        names = [plain] if number is None else [folder / f"{stem}{number}.yaml", plain]
        found = [path for path in names if path.is_file()]
        if found:
            paths.append(found[0])
        elif stem in REQUIRED:
            expected = " or ".join(sorted(path.name for path in names))
            problems.append(f"{folder}: missing {expected}")
    if problems:
        raise InputError(problems)
    own = folder / f"robot{number}.yaml"
    return paths + [own] if own.is_file() else paths


def top_level(path: Path, substitutions: Mapping[str, str]) -> Dict[str, Any]:
    """Return the names and values at a file's top level; a namespace is ``{}``.

    Raises:
        InputError: The file cannot be read.
    """
    document = _read(path, substitutions)
    values = {path[0]: value for path, value in document.values if len(path) == 1}
    return {key: values.get(key, {}) for key in document.keys}


def leaves(path: Path, substitutions: Mapping[str, str]) -> Dict[str, Any]:
    """Return path -> value of every parameter in a file.

    Raises:
        InputError: The file cannot be read.
    """
    document = _read(path, substitutions)
    return {
        "/".join(names): value
        for names, value in document.values
        if not isinstance(value, dict) or value
    }


def costmaps_named(path: Path) -> Tuple[str, ...]:
    """Return the costmaps that a file without their namespaces is for, by its name."""
    stem = path.stem.lower()
    if "costmap" not in stem:
        return ()
    named = tuple(name for name in COSTMAPS if name.split("_")[0] in stem)
    return COSTMAPS if not named and "common" in stem else named


def _namespaces(document: _Document) -> Tuple[str, ...]:
    if set(COSTMAPS).intersection(document.keys):
        return ("",)
    return costmaps_named(document.path) or ("",)


class _Document:
    """Contents of a file: values, the line of each path, and keys that are set twice."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.values: List[Tuple[Tuple[str, ...], Any]] = []  # leaves, in order
        self.lines: Dict[Tuple[str, ...], int] = {}
        self.duplicates: List[Tuple[int, str]] = []

    @property
    def keys(self) -> List[str]:
        """The names at the top level."""
        return list(dict.fromkeys(path[0] for path, _ in self.values))

    def enter(self, node: str) -> None:
        """Keep the namespace of a node, as in a dump of a parameter server."""
        self.values = [
            (path[1:], value) for path, value in self.values if path[0] == node and len(path) > 1
        ]
        self.lines = {
            path[1:]: line for path, line in self.lines.items() if path[0] == node and len(path) > 1
        }


def _read(path: Path, arguments: Mapping[str, str]) -> _Document:
    text = _substituted(read_text(path, MAX_BYTES), path, arguments)
    document = _parsed(text, path)
    _enter_node(document, f"move_base{arguments.get('i', '')}")
    return document


def _parsed(text: str, path: Path) -> _Document:
    document = _Document(path)
    try:
        loader = PlainLoader(text)
    except yaml.YAMLError as error:  # characters that YAML does not allow
        raise InputError([_syntax_error(error, path)]) from error
    try:
        node = loader.get_single_node()
        if node is None:
            return document
        if not isinstance(node, yaml.MappingNode):
            raise InputError([f"{path}:1: not a mapping; expected names of parameters with values"])
        _collect(node, (), document, loader)
    except yaml.YAMLError as error:
        raise InputError([_syntax_error(error, path)]) from error
    finally:
        loader.dispose()
    return document


def _enter_node(document: _Document, own: str) -> None:
    """Enter the namespace of a move_base node, which may be in that of a robot.

    Args:
        document: A file, or a dump of a parameter server.
        own: Name of the node, if there are several.
    """
    for depth in (1, 2):
        paths = {path[:depth] for path, _ in document.values if len(path) > depth}
        nodes = {path[-1]: path for path in sorted(paths) if _NODE.fullmatch(path[-1])}
        if nodes:
            for name in nodes.get(own, next(iter(nodes.values()))):
                document.enter(name)
            return


def _substituted(text: str, path: Path, arguments: Mapping[str, str]) -> str:
    """Replace every ``$(arg name)`` in a text, comments included, as roslaunch does."""
    problems: List[str] = []

    def value(match: re.Match[str]) -> str:
        words = match.group(1).split()
        if len(words) == 2 and words[0] == "arg" and words[1] in arguments:
            return str(arguments[words[1]])
        if len(problems) > MAX_PROBLEMS:
            return match.group(0)
        line = text.count("\n", 0, match.start()) + 1
        known = ", ".join(f"$(arg {name})" for name in arguments) or "no $( )"
        problems.append(f"{path}:{line}: unknown {match.group(0)}; expected {known}")
        return match.group(0)

    substituted = SUBSTITUTION.sub(value, text)
    if problems:
        raise InputError(problems)
    return substituted


def _collect(
    node: yaml.MappingNode, above: Tuple[str, ...], document: _Document, loader: PlainLoader
) -> None:
    """Collect values with their lines, and duplicate keys, from the nodes of a mapping."""
    seen = set()
    for key_node, _ in node.value:
        if not isinstance(key_node, yaml.ScalarNode):
            continue
        if key_node.value in seen:
            document.duplicates.append(
                (key_node.start_mark.line + 1, "/".join((*above, key_node.value)))
            )
        seen.add(key_node.value)
    loader.flatten_mapping(node)  # merge keys, "<<": their values are not duplicates
    for key_node, value_node in node.value:
        key = str(loader.construct_object(key_node, deep=True))
        line = key_node.start_mark.line + 1
        path = above + tuple(filter(None, key.split("/")))
        # Each value's path is kept: a long name above many values takes all memory.
        if not above < path or len(path) > MAX_LEVELS or sum(map(len, path)) > MAX_TEXT_LENGTH:
            raise InputError(
                [
                    f"{document.path}:{line}: {key[:40]!r} is not the name of a parameter; "
                    f"expected 1 to {MAX_LEVELS} names with / between them, of at most "
                    f"{MAX_TEXT_LENGTH} characters"
                ]
            )
        document.lines[path] = line
        if isinstance(value_node, yaml.MappingNode):
            document.values.append((path, {}))
            _collect(value_node, path, document, loader)
        else:
            document.values.append((path, loader.construct_object(value_node, deep=True)))


def _merge(tree: ParameterTree, document: _Document, prefix: str) -> None:
    """Merge a file into the tree key by key."""
    above = tuple(filter(None, prefix.split("/")))
    for below, value in document.values:
        path = above + below
        namespace = _namespace(tree, path[:-1])
        if value == {} and isinstance(value, dict):
            if not isinstance(namespace.get(path[-1]), dict):
                namespace[path[-1]] = {}
        else:
            namespace[path[-1]] = value
        tree.origins["/".join(path)] = f"{document.path}:{document.lines[below]}"


def _namespace(tree: Dict[str, Any], path: Iterable[str]) -> Dict[str, Any]:
    for name in path:
        if not isinstance(tree.get(name), dict):
            tree[name] = {}
        tree = tree[name]
    return tree


def _syntax_error(error: yaml.YAMLError, path: Path) -> str:
    mark = getattr(error, "problem_mark", None)
    if mark is None:
        return f"{path}: {yaml_fault(error)}"
    what = ", ".join(filter(None, (getattr(error, "context", None), error.problem)))  # type: ignore[attr-defined]
    return f"{path}:{mark.line + 1}:{mark.column + 1}: not YAML: {what}"
