"""Parameters that differ from move_base's defaults, as few table rows, and as JSON."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from typing import Any, Dict, List, Mapping, Tuple

from quad_nav.config.differences import differences

Trees = Mapping[str, Mapping[str, Any]]
"""Robot's name -> its tree of ``Configuration.to_tree``; an empty tree is unknown."""

_COSTMAPS = ("global_costmap/", "local_costmap/")


@dataclass(frozen=True)
class ParameterRow:
    """Row of the table.

    ``robots`` is empty if the row holds for all robots. ``{i}`` in a value stands for the robot's
    number.
    """

    path: str
    value: str
    default: str
    unit: str
    robots: str = ""


def parameter_rows(trees: Trees) -> Tuple[ParameterRow, ...]:
    """Build the rows; costmaps with equal values share one, and so do robots."""
    found: Dict[ParameterRow, List[str]] = {}
    known = [name for name, tree in trees.items() if tree]
    for name in known:
        for row in _with_common_costmaps(_rows(trees[name], _number(name))):
            found.setdefault(row, []).append(name)
    return tuple(
        ParameterRow(
            row.path,
            row.value,
            row.default,
            row.unit,
            "" if len(names) == len(known) else ", ".join(names),
        )
        for row, names in found.items()
    )


def difference_list(trees: Trees) -> List[Dict[str, Any]]:
    """Return the differences as JSON objects with their exact values.

    Each has ``parameter``, ``value``, ``default``, ``unit`` and the ``robots`` that it holds for,
    None for all. ``{i}`` in a text stands for the robot's number.
    """
    found: Dict[str, Dict[str, Any]] = {}
    for name, tree in trees.items():
        for entry in differences(tree) if tree else ():
            value = entry.value
            if isinstance(value, str):
                value = _numbered(value, _number(name))
            fields = {
                "parameter": entry.path,
                "value": value,
                "default": entry.default,
                "unit": entry.unit,
            }
            key = json.dumps(fields, default=str)
            found.setdefault(key, {**fields, "robots": []})["robots"].append(name)
    known = sum(bool(tree) for tree in trees.values())
    for fields in found.values():
        fields["robots"] = fields["robots"] if len(fields["robots"]) < known else None
    return list(found.values())


def _number(robot: str) -> str:
    return "".join(re.findall(r"\d+$", robot))


def _numbered(text: str, number: str) -> str:
    """Replace the robot's number in names such as ``odom0`` by ``{i}``."""
    return re.sub(rf"(?<=[A-Za-z_]){number}\b", "{i}", text) if number else text


def _rows(tree: Any, number: str) -> List[ParameterRow]:
    return [
        ParameterRow(entry.path, _text(entry.value, number), _text(entry.default, ""), entry.unit)
        for entry in differences(tree)
    ]


def number_text(value: Any) -> str:
    """Return a parameter's value as text."""
    if value is None:
        return "unset"
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:g}" if isinstance(value, float) else str(value) or '""'


def _text(value: Any, number: str) -> str:
    return _numbered(number_text(value), number) if isinstance(value, str) else number_text(value)


def _with_common_costmaps(rows: List[ParameterRow]) -> List[ParameterRow]:
    """Merge rows that both costmaps have into one named ``*_costmap/...``."""
    everything = set(rows)
    common = []
    for row in rows:
        own = next((costmap for costmap in _COSTMAPS if row.path.startswith(costmap)), None)
        if own is None:
            common.append(row)
            continue
        rest = row.path[len(own) :]
        twins = [
            ParameterRow(costmap + rest, row.value, row.default, row.unit) for costmap in _COSTMAPS
        ]
        if not everything.issuperset(twins):
            common.append(row)
        elif own == _COSTMAPS[0]:
            common.append(ParameterRow("*_costmap/" + rest, row.value, row.default, row.unit))
    return common
