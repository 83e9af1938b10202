"""Parameters of a tree that are known, and those that differ from move_base's defaults."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass, replace
from typing import Any, Dict, Iterator, List, Mapping, Sequence, Tuple, TypeVar

from quad_nav.config.configuration import tables_of
from quad_nav.config.files import COSTMAPS, ParameterTree, below, set_value
from quad_nav.config.notes import join
from quad_nav.config.reader import Table
from quad_nav.config.recoveries import CLEAR, TABLES

Row = TypeVar("Row", bound=Any)
Trees = Mapping[str, Mapping[str, Any]]
"""Robot's name -> its tree of ``Configuration.to_tree``; an empty tree is unknown."""


@dataclass(frozen=True)
class Difference:
    """Parameter that differs from its default; ``path`` starts at the node's level."""

    path: str
    value: Any
    default: Any
    unit: str = ""


def known_parameters(tree: Mapping[str, Any]) -> Dict[str, Any]:
    """Return the parameters of a ``Configuration.to_tree`` that are known, for recordings.

    Unknown ones may hold anything, such as variables of the environment in a launch file.
    Parameters of plugins are not known.
    """
    known = ParameterTree()
    for path, table, namespace in (*tables_of(tree), *_default_recoveries(tree)):
        lists = ("layer_names",) if table is TABLES[CLEAR] else ()
        for name in (*(parameter.name for parameter in table.parameters), *lists):
            if name in namespace:
                set_value(known, join(path, name), namespace[name], "")
    for path, name in (("", "recovery_behaviors"), *((one, "plugins") for one in COSTMAPS)):
        listed = below(tree, path).get(name)
        if listed is not None:
            entries = [{"name": entry["name"], "type": entry["type"]} for entry in listed]
            set_value(known, join(path, name), entries, "")
    return known


def differences(tree: Mapping[str, Any]) -> Tuple[Difference, ...]:
    """List the parameters of a ``Configuration.to_tree`` that differ from their defaults.

    Parameters of plugins have no known default and are left out. So are the distances of the
    default recoveries, which follow from other parameters.
    """
    return tuple(
        difference
        for path, table, namespace in tables_of(tree)
        for difference in _differences(path, table, namespace)
    )


def _differences(path: str, table: Table, namespace: Mapping[str, Any]) -> Iterator[Difference]:
    for parameter in table.parameters:
        value = namespace.get(parameter.name, parameter.in_force)
        if value not in (parameter.in_force, parameter.default):
            unit = "" if parameter.kind == "str" else parameter.unit
            yield Difference(join(path, parameter.name), value, parameter.in_force, unit)


def _default_recoveries(tree: Mapping[str, Any]) -> Iterator[Tuple[str, Table, Mapping[str, Any]]]:
    if "recovery_behaviors" not in tree:
        for name in ("conservative_reset", "aggressive_reset"):
            yield name, TABLES[CLEAR], below(tree, name)


@dataclass(frozen=True)
class ParameterRow:
    """Row of the report's table.

    ``robots`` is empty if the row holds for all robots. ``{i}`` in a value stands for the robot's
    number, ``*_costmap`` in a path for both costmaps.
    """

    path: str
    value: str
    default: str
    unit: str
    robots: str = ""


def parameter_rows(trees: Trees) -> Tuple[ParameterRow, ...]:
    """Build the rows; costmaps with equal values share one, and so do robots."""
    rows = [
        ParameterRow(
            entry["parameter"],
            number_text(entry["value"]),
            number_text(entry["default"]),
            entry["unit"],
            ", ".join(entry["robots"] or ()),
        )
        for entry in difference_list(trees)
    ]
    return tuple(with_common_costmaps(rows))


def with_common_costmaps(rows: Sequence[Row]) -> List[Row]:
    """Merge rows that both costmaps have into one whose path is ``*_costmap/...``.

    Args:
        rows: Instances of a frozen dataclass with a field ``path``.
    """
    own, other = (f"{name}/" for name in COSTMAPS)
    common = []
    for row in rows:
        _, is_twin, rest = row.path.partition("_costmap/")
        twins = {replace(row, path=costmap + rest) for costmap in (own, other)}
        if not is_twin or not twins <= set(rows):
            common.append(row)
        elif row.path.startswith(own):
            common.append(replace(row, path="*_costmap/" + rest))
    return common


def difference_list(trees: Trees) -> List[Dict[str, Any]]:
    """Return the differences as JSON objects with their exact values.

    Each has ``parameter``, ``value``, ``default``, ``unit`` and the ``robots`` that it holds for,
    None for all. ``{i}`` in a text stands for the robot's number.
    """
    found: Dict[str, Dict[str, Any]] = {}
    known = [name for name, tree in trees.items() if tree]
    for name in known:
        for entry in differences(trees[name]):
            fields = {
                "parameter": entry.path,
                "value": _numbered(entry.value, name),
                "default": entry.default,
                "unit": entry.unit,
            }
            key = json.dumps(fields, default=str)
            found.setdefault(key, {**fields, "robots": []})["robots"].append(name)
    for fields in found.values():
        fields["robots"] = fields["robots"] if len(fields["robots"]) < len(known) else None
    return list(found.values())


def number_text(value: Any) -> str:
    """Return a parameter's value as text."""
    if value is None:
        return "unset"
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:g}" if isinstance(value, float) else str(value) or '""'


def _numbered(value: Any, robot: str) -> Any:
    """Replace the robot's number in names such as ``odom0`` by ``{i}``."""
    number = "".join(re.findall(r"\d+$", robot))
    if not number or not isinstance(value, str):
        return value
    return re.sub(rf"(?<=[A-Za-z_]){number}\b", "{i}", value)
