"""The lists ``scan_filters`` and ``command_filters``: types and parameters of each filter.

A type is one of the core, ``quad/ScanValidator`` or ``quad/VoronoiCell``; ``package/Class`` of a
Python package that is installed, such as an add-on; or the dotted name of a class. A filter's
parameters are in the namespace of its name.
"""

from __future__ import annotations

from typing import Any, Dict, List, Mapping, Tuple, Union

from quad_nav.config.notes import Notes, join
from quad_nav.config.plugins import (
    COMMAND_FILTER,
    SCAN_FILTER,
    Interface,
    Parameters,
    Plugin,
    load_class,
)
from quad_nav.config.reader import Namespace, check_class, subtree

SCAN_FILTERS, COMMAND_FILTERS = "scan_filters", "command_filters"
SCAN_VALIDATOR, VORONOI_CELL = "quad/ScanValidator", "quad/VoronoiCell"
_LISTS: Dict[str, Tuple[Interface, str, Tuple[Tuple[str, str], ...]]] = {
    SCAN_FILTERS: (SCAN_FILTER, SCAN_VALIDATOR, (("validator", SCAN_VALIDATOR),)),
    COMMAND_FILTERS: (COMMAND_FILTER, VORONOI_CELL, (("peers", VORONOI_CELL),)),
}

FilterType = Union[str, Plugin]
"""Type of a filter of the core, or the class and parameters of another one."""


def normalise_filters(tree: Namespace, notes: Notes) -> None:
    """Check both lists, and that the classes exist; report every fault."""
    for key in _LISTS:
        interface, own, _ = _LISTS[key]
        entries = tree.get(key)
        if entries is None:
            continue
        if not isinstance(entries, list):
            notes.problem(key, f"{entries!r} is not a list; expected a list of {{name: , type: }}")
            tree[key] = []
            continue
        names: List[str] = []
        for entry in entries:
            if not _is_entry(entry):
                notes.problem(key, f"{entry!r} is not a filter; expected {{name: , type: }}")
            elif entry["name"] in names:
                notes.problem(key, f"{entry['name']!r} is used twice; expected unique names")
            else:
                names.append(entry["name"])
                subtree(tree, entry["name"], "", notes)
                if entry["type"] != own:
                    check_class(
                        class_name(entry["type"]), interface, join(key, entry["name"]), notes
                    )


def filters_of(tree: Mapping[str, Any], key: str) -> Tuple[Tuple[str, FilterType], ...]:
    """Return (name, type) of each filter of a list in a normalised tree."""
    interface, own, usual = _LISTS[key]
    if key not in tree:
        return usual
    found: List[Tuple[str, FilterType]] = []
    for entry in tree[key]:
        name, kind = entry["name"], entry["type"]
        if kind == own:
            found.append((name, kind))
            continue
        loaded = load_class(class_name(kind), interface)
        parameters = Parameters(tree.get(name, {}), name)
        found.append((name, Plugin(loaded, parameters, interface.methods_of)))
    return tuple(found)


def class_name(kind: str) -> str:
    """Return the dotted name of a type: ``quad_moving.Tracker`` for ``quad_moving/Tracker``."""
    return kind.replace("/", ".")


def filter_names(tree: Mapping[str, Any]) -> List[str]:
    """List the namespaces of filters, and the lists themselves."""
    names = list(_LISTS)
    for key in _LISTS:
        entries = tree.get(key)
        if isinstance(entries, list):
            names += [entry["name"] for entry in entries if _is_entry(entry)]
    return names


def _is_entry(entry: Any) -> bool:
    return isinstance(entry, dict) and all(
        isinstance(entry.get(key), str) for key in ("name", "type")
    )
