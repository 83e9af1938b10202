"""Checks one namespace of a parameter tree against its table.

``normalise`` brings a namespace into the state in which the original leaves it on
the parameter server: types made right, ranges clamped, reconfigurable
parameters all present. Dataclasses are then made from normalised namespaces, where
nothing can be wrong any more.
"""

from __future__ import annotations

from typing import Any, Dict, Iterable, Mapping, Tuple

from quad_nav.config.notes import CLAMPED, IGNORED, UNSUPPORTED, Notes, join
from quad_nav.config.plugins import Interface, load_class
from quad_nav.config.spec import InvalidValue, Parameter, Table
from quad_nav.errors import InputError

Namespace = Dict[str, Any]


def normalise(
    namespace: Namespace, path: str, table: Table, notes: Notes, also_known: Iterable[str] = ()
) -> None:
    """Checks and completes a namespace in place; faults and remarks go to ``notes``.

    Args:
        path: the namespace's path, for messages.
        also_known: keys that somebody else reads.
    """
    for parameter in table.parameters:
        if parameter.name in namespace:
            _normalise_value(namespace, path, parameter, notes)
    for parameter in table.reconfigurable:
        namespace.setdefault(parameter.name, parameter.default)
    _remark_on_other_keys(namespace, path, table, notes, also_known)


def _normalise_value(namespace: Namespace, path: str, parameter: Parameter, notes: Notes) -> None:
    given = namespace[parameter.name]
    place = join(path, parameter.name)
    try:
        checked = parameter.check(given)
    except InvalidValue as problem:
        notes.problem(place, str(problem))
        return
    value = parameter.clamp(checked)
    if value != checked:
        bound = "largest" if value < checked else "smallest"
        notes.remark(place, CLAMPED, f"{given} becomes {value}, the {bound} that move_base allows")
    elif value != given:
        notes.remark(place, CLAMPED, f"{given} becomes {value}: move_base takes whole numbers only")
    namespace[parameter.name] = value


def _remark_on_other_keys(
    namespace: Namespace, path: str, table: Table, notes: Notes, also_known: Iterable[str]
) -> None:
    names = {parameter.name for parameter in table.parameters} | set(also_known)
    for key in namespace:
        if key in names:
            continue
        place = join(path, str(key))
        if key in dict(table.unsupported):
            reason = dict(table.unsupported)[key]
            notes.remark(place, UNSUPPORTED, f"known to move_base but not supported here: {reason}")
        elif key in dict(table.ignored):
            notes.remark(place, IGNORED, f"ignored by move_base: {dict(table.ignored)[key]}")
        else:
            notes.unknown(place, str(key), names)


def fields(
    namespace: Mapping[str, Any], parameters: Iterable[Parameter], given: Iterable[str] = ()
) -> Dict[str, Any]:
    """Arguments of a dataclass from a normalised namespace.

    A parameter with a value of its own until the first reconfiguration has that
    one, unless its name is in ``given``.
    """
    given = set(given)
    arguments = {}
    for parameter in parameters:
        if not parameter.field:
            continue
        value = namespace.get(parameter.name, parameter.in_force)
        if parameter.initial is not None and parameter.name not in given:
            value = parameter.initial
        arguments[parameter.field] = parameter.field_value(value)
    return arguments


def subtree(tree: Namespace, name: str, path: str, notes: Notes) -> Namespace:
    """The namespace of that name, made when it is missing; a problem when it is a value."""
    value = tree.setdefault(name, {})
    if value is None:  # a YAML key with nothing below it
        value = tree[name] = {}
    if not isinstance(value, dict):
        notes.problem(join(path, name), f"{value!r} is a value; expected a namespace of parameters")
        value = tree[name] = {}
    return value


def check_class(name: str, interface: Interface, place: str, notes: Notes) -> None:
    """Problems for everything that keeps a user's class from being what it has to be."""
    try:
        load_class(name, interface)
    except InputError as error:
        for problem in error.problems:
            notes.problem(place, problem)


def inherited(name: str, chain: Iterable[Tuple[str, Mapping[str, Any]]]) -> Tuple[str, Any]:
    """ROS's searchParam: (path, value) of the first (path, namespace) that has the name,
    or ("", None)."""
    for path, namespace in chain:
        if name in namespace:
            return join(path, name), namespace[name]
    return "", None
