"""Change a configuration in flight, as dynamic_reconfigure does."""

from __future__ import annotations

import copy
from dataclasses import replace
from typing import Any, Dict, List, Mapping, Tuple

from quad_nav.config.configuration import (
    COSTMAPS,
    Configuration,
    navigator_params,
    workload_problems,
)
from quad_nav.config.costmaps import costmap_params
from quad_nav.config.fixes import FIXES, FIXES_TABLE, with_fixes
from quad_nav.config.layers import layer_tables
from quad_nav.config.notes import join
from quad_nav.config.planners import SLOTS, planner_params, reconfigurable_planners
from quad_nav.config.spec import InvalidValue, Parameter
from quad_nav.config.tables.costmap import COSTMAP_TABLE
from quad_nav.config.tables.move_base import MOVE_BASE_TABLE
from quad_nav.errors import InputError

_GROUPS = "groups"  # dynamic_reconfigure's own bookkeeping among the values
_RESTORE = "restore_defaults"


def reconfigurable(configuration: Configuration) -> Dict[str, Tuple[Parameter, ...]]:
    """Return namespace -> reconfigurable parameters, in the order of upstream move_base.

    Namespaces are relative to the node; "" is move_base itself.
    """
    namespaces = {"": MOVE_BASE_TABLE, **reconfigurable_planners(configuration.tree)}
    for costmap in COSTMAPS:
        namespaces[costmap] = COSTMAP_TABLE
        for layer, table in layer_tables(configuration.tree[costmap]["plugins"]).items():
            namespaces[join(costmap, layer)] = table
    namespaces[FIXES] = FIXES_TABLE
    return {name: table.reconfigurable for name, table in namespaces.items()}


def values(configuration: Configuration, namespace: str) -> Dict[str, Any]:
    """Return the ROS values in force of a namespace's reconfigurable parameters."""
    normalised = _below(configuration.tree, namespace)
    return {
        parameter.name: normalised[parameter.name]
        for parameter in reconfigurable(configuration)[namespace]
    }


def updated(
    configuration: Configuration, namespace: str, changes: Mapping[str, Any]
) -> Configuration:
    """Return the configuration with some parameters of one namespace changed.

    Values are clamped to their ranges. ``restore_defaults`` restores the namespace as it was
    loaded. As in move_base, recoveries keep the parameters that they were loaded with.

    Args:
        configuration: The configuration in force.
        namespace: A namespace of ``reconfigurable``.
        changes: Name -> new value.

    Raises:
        InputError: One line for every change that is refused; then no change is made.
    """
    parameters = reconfigurable(configuration).get(namespace)
    if parameters is None:
        names = ", ".join(repr(name) for name in reconfigurable(configuration))
        raise InputError([f"{namespace}: not reconfigurable; expected one of {names}"])
    checked = _checked(parameters, namespace, changes, configuration.tree)
    if checked.get(_RESTORE):
        start = _below(configuration.tree_at_start, namespace)
        checked = {parameter.name: start[parameter.name] for parameter in parameters}
    tree = copy.deepcopy(dict(configuration.tree))
    _below(tree, namespace).update(checked)
    changed = _remade(replace(configuration, tree=tree), namespace)
    problems = [f"{name}: {problem}" for name, problem in workload_problems(changed)]
    if problems:
        raise InputError(problems)
    return changed


def _checked(
    parameters: Tuple[Parameter, ...],
    namespace: str,
    changes: Mapping[str, Any],
    tree: Mapping[str, Any],
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
        elif name in SLOTS and value != tree[name]:
            problems.append(
                f"{place}: planners cannot change in flight, got {value!r}; expected {tree[name]}"
            )
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
    """The dataclass of that namespace from the tree; the others stay as they are."""
    tree = configuration.tree
    if namespace == "":
        listed = configuration.navigator.recovery_behaviors
        return replace(configuration, navigator=navigator_params(tree, listed, given=tree))
    if namespace == FIXES:
        return _with_other_fixes(configuration)
    if namespace in reconfigurable_planners(tree):
        return replace(
            configuration,
            global_planner=planner_params(tree, "base_global_planner"),
            local_planner=planner_params(tree, "base_local_planner"),
        )
    costmap = namespace.split("/")[0]
    params = costmap_params(tree, costmap)
    if costmap == "global_costmap":
        return replace(configuration, global_costmap=params)
    return replace(configuration, local_costmap=params)


def _with_other_fixes(configuration: Configuration) -> Configuration:
    """Set the switches anew in every part that may change in flight: recoveries may not."""
    tree, navigator = configuration.tree, configuration.navigator
    return replace(
        configuration,
        navigator=replace(
            with_fixes(navigator, tree),
            progress=with_fixes(navigator.progress, tree),
        ),
        peers=with_fixes(configuration.peers, tree),
        scan_validator=with_fixes(configuration.scan_validator, tree),
        local_planner=with_fixes(configuration.local_planner, tree),
        global_costmap=costmap_params(tree, "global_costmap"),
        local_costmap=costmap_params(tree, "local_costmap"),
    )


def _below(tree: Mapping[str, Any], namespace: str) -> Any:
    for name in filter(None, namespace.split("/")):
        tree = tree[name]
    return tree
