"""The lists ``scan_filters`` and ``command_filters``: types and parameters of each filter.

A type is one of the core, such as ``quad/VoronoiCell``; ``package/Class`` of a Python package that
is installed, such as an add-on; or the dotted name of a class. A filter's parameters are in the
namespace of its name.
"""

from __future__ import annotations

from typing import Any, Dict, List, Mapping, Tuple

from quad_nav.config.notes import Notes, join
from quad_nav.config.plugins import (
    COMMAND_FILTER,
    SCAN_FILTER,
    Interface,
    Plugin,
    plugin_of,
)
from quad_nav.config.reader import Namespace, check_class, named_types, subtree
from quad_nav.parameter import checked

SCAN_FILTERS, COMMAND_FILTERS = "scan_filters", "command_filters"
_CORE = {
    "quad/ScanValidator": "quad_nav.costmap.scan_validator.ScanValidator",
    "quad/VoronoiCell": "quad_nav.navigator.command_filter.VoronoiCell",
}
"""Class of each filter of the core by its type."""
_LISTS: Dict[str, Tuple[Interface, Dict[str, str]]] = {
    SCAN_FILTERS: (SCAN_FILTER, {"name": "validator", "type": "quad/ScanValidator"}),
    COMMAND_FILTERS: (COMMAND_FILTER, {"name": "peers", "type": "quad/VoronoiCell"}),
}
"""Interface of the filters of each list, and the one filter of a robot without the list."""


def normalise_filters(tree: Namespace, notes: Notes) -> None:
    """Check both lists, and that the classes exist; report every fault."""
    for key, (interface, _) in _LISTS.items():
        if tree.get(key) is None:  # a YAML key with nothing below it
            tree.pop(key, None)
            continue
        listed = named_types(tree[key], key, "a filter", notes)
        for name, kind in listed.items():
            subtree(tree, name, "", notes)
            loaded = check_class(class_name(kind), interface, join(key, name), notes)
            owner = getattr(loaded, "params_class", None)  # declares the parameters
            for parameter, fault in () if owner is None else checked(owner, tree[name])[1]:
                notes.problem(join(name, parameter), fault)
        tree[key] = [{"name": name, "type": kind} for name, kind in listed.items()]


def filters_of(tree: Mapping[str, Any], key: str) -> Tuple[Tuple[str, Plugin], ...]:
    """Return (name, class and parameters) of each filter of a list in a normalised tree."""
    interface, usual = _LISTS[key]
    return tuple(
        (name, plugin_of(class_name(kind), interface, tree.get(name, {}), name))
        for name, kind in ((one["name"], one["type"]) for one in tree.get(key, [usual]))
    )


def class_name(kind: str) -> str:
    """Return the dotted name of a type: ``quad_moving.Tracker`` for ``quad_moving/Tracker``."""
    return _CORE.get(kind, kind.replace("/", "."))


def filter_names(tree: Mapping[str, Any]) -> List[str]:
    """List the namespaces of filters, and the lists themselves."""
    names = list(_LISTS)
    for key in _LISTS:
        entries = tree.get(key)
        for entry in entries if isinstance(entries, list) else ():
            names += [str(entry.get("name"))] if isinstance(entry, dict) else []
    return names
