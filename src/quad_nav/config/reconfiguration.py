"""Change a configuration in flight, as dynamic_reconfigure does."""

from __future__ import annotations

import copy
from dataclasses import replace
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple

from quad_nav.config.configuration import (
    Configuration,
    changing_parts,
    tables_of,
    workload_problems,
)
from quad_nav.config.files import below
from quad_nav.config.notes import Notes, join
from quad_nav.config.planners import SLOTS, change_planners, local_planner_period_s
from quad_nav.config.plugins import plugin_name
from quad_nav.config.recoveries import with_local_planner
from quad_nav.errors import InputError
from quad_nav.parameter import InvalidValue, Parameter

_GROUPS = "groups"  # dynamic_reconfigure's own bookkeeping among the values
_RESTORE = "restore_defaults"


def reconfigurable(configuration: Configuration) -> Dict[str, Tuple[Parameter, ...]]:
    """Return namespace -> reconfigurable parameters, in the order of upstream move_base.

    Namespaces are relative to the node; "" is move_base itself.
    """
    return {
        path: table.reconfigurable
        for path, table, _ in tables_of(configuration.tree)
        if table.reconfigurable
    }


def values(configuration: Configuration, namespace: str) -> Dict[str, Any]:
    """Return the ROS values in force of a namespace's reconfigurable parameters."""
    normalised = below(configuration.tree, namespace)
    return {
        parameter.name: normalised[parameter.name]
        for parameter in reconfigurable(configuration)[namespace]
    }


def updated(
    configuration: Configuration,
    namespace: str,
    changes: Mapping[str, Any],
    stored: Optional[Mapping[str, Any]] = None,
) -> Configuration:
    """Return the configuration with some parameters of one namespace changed.

    Values are clamped to their ranges. ``restore_defaults`` restores the namespace as it was
    loaded. As in move_base, recoveries keep the parameters that they were loaded with. Another
    planner has the parameters of its namespace.

    Args:
        configuration: The configuration in force.
        namespace: A namespace of ``reconfigurable``.
        changes: Name -> new value.
        stored: Namespaces of other planners, where they are not as they were loaded.

    Raises:
        InputError: One line for every change that is refused; then no change is made.
    """
    parameters = reconfigurable(configuration).get(namespace)
    if parameters is None:
        names = ", ".join(repr(name) for name in reconfigurable(configuration))
        raise InputError([f"{namespace}: not reconfigurable; expected one of {names}"])
    checked = _checked(parameters, namespace, changes)
    if checked.get(_RESTORE):
        start = below(configuration.tree_at_start, namespace)
        checked = {parameter.name: start[parameter.name] for parameter in parameters}
    tree = copy.deepcopy(dict(configuration.tree))
    below(tree, namespace).update(checked)
    planners = [key for key in SLOTS if tree[key] != configuration.tree[key]]
    if planners:
        tree.update(copy.deepcopy(dict(stored or {})))
        configuration = _with_planners(configuration, tree, planners)
    changed = _remade(replace(configuration, tree=tree), namespace)
    problems = [f"{name}: {problem}" for name, problem in workload_problems(changed)]
    if problems:
        raise InputError(problems)
    return changed


def _with_planners(
    configuration: Configuration, tree: Dict[str, Any], keys: Sequence[str]
) -> Configuration:
    """Complete a tree in which ``keys`` name other planners; return what follows from them."""
    notes = Notes("")
    change_planners(tree, keys, notes)
    notes.raise_problems()
    names = [plugin_name(tree[key]) for key in keys]
    start = {**configuration.tree_at_start, **{name: tree[name] for name in names if name in tree}}
    configuration = replace(configuration, tree_at_start=start)
    if "base_local_planner" not in keys:
        return configuration
    return replace(
        configuration,
        local_planner_period_s=local_planner_period_s(tree),
        recoveries=with_local_planner(configuration.recoveries, tree),
    )


def _checked(
    parameters: Tuple[Parameter, ...], namespace: str, changes: Mapping[str, Any]
) -> Dict[str, Any]:
    known = {parameter.name: parameter for parameter in parameters}
    checked: Dict[str, Any] = {}
    problems: List[str] = []
    for name, value in changes.items():
        if name == _GROUPS:
            continue
        place = join(namespace, name)
        if name not in known:
            problems.append(f"{place}: unknown parameter; expected one of {', '.join(known)}")
        else:
            try:
                checked[name] = _clamped(known[name], value)
            except InvalidValue as problem:
                problems.append(f"{place}: {problem}")
    if problems:
        raise InputError(problems)
    return checked


def _clamped(parameter: Parameter, value: Any) -> Any:
    """Clamp, then check: -1 m/s becomes 0 m/s, but 0 Hz is refused where it makes no sense."""
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        value = parameter.clamp(value)
    return parameter.check(value)


def _remade(configuration: Configuration, namespace: str) -> Configuration:
    """Make the parts that may change in flight anew from the tree; recoveries may not."""
    tree, before = configuration.tree, configuration.navigator
    parts = changing_parts(tree, before.recovery_behaviors, given=tree)
    if namespace:  # move_base itself is not reconfigured
        patience_s = before.controller_patience_s
        parts["navigator"] = replace(parts["navigator"], controller_patience_s=patience_s)
    return replace(configuration, **parts)
