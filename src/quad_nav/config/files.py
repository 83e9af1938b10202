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
from typing import (
    Any,
    Dict,
    Iterable,
    Iterator,
    List,
    Mapping,
    Optional,
    Sequence,
    Tuple,
    Union,
    cast,
)

import yaml

from quad_nav.config.notes import CAUTION, Remark, join
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

    def at(self, path: str) -> ParameterTree:
        """Return the namespace at a path as a tree of its own."""
        tree = ParameterTree()
        tree.update(below(self, path))
        start = f"{path}/"
        tree.origins = {
            place[len(start) :]: origin
            for place, origin in self.origins.items()
            if place.startswith(start)
        }
        tree.remarks = self.remarks
        return tree


def below(tree: Mapping[str, Any], path: str) -> Dict[str, Any]:
    """Return the namespace at a path, {} if there is none."""
    namespace: Any = tree
    for name in filter(None, path.split("/")):
        found = namespace.get(name)
        namespace = found if isinstance(found, dict) else {}
    return cast(Dict[str, Any], namespace)


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
    if isinstance(source, (str, Path)):
        source = files_of(Path(source), arguments.get("i"))
    tree = ParameterTree()
    problems: List[str] = []
    for name in source:
        file = name if isinstance(name, PlacedFile) else PlacedFile(Path(name), ())
        try:
            content = read_file(file.path, arguments)
        except InputError as error:
            problems.extend(error.problems)
        else:
            merge_tree(tree, content, *(file.namespaces or _namespaces(file.path, content)))
    if problems:
        raise InputError(problems)
    return tree


def read_file(path: Path, arguments: Mapping[str, str]) -> ParameterTree:
    """Read a file, or the part of a dump of a parameter server that is this robot's.

    Raises:
        InputError: The file cannot be read, or is not YAML; with the line.
    """
    text = _substituted(read_text(path, MAX_BYTES), path, arguments)
    return _tree_of_node(parsed(text, path), f"move_base{arguments.get('i', '')}")


def merge_tree(tree: ParameterTree, other: ParameterTree, *namespaces: str) -> None:
    """Merge another tree key by key into the top of a tree, or into each of some namespaces."""
    for namespace in namespaces or ("",):
        if other:
            _merge(_namespace(tree, namespace.split("/")), other)
        for path, origin in other.origins.items():
            tree.origins[join(namespace, path)] = origin
    tree.remarks += other.remarks


def _merge(namespace: Dict[str, Any], other: Mapping[str, Any]) -> None:
    for key, value in other.items():
        if isinstance(value, dict):
            _merge(_namespace(namespace, [key]), value)
        else:
            namespace[key] = value


def set_value(tree: ParameterTree, path: str, value: Any, origin: str) -> None:
    """Set one parameter as a file loaded last does; ``path`` is like ``global_costmap/width``."""
    keys = [key for key in path.split("/") if key]
    _namespace(tree, keys[:-1])[keys[-1]] = value
    tree.origins["/".join(keys)] = origin


def is_overlay(path: Path) -> bool:
    """Tell if a file changes the configuration in the folder ``default`` beside it."""
    return path.is_file() and (path.parent / BASE / f"{COMMON}.yaml").is_file()


def files_of(folder: Path, number: Optional[str] = None) -> List[PlacedFile]:
    """List the files of a robot in a folder, in the order of loading.

    Args:
        folder: The folder, or an overlay on the one called ``default`` beside it.
        number: Number of the robot.

    Raises:
        InputError: The folder or one of the four files is missing.
    """
    if is_overlay(folder):
        return [*files_of(folder.parent / BASE, number), PlacedFile(folder, ("",))]
    if not folder.is_dir():
        raise InputError([f"{folder}: no such folder; expected a folder with {REQUIRED[0]}.yaml"])
    files: List[PlacedFile] = []
    problems: List[str] = []
    for stem in REQUIRED + OPTIONAL:
        plain = folder / f"{stem}.yaml"
        names = [plain] if number is None else [folder / f"{stem}{number}.yaml", plain]
        found = [path for path in names if path.is_file()]
        if found:
            files.append(PlacedFile(found[0], COSTMAPS if stem == COMMON else ("",)))
        elif stem in REQUIRED:
            expected = " or ".join(sorted(path.name for path in names))
            problems.append(f"{folder}: missing {expected}")
    if problems:
        raise InputError(problems)
    own = folder / f"robot{number}.yaml"
    return files + [PlacedFile(own, ("",))] if own.is_file() else files


def leaves(tree: Mapping[str, Any], above: str = "") -> Iterator[Tuple[str, Any]]:
    """Yield (path, value) of every parameter of a tree."""
    for key, value in tree.items():
        if isinstance(value, dict):
            yield from leaves(value, join(above, key))
        else:
            yield join(above, key), value


def costmaps_named(path: Path) -> Tuple[str, ...]:
    """Return the costmaps that a file without their namespaces is for, by its name."""
    stem = path.stem.lower()
    if "costmap" not in stem:
        return ()
    named = tuple(name for name in COSTMAPS if name.split("_")[0] in stem)
    return COSTMAPS if not named and "common" in stem else named


def _namespaces(path: Path, content: ParameterTree) -> Tuple[str, ...]:
    if set(COSTMAPS).intersection(content):
        return ("",)
    return costmaps_named(path) or ("",)


def parsed(text: str, path: Path) -> ParameterTree:
    """Parse YAML; ``path`` is the file that has it, for messages.

    Raises:
        InputError: The text is not YAML.
    """
    tree = ParameterTree()
    try:
        loader = PlainLoader(text)
    except yaml.YAMLError as error:  # characters that YAML does not allow
        raise InputError([_syntax_error(error, path)]) from error
    try:
        node = loader.get_single_node()
        if isinstance(node, yaml.MappingNode):
            _collect(node, (), tree, loader, path)
        elif node is not None:
            raise InputError([f"{path}:1: not a mapping; expected names of parameters with values"])
    except yaml.YAMLError as error:
        raise InputError([_syntax_error(error, path)]) from error
    finally:
        loader.dispose()
    return tree


def _tree_of_node(tree: ParameterTree, own: str) -> ParameterTree:
    """Return the namespace of the node ``own``, or of any move_base, perhaps in that of a robot."""
    inner = [join(above, name) for above in tree for name in below(tree, above)]
    for paths in (sorted(tree), sorted(inner)):
        found = {path.split("/")[-1]: path for path in paths if below(tree, path)}
        nodes = {name: path for name, path in found.items() if _NODE.fullmatch(name)}
        if nodes:
            return tree.at(nodes.get(own, next(iter(nodes.values()))))
    return tree


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
        if len(words) == 2 and words[0] == "arg":
            known += f", or a value: add :{words[1]}=VALUE after the name of the folder"
        problems.append(f"{path}:{line}: unknown {match.group(0)}; expected {known}")
        return match.group(0)

    substituted = SUBSTITUTION.sub(value, text)
    if problems:
        raise InputError(problems)
    return substituted


def _collect(
    node: yaml.MappingNode,
    above: Tuple[str, ...],
    tree: ParameterTree,
    loader: PlainLoader,
    file: Path,
) -> None:
    """Collect values with their lines from the nodes of a mapping; remark on duplicate keys."""
    seen = set()
    for key_node, _ in node.value:
        if not isinstance(key_node, yaml.ScalarNode):
            continue
        if key_node.value in seen:
            place = "/".join((*above, key_node.value))
            origin = f"{file}:{key_node.start_mark.line + 1}"
            text = "set twice; YAML uses the last value"
            tree.remarks.append(Remark(place, CAUTION, text, origin))
        seen.add(key_node.value)
    loader.flatten_mapping(node)  # merge keys, "<<": their values are not duplicates
    for key_node, value_node in node.value:
        key = str(loader.construct_object(key_node, deep=True))
        origin = f"{file}:{key_node.start_mark.line + 1}"
        path = above + tuple(filter(None, key.split("/")))
        # Each value's path is kept: a long name above many values takes all memory.
        if not above < path or len(path) > MAX_LEVELS or sum(map(len, path)) > MAX_TEXT_LENGTH:
            raise InputError(
                [
                    f"{origin}: {key[:40]!r} is not the name of a parameter; "
                    f"expected 1 to {MAX_LEVELS} names with / between them, of at most "
                    f"{MAX_TEXT_LENGTH} characters"
                ]
            )
        tree.origins["/".join(path)] = origin
        if isinstance(value_node, yaml.MappingNode):
            _namespace(tree, path)
            _collect(value_node, path, tree, loader, file)
        else:
            value = loader.construct_object(value_node, deep=True)
            _namespace(tree, path[:-1])[path[-1]] = value


def _namespace(tree: Dict[str, Any], path: Iterable[str]) -> Dict[str, Any]:
    """Return the namespace at a path; make it if it is missing, or is a value."""
    for name in filter(None, path):
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
