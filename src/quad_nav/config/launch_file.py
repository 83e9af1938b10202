"""Read the parameters of a move_base node from a launch file, without ROS.

``<arg>``, ``<include>``, ``<group>``, ``<param>``, ``<rosparam>`` and ``<node>`` are read as
roslaunch reads them, in their order. ``$(find package)`` is looked for around the launch file.
What cannot be resolved is a remark if the parameters can be complete without it.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Dict, Iterable, List, Mapping, Sequence, Tuple

import yaml

from quad_nav.config.files import ParameterTree, merge_tree, parsed, set_value
from quad_nav.config.notes import CAUTION, MAPPED, Remark
from quad_nav.config.substitution import Shared, Substitution, TooLarge, Unresolved, is_package
from quad_nav.errors import InputError, excerpt
from quad_nav.files import plain_yaml
from quad_nav.files.document import MAX_TEXT_LENGTH
from quad_nav.files.user_files import read_text, referenced_file
from quad_nav.files.xml_tree import MAX_DEPTH, Element

_TRUE, _FALSE = ("true", "1"), ("false", "0")
_TYPES = ("move_base", "fleet")
_TAGS = ("arg", "include", "group", "param", "rosparam", "node")


def is_launch_file(path: Path) -> bool:
    """Tell by the name if a file is one of roslaunch."""
    return path.suffix in (".launch", ".xml")


def load_launch_file(
    path: Path, number: str = "0", arguments: Sequence[Tuple[str, str]] = (), choice: str = ""
) -> ParameterTree:
    """Load the parameter tree of a launch file's move_base node.

    Args:
        path: The launch file.
        number: Number of the robot, if there is a node for each.
        arguments: (name, value) of arguments, as on roslaunch's command line.
        choice: Name of a node or of a namespace above it; "" for the robot's, see ``navigators``.

    Raises:
        InputError: One line for everything without which there are no parameters.
    """
    reader = _read(path, arguments)
    if reader.problems:
        raise InputError(reader.problems)
    tree = reader.tree_of_node(path, int(number), choice)
    tree.remarks += [Remark("", CAUTION, text, origin) for origin, text in reader.unread]
    return tree


def navigators(path: Path, arguments: Sequence[Tuple[str, str]] = ()) -> List[str]:
    """List a launch file's move_base nodes, with their namespaces: that of robot i is the i-th.

    They are in the order of the last numbers in their names, or in that of the file if some have
    none or the same.

    Raises:
        InputError: The file cannot be read.
    """
    return _read(path, arguments).navigators()


def _read(path: Path, arguments: Sequence[Tuple[str, str]]) -> _Reader:
    values = (Path(value) for _, value in arguments)
    shared = Shared(path, [value for value in values if value.is_absolute()])
    reader = _Reader(shared)
    words = Substitution(path, dict(arguments), shared)
    reader.read(path, _Scope(path, words, given=dict(arguments)))
    return reader


@dataclass(frozen=True)
class _Scope:
    """Scope of an element: the file, its arguments and the namespace."""

    path: Path
    words: Substitution
    namespace: str = ""
    given: Mapping[str, str] = field(default_factory=dict)

    def inside(self, element: Element, key: str = "ns") -> _Scope:
        """Return the scope in the namespace that an attribute of an element names."""
        below = self.words.text(element.attributes.get(key, ""))
        return replace(self, namespace=_joined(self.namespace, below))


class _Reader:
    """Collects a parameter server's tree from launch files."""

    def __init__(self, shared: Shared) -> None:
        self._shared = shared
        self._server = ParameterTree()
        self._nodes: List[str] = []
        self._depth = 0
        self.problems: List[str] = []
        self.unread: List[Tuple[str, str]] = []

    def read(self, path: Path, scope: _Scope) -> None:
        """Read a file's elements into the tree."""
        root = self._shared.read(path)
        if root.tag != "launch":
            raise InputError([f"{path}:{root.line}: <{root.tag}>; expected <launch>"])
        self._children(root, scope)

    def navigators(self) -> List[str]:
        """List the move_base nodes, see the function of this name."""
        return in_order(dict.fromkeys(self._nodes))

    def tree_of_node(self, path: Path, robot: int, choice: str) -> ParameterTree:
        """Return the parameters of a robot's node, of the chosen one, or of the only one.

        Raises:
            InputError: There is no such move_base node.
        """
        names = self.navigators()
        own = [name for name in names if choice in (name, *name.split("/"))] if choice else names
        if not choice and len(names) > 1:
            own = names[robot : robot + 1]
        if len(own) != 1:
            found = ", ".join(names) if names else "none"
            expected = f"one for robot {robot}" if names else "one, or an <include> with one"
            if choice:
                expected = f"one named {choice}"
            unread = [f"{origin}: {text}" for origin, text in self.unread]
            raise InputError(
                [f"{path}: nodes of type move_base: {found}; expected {expected}", *unread]
            )
        tree = self._server.at(own[0])
        if len(names) > 1 and not choice and not own[0].endswith(f"move_base{robot}"):
            text = f"robot {robot} flies with {own[0]}, one of {', '.join(names)}"
            tree.remarks.append(Remark("", MAPPED, text, str(path)))
        return tree

    def _children(self, parent: Element, scope: _Scope) -> None:
        readers = {tag: getattr(self, f"_{tag}") for tag in _TAGS}
        self._depth += 1
        if self._depth > MAX_DEPTH:
            raise self._shared.too_large(f"{MAX_DEPTH} elements inside each other")
        for element in parent.children:
            reader = readers.get(element.tag)
            if reader is None:
                continue
            try:
                if self._applies(element, scope):
                    reader(element, scope)
            except Unresolved as error:
                self._note_unread(element, scope, str(error))
            except TooLarge:
                raise
            except InputError as error:
                self.problems += error.problems
        self._depth -= 1

    def _note_unread(self, element: Element, scope: _Scope, reason: str) -> None:
        """Note what cannot be resolved; a fault in the node itself, where roslaunch ends too."""
        name = element.attributes.get("name") or element.attributes.get("file", "")
        text = f"<{element.tag}> {excerpt(name)} not read: {reason}"
        origin = f"{scope.path}:{element.line}"
        if scope.namespace in self._nodes:
            self.problems.append(f"{origin}: {text}")
        else:
            self.unread.append((origin, text))

    def _applies(self, element: Element, scope: _Scope) -> bool:
        for key, wanted in (("if", True), ("unless", False)):
            if key in element.attributes:
                word = scope.words.text(element.attributes[key]).strip().lower()
                if word not in _TRUE + _FALSE:
                    raise Unresolved(f'{key}="{word}"; expected true or false')
                if (word in _TRUE) is not wanted:
                    return False
        return True

    def _arg(self, element: Element, scope: _Scope) -> None:
        attributes = element.attributes
        name = attributes.get("name", "")
        known = scope.words.arguments
        if "value" in attributes:
            known[name] = scope.words.text(attributes["value"])
        elif name in scope.given:
            known[name] = scope.given[name]
        elif "default" in attributes:
            known[name] = scope.words.text(attributes["default"])

    def _include(self, element: Element, scope: _Scope) -> None:
        path = self._file(element, scope)
        passed = element.attributes.get("pass_all_args", "").lower() in _TRUE
        given = dict(scope.words.arguments) if passed else {}
        for arg in element.all("arg"):
            if self._applies(arg, scope):
                value = arg.attributes.get("value", arg.attributes.get("default", ""))
                given[arg.attributes.get("name", "")] = scope.words.text(value)
        words = Substitution(path, {}, self._shared)
        self.read(path, replace(scope.inside(element), path=path, words=words, given=given))

    def _group(self, element: Element, scope: _Scope) -> None:
        words = replace(scope.words, arguments=dict(scope.words.arguments))
        self._children(element, replace(scope.inside(element), words=words))

    def _node(self, element: Element, scope: _Scope) -> None:
        if element.attributes.get("type", "") not in _TYPES:
            return
        inner = scope.inside(element).inside(element, "name")
        self._nodes.append(inner.namespace)
        self._children(element, inner)

    def _param(self, element: Element, scope: _Scope) -> None:
        attributes = element.attributes
        place = _joined(scope.namespace, attributes.get("name", ""))
        if not self._is_of_navigation(place):
            return
        if "value" not in attributes:
            raise Unresolved("expected value=, commands and files are not run or read")
        text = scope.words.text(attributes["value"])
        kind = attributes.get("type", "auto")
        value = _value(text, kind)
        set_value(self._server, place, value, f"{scope.path}:{element.line}")

    def _is_of_navigation(self, place: str) -> bool:
        """False for robot descriptions and the like, which are other nodes' parameters."""
        return any(place.startswith(f"{node}/") for node in self._nodes) or "move_base" in place

    def _rosparam(self, element: Element, scope: _Scope) -> None:
        attributes = element.attributes
        if attributes.get("command", "load") != "load":
            return
        place = _joined(scope.namespace, scope.words.text(attributes.get("ns", "")))
        place = _joined(place, scope.words.text(attributes.get("param", "")))
        text, path = element.text, scope.path
        if "file" in attributes:
            path = self._file(element, scope)
            text = read_text(path, plain_yaml.MAX_BYTES)
            self._shared.take(len(text))
        if attributes.get("subst_value", "").lower() in _TRUE:
            text = scope.words.text(text)
        try:
            merge_tree(self._server, parsed(text, path), place)
        except InputError:
            if self._is_of_navigation(f"{place}/"):
                raise

    def _file(self, element: Element, scope: _Scope) -> Path:
        """Return the path of the file that an element names.

        Raises:
            Unresolved: There is no such file, or it is in none of the folders that launch files
                may name files in.
        """
        path = Path.cwd() / scope.words.text(element.attributes.get("file", ""))
        packages = [*self._shared.packages.values(), *scope.path.resolve().parents]
        allowed = [*filter(is_package, packages), *self._shared.given]
        if not _is_file(path):
            raise Unresolved(f"{excerpt(str(path))}: no such file")
        try:
            return referenced_file(scope.path.parent, str(path), allowed)
        except InputError as error:
            raise Unresolved(str(error)) from error


def in_order(names: Iterable[str]) -> List[str]:
    """Sort names by their last numbers; those of which some have none or the same stay."""
    numbers = {name: re.findall("[0-9]+", name)[-1:] for name in names}
    last = [int(found[0]) for found in numbers.values() if found]
    if len(set(last)) < len(numbers):
        return list(numbers)
    return sorted(numbers, key=lambda name: int(numbers[name][0]))


def _is_file(path: Path) -> bool:
    """Tell whether a file exists; a name that no file can have is that of none."""
    try:
        return path.is_file()
    except OSError:  # the name is too long, or its folder cannot be read
        return False


def _joined(above: str, below: str) -> str:
    """Join the names of namespaces; a name that begins with / stands for itself.

    Raises:
        Unresolved: The name is too long: that of each parameter has it.
    """
    names = [] if below.startswith("/") else [above]
    joined = "/".join(part for part in (*names, below.strip("~/")) if part)
    if len(joined) > MAX_TEXT_LENGTH:
        raise Unresolved(f"{excerpt(joined)}: expected {MAX_TEXT_LENGTH} characters at most")
    return joined


def _value(text: str, kind: str) -> Any:
    """Convert a ``<param>`` as roslaunch does."""
    if kind in ("str", "string"):
        return text
    if kind in ("auto", "yaml"):
        try:
            return plain_yaml.load(text) if text.strip() else text
        except yaml.YAMLError:
            return text
    convert: Dict[str, Any] = {"int": int, "double": float, "bool": lambda word: word in _TRUE}
    try:
        return convert[kind](text.strip().lower())
    except (KeyError, ValueError):
        raise Unresolved(f"{text!r} is not of type {kind}") from None
