"""YAML documents that people write: read with care, checked field by field."""

from __future__ import annotations

import difflib
import math
from pathlib import Path
from typing import Any, Dict, Hashable, List, Optional, Sequence, Tuple

import yaml

from quad_nav.errors import InputError
from quad_nav.files.plain_yaml import MOST_BYTES, PlainLoader
from quad_nav.files.user_files import read_text

LARGEST = 1e6
"""No length, height or angle in a scene is beyond it."""
LONGEST_TEXT = 200


def read_yaml(path: Path) -> Any:
    """The document of a file. Raises ``InputError``, with the line if it is not YAML."""
    try:
        return yaml.load(read_text(path, MOST_BYTES), Loader=_Loader)
    except yaml.YAMLError as error:
        raise InputError([f"{path}: {_yaml_fault(error)}"]) from error


class Checker:
    """Reads fields of a document and notes what is wrong with them.

    A faulty field reads as a harmless number, so that the checks go on.
    """

    def __init__(self, source: str):
        self.source = source
        self.problems: List[str] = []

    def fault(self, place: str, problem: str) -> None:
        self.problems.append(
            f"{self.source}: {place}: {problem}" if place else f"{self.source}: {problem}"
        )

    def mapping(self, value: Any, place: str, known: Sequence[str]) -> Optional[Dict[str, Any]]:
        if not isinstance(value, dict):
            self.fault(place, f"{kind(value)}, expected a mapping with {', '.join(known)}")
            return None
        for key in value:
            if key not in known:
                near = difflib.get_close_matches(str(key), known, 1)
                hint = f"did you mean {near[0]}?" if near else f"known: {', '.join(known)}"
                self.fault(_join(place, key), f"unknown key; {hint}")
        return value

    def sequence(
        self, fields: Dict[str, Any], key: str, default: Optional[List[Any]] = None
    ) -> List[Any]:
        value = fields.get(key, default)
        if not isinstance(value, list):
            self.fault(key, f"{kind(value)}, expected a list")
            return []
        return value

    def text(self, fields: Dict[str, Any], key: str, place: str, default: str) -> str:
        value = fields.get(key, default)
        if (
            not isinstance(value, str)
            or not 0 < len(value) <= LONGEST_TEXT
            or (not value.isprintable())
        ):
            self.fault(
                _join(place, key),
                f"{kind(value)}, expected a text of 1 to "
                f"{LONGEST_TEXT} characters that can be printed",
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
        if key not in fields and default is not None:
            return default
        return self.as_number(fields.get(key), _join(place, key), positive)

    def numbers(
        self, fields: Dict[str, Any], key: str, place: str, count: int, positive: bool = False
    ) -> Tuple[float, ...]:
        value, where = fields.get(key), _join(place, key)
        if not isinstance(value, list) or len(value) != count:
            self.fault(where, f"{kind(value)}, expected a list of {count} numbers")
            return (1.0,) * count
        return tuple(self.as_number(v, f"{where}[{k}]", positive) for k, v in enumerate(value))

    def as_number(self, value: Any, place: str, positive: bool = False) -> float:
        expected = "expected a number above 0" if positive else "expected a finite number"
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            self.fault(place, f"{kind(value)}, {expected}")
            return 1.0
        if not math.isfinite(value) or (positive and value <= 0):
            self.fault(place, f"{value}, {expected}")
            return 1.0
        if abs(value) > LARGEST:
            self.fault(place, f"{value:g}, expected {LARGEST:g} at most")
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


def _yaml_fault(error: yaml.YAMLError) -> str:
    mark = getattr(error, "problem_mark", None)
    problem = getattr(error, "problem", None) or str(error)
    if mark is None:
        return f"not YAML: {problem}"
    return f"line {mark.line + 1}, column {mark.column + 1}: {problem}"


def kind(value: Any) -> str:
    """How to call a value that is of the wrong type."""
    if value is None:
        return "missing"
    if isinstance(value, list):
        return f"a list of {len(value)}"
    return "a mapping" if isinstance(value, dict) else _short(repr(value))


def _join(place: str, key: Any) -> str:
    return f"{place}.{key}" if place else str(key)


def _short(text: str) -> str:
    return text if len(text) <= LONGEST_TEXT else text[:LONGEST_TEXT] + "..."
