"""Parameters of a tree that are known, and those that differ from move_base's defaults."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Dict, Iterator, Mapping, Tuple

from quad_nav.config.configuration import tables_of
from quad_nav.config.files import COSTMAPS, ParameterTree, below, set_value
from quad_nav.config.notes import join
from quad_nav.config.reader import Table
from quad_nav.config.recoveries import CLEAR, TABLES


@dataclass(frozen=True)
class Difference:
    """Parameter that differs from its default; ``path`` starts at the node's level."""

    path: str
    value: Any
    default: Any
    unit: str = ""


def known_parameters(tree: Mapping[str, Any]) -> Dict[str, Any]:
    """Return the parameters of a normalised tree that are known, for recordings.

    Unknown ones may hold anything, such as variables of the environment in a launch file.
    Parameters of plugins are not known.

    Args:
        tree: A tree of ``Configuration.to_tree``.
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
    """List the parameters of a normalised tree that differ from their defaults.

    Parameters of plugins have no known default and are left out. So are the distances of the
    default recoveries, which follow from other parameters.

    Args:
        tree: A tree of ``Configuration.to_tree``.
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
