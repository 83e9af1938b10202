"""YAML documents that people write: read with limits, checked field by field."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, Dict, Hashable, List, Optional, Sequence, Tuple

import yaml

from quad_nav.errors import InputError
from quad_nav.files.plain_yaml import MAX_BYTES, PlainLoader
from quad_nav.files.user_files import read_text
from quad_nav.files.values import is_number, nearest

MAX_MAGNITUDE = 1e6
"""Largest length, height or angle in a scene."""
MAX_TEXT_LENGTH = 200


def read_yaml(path: Path) -> Any:
    """Read the document of a YAML file.

    Raises:
        InputError: The file cannot be read, or is not YAML; with the line.
    """
    try:
        return yaml.load(read_text(path, MAX_BYTES), Loader=_Loader)  # noqa: S506, it is a SafeLoader
    except yaml.YAMLError as error:
        raise InputError([f"{path}: {yaml_fault(error)}"]) from error


class Checker:
    """Reads fields of a document and collects their faults.

    A faulty field reads as a harmless value, so that the checks continue.

    Attributes:
        source: The file's name, for messages.
        problems: A message for each fault.
    """

    def __init__(self, source: str) -> None:
        self.source = source
        self.problems: List[str] = []

    def fault(self, place: str, problem: str) -> None:
        """Add a fault at a place; "" is the whole document."""
        self.problems.append(
            f"{self.source}: {place}: {problem}" if place else f"{self.source}: {problem}"
        )

    def mapping(self, value: Any, place: str, known: Sequence[str]) -> Optional[Dict[str, Any]]:
        """Return a mapping, or None for another value; unknown keys are faults."""
        if not isinstance(value, dict):
            self.fault(place, f"{describe(value)}, expected a mapping with {', '.join(known)}")
            return None
        for key in value:
            if key not in known:
                near = nearest(key, known)
                hint = f"did you mean {near}?" if near else f"known: {', '.join(known)}"
                self.fault(_join(place, key), f"unknown key; {hint}")
        return value

    def sequence(
        self, fields: Dict[str, Any], key: str, default: Optional[List[Any]] = None
    ) -> List[Any]:
        """Return a list."""
        value = fields.get(key, default)
        if not isinstance(value, list):
            self.fault(key, f"{describe(value)}, expected a list")
            return []
        return value

    def text(self, fields: Dict[str, Any], key: str, place: str, default: str) -> str:
        """Return a text of printable characters."""
        value = fields.get(key, default)
        if (
            not isinstance(value, str)
            or not 0 < len(value) <= MAX_TEXT_LENGTH
            or (not value.isprintable())
        ):
            self.fault(
                _join(place, key),
                f"{describe(value)}, expected a text of 1 to "
                f"{MAX_TEXT_LENGTH} characters that can be printed",
            )
            return default
        return value

    def number(
        self,
        fields: Dict[str, Any],
        key: str,
        place: str,
        default: Optional[float] = None,
        positive: bool = False,
    ) -> float:
        """Return a number of a field."""
        if key not in fields and default is not None:
            return default
        return self.as_number(fields.get(key), _join(place, key), positive)

    def numbers(
        self, fields: Dict[str, Any], key: str, place: str, count: int, positive: bool = False
    ) -> Tuple[float, ...]:
        """Return a list of ``count`` numbers."""
        value, where = fields.get(key), _join(place, key)
        if not isinstance(value, list) or len(value) != count:
            self.fault(where, f"{describe(value)}, expected a list of {count} numbers")
            return (1.0,) * count
        return tuple(self.as_number(v, f"{where}[{k}]", positive) for k, v in enumerate(value))

    def as_number(self, value: Any, place: str, positive: bool = False) -> float:
        """Return a value as a finite number, above 0 if ``positive``."""
        expected = "expected a number above 0" if positive else "expected a finite number"
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            self.fault(place, f"{describe(value)}, {expected}")
            return 1.0
        if not is_number(value) or (positive and value <= 0):
            self.fault(place, f"{value}, {expected}")
            return 1.0
        if abs(value) > MAX_MAGNITUDE:
            self.fault(place, f"{value:g}, expected {MAX_MAGNITUDE:g} at most")
            return 1.0
        return float(value)


class _Loader(PlainLoader):
    """Refuses a key that is given twice, where YAML would silently keep the last."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> Dict[Hashable, Any]:
        seen = set()
        for key_node, _ in node.value:
            if not isinstance(key_node, yaml.ScalarNode):
                continue
            if key_node.value in seen:
                raise yaml.constructor.ConstructorError(
                    None, None, f"key {key_node.value!r} is given twice", key_node.start_mark
                )
            seen.add(key_node.value)
        return super().construct_mapping(node, deep)


# YAML 1.1 takes 5e-2 for a text, the parsers of map_server and of YAML 1.2 for a number.
_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float",
    re.compile(r"[-+]?[0-9]+(\.[0-9]*)?[eE][-+]?[0-9]+$"),
    list("-+0123456789"),
)


def yaml_fault(error: yaml.YAMLError) -> str:
    """Describe an error of YAML in one line, with its place if that is known."""
    mark = getattr(error, "problem_mark", None)
    problem = getattr(error, "problem", None) or " ".join(str(error).split())
    if mark is None:
        return f"not YAML: {problem}"
    return f"line {mark.line + 1}, column {mark.column + 1}: {problem}"


def describe(value: Any) -> str:
    """Describe a value of the wrong type for a message."""
    if value is None:
        return "missing"
    if isinstance(value, list):
        return f"a list of {len(value)}"
    return "a mapping" if isinstance(value, dict) else _shortened(repr(value))


def _join(place: str, key: Any) -> str:
    return f"{place}.{key}" if place else str(key)


def _shortened(text: str) -> str:
    return text if len(text) <= MAX_TEXT_LENGTH else text[:MAX_TEXT_LENGTH] + "..."
