"""Parameters of a tree that are known, and those that differ from move_base's defaults."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Dict, Iterator, Mapping, Tuple

from quad_nav.config.configuration import COSTMAPS, MOVE_BASE_TABLE
from quad_nav.config.costmaps import COSTMAP_TABLE
from quad_nav.config.files import ParameterTree, set_value
from quad_nav.config.fixes import GROUPS
from quad_nav.config.layers import LAYERS, SOURCE_TABLE
from quad_nav.config.notes import join
from quad_nav.config.planners import SLOTS, planner_type
from quad_nav.config.plugins import plugin_name
from quad_nav.config.reader import Table
from quad_nav.config.recoveries import CLEAR, full_type
from quad_nav.config.recoveries import TABLES as RECOVERY_TABLES

Namespaced = Tuple[str, Table, Mapping[str, Any]]


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
    for path, table, namespace in (*_namespaces(tree), *_default_recoveries(tree)):
        lists = ("layer_names",) if table is RECOVERY_TABLES[CLEAR] else ()
        for name in (*(parameter.name for parameter in table.parameters), *lists):
            if name in namespace:
                set_value(known, join(path, name), namespace[name], "")
    for path, name in (("", "recovery_behaviors"), *((one, "plugins") for one in COSTMAPS)):
        listed = (_below(tree, path) if path else tree).get(name)
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
        for path, table, namespace in _namespaces(tree)
        for difference in _differences(path, table, namespace)
    )


def _differences(path: str, table: Table, namespace: Mapping[str, Any]) -> Iterator[Difference]:
    for parameter in table.parameters:
        value = namespace.get(parameter.name, parameter.in_force)
        if value not in (parameter.in_force, parameter.default):
            unit = "" if parameter.kind == "str" else parameter.unit
            yield Difference(join(path, parameter.name), value, parameter.in_force, unit)


def _namespaces(tree: Mapping[str, Any]) -> Iterator[Namespaced]:
    """Yield (path, table, parameters) of each namespace whose parameters are known."""
    yield "", MOVE_BASE_TABLE, tree
    for key in SLOTS:
        planner = planner_type(tree, key) if key in tree else None
        if planner is not None:
            name = plugin_name(tree[key])
            yield name, planner.table, _below(tree, name)
    for costmap in COSTMAPS:
        yield costmap, COSTMAP_TABLE, _below(tree, costmap)
        yield from _layers(costmap, _below(tree, costmap))
    for entry in tree.get("recovery_behaviors", ()):
        table = RECOVERY_TABLES.get(full_type(entry["type"]))
        if table is not None:
            yield entry["name"], table, _below(tree, entry["name"])
    for group, table in GROUPS.items():
        yield group, table, _below(tree, group)


def _default_recoveries(tree: Mapping[str, Any]) -> Iterator[Namespaced]:
    if "recovery_behaviors" not in tree:
        for name in ("conservative_reset", "aggressive_reset"):
            yield name, RECOVERY_TABLES[CLEAR], _below(tree, name)


def _layers(path: str, costmap: Mapping[str, Any]) -> Iterator[Namespaced]:
    for plugin in costmap.get("plugins", ()):
        if plugin["type"] not in LAYERS:
            continue
        place, layer = join(path, plugin["name"]), _below(costmap, plugin["name"])
        yield place, LAYERS[plugin["type"]], layer
        for source in str(layer.get("observation_sources", "")).split():
            yield join(place, source), SOURCE_TABLE, _below(layer, source)


def _below(tree: Mapping[str, Any], name: str) -> Dict[str, Any]:
    namespace = tree.get(name)
    return namespace if isinstance(namespace, dict) else {}
