"""Choice of the planners, and their namespaces.

To add a planner, add a line to ``GLOBAL_PLANNERS`` or ``LOCAL_PLANNERS``, and one to
``quad_nav.scenario.assembly``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Callable, Dict, List, Mapping, Optional, Tuple

from quad_nav.config.fixes import with_fixes
from quad_nav.config.local_planners import (
    DWA_TABLE,
    LATCH,
    TRAJECTORY_PLANNER,
    TRAJECTORY_PLANNER_TABLE,
    dwa_params,
    normalise_dwa,
    normalise_trajectory_planner,
    trajectory_planner_params,
)
from quad_nav.config.notes import RENAMED, UNSUPPORTED, UNUSED, Notes
from quad_nav.config.plugins import (
    GLOBAL_PLANNER,
    LOCAL_PLANNER,
    Interface,
    Parameters,
    Plugin,
    is_dotted,
    load_class,
    plugin_name,
)
from quad_nav.config.reader import Namespace, Table, check_class, made, normalise, subtree
from quad_nav.navigator.params import DEFAULT_GLOBAL_PLANNER, DEFAULT_LOCAL_PLANNER
from quad_nav.plan.carrot import CarrotParams
from quad_nav.plan.global_planner import SearchPlannerParams
from quad_nav.plan.navfn import NavfnParams
from quad_nav.recovery import TurnLimits

_UNUSED = "read and never used"
NAVFN_TABLE = Table((NavfnParams,))
GLOBAL_PLANNER_TABLE = Table(
    (SearchPlannerParams,),
    ignored={
        "default_tolerance": _UNUSED,
        "planner_window_x": _UNUSED,
        "planner_window_y": _UNUSED,
        "visualize_potential": "the name is publish_potential",
    },
)
CARROT_TABLE = Table(
    (CarrotParams,), ignored={"step_size": _UNUSED, "min_dist_from_robot": _UNUSED}
)
SEARCH_PLANNER = "global_planner/GlobalPlanner"
CARROT = "carrot_planner/CarrotPlanner"
DWA_PLANNER = "dwa_local_planner/DWAPlannerROS"


@dataclass(frozen=True)
class PlannerType:
    """Planner that can be chosen.

    Attributes:
        table: Parameters in the planner's namespace.
        normalise: Normalises that namespace as move_base does.
        params: Makes the planner's dataclass from a normalised tree.
        inherited: Parameters that may be at the node's level too.
    """

    table: Table
    normalise: Callable[[Namespace, Notes], None]
    params: Callable[[Mapping[str, Any]], Any]
    inherited: Tuple[str, ...] = ()


def _plain(plugin: str, table: Table) -> PlannerType:
    """Make the type of a planner whose namespace holds the table's parameters only."""
    name = plugin_name(plugin)
    return PlannerType(
        table,
        normalise=lambda tree, notes: normalise(subtree(tree, name, "", notes), name, table, notes),
        params=lambda tree: made(table.owners[0], tree.get(name, {})),
    )


GLOBAL_PLANNERS: Dict[str, PlannerType] = {
    DEFAULT_GLOBAL_PLANNER: _plain(DEFAULT_GLOBAL_PLANNER, NAVFN_TABLE),
    SEARCH_PLANNER: _plain(SEARCH_PLANNER, GLOBAL_PLANNER_TABLE),
    CARROT: _plain(CARROT, CARROT_TABLE),
}
LOCAL_PLANNERS: Dict[str, PlannerType] = {
    DEFAULT_LOCAL_PLANNER: PlannerType(
        TRAJECTORY_PLANNER_TABLE, normalise_trajectory_planner, trajectory_planner_params
    ),
    DWA_PLANNER: PlannerType(DWA_TABLE, normalise_dwa, dwa_params, inherited=(LATCH.name,)),
}


@dataclass(frozen=True)
class Slot:
    """Parameter that names a planner: the supported types, and the interface of plugins."""

    types: Mapping[str, PlannerType]
    interface: Interface


SLOTS: Dict[str, Slot] = {
    "base_local_planner": Slot(LOCAL_PLANNERS, LOCAL_PLANNER),
    "base_global_planner": Slot(GLOBAL_PLANNERS, GLOBAL_PLANNER),
}
# Other planners that configurations often have a namespace for.
_OTHER_PLANNERS = ("TebLocalPlannerROS", "EBandPlannerROS", "DWBLocalPlanner", "SBPLLatticePlanner")
_DEFAULT_RATE_HZ = 20.0


def planner_keys(tree: Mapping[str, Any]) -> List[str]:
    """List the keys of planners at the node's level: namespaces and inherited parameters."""
    keys = list(_OTHER_PLANNERS)
    for key, slot in SLOTS.items():
        keys += map(plugin_name, slot.types)
        name = tree.get(key)
        if isinstance(name, str):
            keys.append(plugin_name(name))
            keys += slot.types[name].inherited if name in slot.types else ()
    return keys


def normalise_planner_names(tree: Namespace, notes: Notes) -> None:
    """Complete old names of planners, and report planners that are not supported."""
    for key, slot in SLOTS.items():
        name = tree.get(key)
        if not isinstance(name, str) or name in slot.types:
            continue
        if is_dotted(name):
            check_class(name, slot.interface, key, notes)
            continue
        tree[key] = next((known for known in slot.types if plugin_name(known) == name), None)
        if tree[key] is not None:
            notes.remark(key, RENAMED, f"{name} is an old name of {tree[key]}")
        else:
            tree[key] = _substitute(tree, slot)
            expected = f"--set {key}={tree[key]} or {_others(tree, key)}"
            notes.problem(key, f"{name} is not supported; expected {expected}")


def _substitute(tree: Namespace, slot: Slot) -> str:
    """Return a supported planner, one that has parameters if there is any."""
    known = list(slot.types)
    preferred = [known[0] if slot is SLOTS["base_global_planner"] else DWA_PLANNER, *known]
    return next((one for one in preferred if tree.get(plugin_name(one))), preferred[0])


def _others(tree: Namespace, key: str) -> str:
    return " or ".join(one for one in SLOTS[key].types if one != tree[key])


def normalise_planners(tree: Namespace, notes: Notes) -> None:
    """Normalise the namespaces of the chosen planners as move_base does."""
    chosen = {plugin_name(tree[key]): key for key in SLOTS if isinstance(tree[key], str)}
    for name, key in chosen.items():
        own = planner_type(tree, key)
        if own is not None:
            own.normalise(tree, notes)
        else:  # plugins check their parameters themselves
            subtree(tree, name, "", notes)
    flyable = {plugin_name(name): key for key, slot in SLOTS.items() for name in slot.types}
    for name in [name for name in tree if name not in chosen]:
        if name in flyable:
            key = flyable[name]
            planner = next(one for one in SLOTS[key].types if plugin_name(one) == name)
            reason = f"unused: {key} is {tree[key]}; expected {key}={planner} to fly with it"
            _normalise_unused(tree, name, reason, notes)
        elif name in _OTHER_PLANNERS:
            notes.remark(name, UNSUPPORTED, "planner not supported; its parameters are not read")


def planner_type(tree: Mapping[str, Any], key: str) -> Optional[PlannerType]:
    """Return the type of the planner that a normalised tree names, None for a plugin."""
    return SLOTS[key].types.get(tree[key])


def planner_params(tree: Mapping[str, Any], key: str) -> Any:
    """Make the dataclass of the planner that a normalised tree names, or a ``Plugin``."""
    own = planner_type(tree, key)
    if own is not None:
        return with_fixes(own.params(tree), tree)
    name = plugin_name(tree[key])
    interface = SLOTS[key].interface
    parameters = Parameters(tree.get(name, {}), name)
    return Plugin(load_class(tree[key], interface), parameters, interface.methods_of)


def local_planner_frequency(tree: Mapping[str, Any]) -> Any:
    """Return the local planner's own ``controller_frequency``, None if it has none."""
    key = "base_local_planner"
    if planner_type(tree, key) is None:
        return None
    return tree[plugin_name(tree[key])].get("controller_frequency")


def local_planner_period_s(tree: Mapping[str, Any]) -> float:
    """Return the control period that rollouts assume.

    As in move_base ``controller_frequency`` is looked up from the local planner's namespace
    upwards. If it is missing or not positive, the rate is 20 Hz.
    """
    own = local_planner_frequency(tree)
    rate_hz = tree["controller_frequency"] if own is None else own
    return 1.0 / rate_hz if rate_hz > 0.0 else 1.0 / _DEFAULT_RATE_HZ


def _normalise_unused(tree: Namespace, name: str, reason: str, notes: Notes) -> None:
    if name == TRAJECTORY_PLANNER:
        planner = subtree(tree, name, "", notes)
        normalise(planner, name, Table((TurnLimits,)), notes, also_known=planner)
        reason += "; rotate_recovery still reads its limits"
    notes.remark(name, UNUSED, reason)
