"""Substitutions of roslaunch: ``$(arg name)``, ``$(find package)``, ``$(env NAME)`` and others.

Expressions are evaluated without Python's ``eval``: operators but powers, conditions, items, lists,
constants, the functions that roslaunch offers, those of ``math``, and a few of numbers and texts.
"""

from __future__ import annotations

import ast
import math
import operator
import os
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Callable, Dict, Sequence

from quad_nav.config.files import SUBSTITUTION
from quad_nav.errors import InputError, QuadError
from quad_nav.files.plain_yaml import MAX_BYTES, MAX_DIGITS
from quad_nav.files.xml_tree import Element, read_xml

MAX_TEXT = MAX_BYTES
"""Characters of a launch file, its included files, expanded texts and YAML files together."""
MAX_ELEMENTS = 20_000
"""Elements of a launch file and its included files together."""
MAX_EXPRESSION = 1000
"""Characters of an expression, and of each argument in it."""

_PACKAGE = re.compile(r"[A-Za-z][A-Za-z0-9_-]{0,99}")
_PACKAGE_FILE = "package.xml"
_LEVELS = 6  # folders above a launch file in which packages are looked for
_FIND = re.compile(r"\$\(find\s+([^()]*)\)")
_COMPARISONS: Dict[type, Callable[[Any, Any], Any]] = {
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.In: lambda a, b: a in b,
    ast.NotIn: lambda a, b: a not in b,
}
_OPERATORS: Dict[type, Callable[..., Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv,
    ast.Mod: operator.mod,
    ast.Not: operator.not_,
    ast.USub: operator.neg,
    ast.UAdd: operator.pos,
}
_PLAIN: Dict[str, Callable[..., Any]] = {
    **{one.__name__: one for one in (int, float, str, bool, abs, min, max, round, len)},
    **{name: getattr(math, name) for name in ("sqrt", "ceil", "floor", "hypot", "degrees")},
    **{name: getattr(math, name) for name in ("radians", "sin", "cos", "tan", "atan", "atan2")},
}
_CONSTANTS = {"true": True, "false": False, "pi": math.pi, "e": math.e}
_OF_TEXTS = ("startswith", "endswith", "lower", "upper", "strip", "split")

_FAULTS = (
    *(SyntaxError, ValueError, TypeError, LookupError, ArithmeticError),
    *(RecursionError, MemoryError),  # of expressions that are nested too deeply
)


class Unresolved(QuadError):
    """Something in a launch file that cannot be resolved here."""


class TooLarge(InputError):
    """A launch file exceeds a limit; nothing more is read of it."""


@dataclass
class Shared:
    """What a launch file and its included files share.

    Attributes:
        path: The file that the user names.
        given: Files and folders that the user names in arguments.
        text_left: Number of characters that may still be read or expanded.
        elements_left: Number of elements that may still be read.
        packages: Folders of the packages that were found, by name.
    """

    path: Path = Path()
    given: Sequence[Path] = ()
    text_left: int = MAX_TEXT
    elements_left: int = MAX_ELEMENTS
    packages: Dict[str, Path] = field(default_factory=dict)

    def take(self, characters: int) -> None:
        """Count characters, before they are allocated where that is possible.

        Raises:
            TooLarge: They are too many.
        """
        self.text_left -= characters
        if self.text_left < 0:
            raise self.too_large(f"{MAX_TEXT} characters")

    def read(self, path: Path) -> Element:
        """Read an XML file and return its root element.

        Raises:
            InputError: It cannot be read.
            TooLarge: It is too large.
        """
        if path.is_file():
            self.take(path.stat().st_size)
        root = read_xml(path, MAX_ELEMENTS)
        self.elements_left -= root.size
        if self.elements_left < 0:
            raise self.too_large(f"{MAX_ELEMENTS} elements")
        return root

    def too_large(self, limit: str) -> TooLarge:
        """Return the error of a launch file that exceeds a limit."""
        return TooLarge(
            [
                f"{self.path}: more than {limit} with its included files, YAML files and $(...) "
                "expanded; expected fewer"
            ]
        )


@dataclass(frozen=True)
class Substitution:
    """Substitutions in one launch file.

    Attributes:
        path: The launch file.
        arguments: Values of ``<arg>``, which grow while the file is read.
        shared: What it shares with the other files.
    """

    path: Path
    arguments: Dict[str, str]
    shared: Shared = field(default_factory=Shared)

    def text(self, text: str) -> str:
        """Replace every ``$(...)`` in a text.

        Raises:
            Unresolved: One of them cannot be resolved.
            TooLarge: The text is too long.
        """
        self.shared.take(len(text))
        if text.startswith("$(eval ") and text.endswith(")"):
            return self._word(text[2:-1])
        # roslaunch looks for packages last, and puts a slash between their folders and a path.
        text = SUBSTITUTION.sub(self._unless_package, text)
        return _FIND.sub(self._folder, text)

    def _unless_package(self, match: re.Match[str]) -> str:
        return match.group() if _FIND.match(match.group()) else self._word(match.group(1))

    def _folder(self, match: re.Match[str]) -> str:
        folder, rest = self._word(f"find {match.group(1)}"), match.string[match.end() :]
        return folder if rest[:1] in ("", "/", " ") else f"{folder}/"

    def _word(self, inner: str) -> str:
        word = self._resolved(inner)
        self.shared.take(len(word))
        return word

    def _resolved(self, inner: str) -> str:
        name, _, rest = inner.strip().partition(" ")
        rest = rest.strip()
        if name == "arg":
            return self._arg(rest)
        if name == "find":
            return str(self._package(rest))
        if name == "dirname":
            return str(self.path.parent)
        if name == "anon":
            return rest
        if name in ("env", "optenv"):
            variable, *default = rest.split()
            value = os.environ.get(variable, " ".join(default) if name == "optenv" else None)
            if value is None:
                raise Unresolved(f"the environment variable {variable} is not set")
            return value
        if name == "eval":
            return str(self._evaluated(rest))
        raise Unresolved(f"unknown $({inner})")

    def _arg(self, name: str) -> str:
        if name not in self.arguments:
            raise Unresolved(f"$(arg {name}) has no value; add {name}=VALUE after the file and :")
        return self.arguments[name]

    def _package(self, name: str) -> Path:
        """Return the folder of a package: around the launch file, then ROS's package path."""
        if name not in self.shared.packages:
            self.shared.packages[name] = self._found(name)
        return self.shared.packages[name]

    def _found(self, name: str) -> Path:
        if not _PACKAGE.fullmatch(name):
            raise Unresolved(f"$(find {name}): expected the name of a package")
        above = list(self.path.resolve().parents)[:_LEVELS]
        for folder in above:
            if folder.name == name or self._package_name(folder) == name:
                return folder
        roots = [
            *above,
            *map(Path, filter(None, os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep))),
        ]
        for root in roots:
            for found in (root / name, *sorted(root.glob(f"*/{name}"))):
                if found.is_dir():
                    return found
        raise Unresolved(f"$(find {name}): no folder of this name around {self.path.parent}")

    def _package_name(self, folder: Path) -> str:
        """Return the name in a folder's ``package.xml``, "" without one."""
        if not is_package(folder):
            return ""
        try:
            return self.shared.read(folder / _PACKAGE_FILE).text_of("name")
        except TooLarge:
            raise
        except InputError:  # then the folder's name counts
            return ""

    def _evaluated(self, expression: str) -> Any:
        if len(expression) > MAX_EXPRESSION:  # a deep one ends the interpreter in some versions
            raise Unresolved(f"$(eval ...) of more than {MAX_EXPRESSION} characters")
        try:
            return self._value(ast.parse(expression.strip(), mode="eval").body)
        except _FAULTS as error:
            raise Unresolved(f"$(eval {expression}): {error}") from error

    def _value(self, node: ast.expr) -> Any:
        """Evaluate one node of an expression."""
        if isinstance(node, ast.Constant):
            return node.value
        if isinstance(node, ast.Name):
            if node.id in _CONSTANTS and node.id not in self.arguments:
                return _CONSTANTS[node.id]
            return _converted(self._arg(node.id))
        if isinstance(node, (ast.List, ast.Tuple)):
            return [self._value(one) for one in node.elts]
        if isinstance(node, ast.BoolOp):
            value = None
            for one in node.values:  # the last one that is looked at counts, as in Python
                value = self._value(one)
                if bool(value) is isinstance(node.op, ast.Or):
                    break
            return value
        if isinstance(node, (ast.UnaryOp, ast.BinOp)) and type(node.op) in _OPERATORS:
            operands = [node.operand] if isinstance(node, ast.UnaryOp) else [node.left, node.right]
            return _bounded(_OPERATORS[type(node.op)], *map(self._value, operands))
        if isinstance(node, ast.IfExp):
            return self._value(node.body if self._value(node.test) else node.orelse)
        if isinstance(node, ast.Compare):
            sides = [self._value(one) for one in (node.left, *node.comparators)]
            compared = zip(node.ops, sides, sides[1:])
            return all(_COMPARISONS[type(op)](left, right) for op, left, right in compared)
        if isinstance(node, ast.Subscript):
            index: Any = node.slice
            if type(index).__name__ == "Index":  # of Python 3.8
                index = index.value
            return self._value(node.value)[self._value(index)]
        if isinstance(node, ast.Call) and not node.keywords:
            return self._called(node.func, [self._value(one) for one in node.args])
        raise ValueError(f"{type(node).__name__} is not supported")

    def _called(self, function: ast.expr, arguments: Any) -> Any:
        if isinstance(function, ast.Name):
            return self._call(function.id, arguments)
        if isinstance(function, ast.Attribute) and function.attr in _OF_TEXTS:
            return getattr(str, function.attr)(self._value(function.value), *arguments)
        raise ValueError(f"{type(function).__name__} is not supported")

    def _call(self, name: str, arguments: Any) -> Any:
        if name in _PLAIN:
            if name in ("int", "float") and len(str(arguments)) > MAX_EXPRESSION:
                raise ValueError(f"{name}() of more than {MAX_EXPRESSION} characters")
            return _PLAIN[name](*arguments)
        if name == "arg":
            return _converted(self._arg(*arguments))
        if name in ("find", "env", "optenv", "dirname", "anon"):
            return self._word(" ".join((name, *map(str, arguments))))
        raise ValueError(f"{name}() is not supported")


def _bounded(calculate: Callable[..., Any], *operands: Any) -> Any:
    """Calculate with numbers, or join texts or lists: a repeated text takes all memory."""
    if calculate is not operator.add and any(isinstance(one, (str, list)) for one in operands):
        raise ValueError(f"{calculate.__name__} of texts or lists is not supported")
    return calculate(*operands)


def _converted(word: str) -> Any:
    """Convert an argument as roslaunch does for expressions."""
    if len(word) > MAX_EXPRESSION:
        raise ValueError(f"an argument of more than {MAX_EXPRESSION} characters")
    if word.lower() in ("true", "false"):
        return word.lower() == "true"
    for convert in (int, float) if len(word) <= MAX_DIGITS else ():
        try:
            return convert(word)
        except ValueError:
            continue
    return word


def is_package(folder: Path) -> bool:
    """Return whether a folder is that of a ROS package."""
    return (folder / _PACKAGE_FILE).is_file()
