"""The trees of the planners: which ones fly, their namespaces, and their old names.

A planner of another kind is one line in ``GLOBAL_PLANNERS`` or
``LOCAL_PLANNERS``, and one in ``assembly``.
"""
from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Callable, Dict, List, Mapping, Optional

from quad_nav.config import global_planner_tables, tables
from quad_nav.config.notes import CAUTION, IGNORED, RENAMED, UNSUPPORTED, UNUSED, Notes, join
from quad_nav.config.reader import Namespace, check_class, fields, settle, subtree
from quad_nav.config.spec import Table
from quad_nav.control.trajectory_planner_params import TrajectoryPlannerParams
from quad_nav.plan.carrot import CarrotParams
from quad_nav.plan.global_planner import SearchPlannerParams
from quad_nav.plan.navfn import NavfnParams
from quad_nav.plugins import (
    GLOBAL_PLANNER,
    LOCAL_PLANNER,
    Interface,
    Parameters,
    Plugin,
    is_dotted,
    load_class,
    plugin_name,
)

TRAJECTORY_PLANNER = "TrajectoryPlannerROS"


@dataclass(frozen=True)
class PlannerType:
    """One planner: its table, its dataclass, old names of parameters, and what is odd about it."""

    table: Table
    params: Callable[..., Any]
    renamed: Mapping[str, str] = field(default_factory=dict)
    remark: Optional[Callable[[Namespace, Notes], None]] = None


def _trajectory_planner_params(**arguments: Any) -> TrajectoryPlannerParams:
    arguments["meter_scoring"] = True  # whatever is set, as in the original
    return TrajectoryPlannerParams(**arguments)


def _remark_on_trajectory_planner(planner: Namespace, notes: Notes) -> None:
    if planner.get("meter_scoring") is False:
        notes.remark(join(TRAJECTORY_PLANNER, "meter_scoring"), IGNORED,
                     "ignored by move_base: distances are always scored in metres")
    if isinstance(planner.get("escape_vel"), float) and planner["escape_vel"] > 0.0:
        notes.remark(join(TRAJECTORY_PLANNER, "escape_vel"), CAUTION,
                     "the robot escapes forwards: a velocity below 0 backs up")


# The first of each flies in the place of planners that are not here.
GLOBAL_PLANNERS: Dict[str, PlannerType] = {
    tables.GLOBAL_PLANNER: PlannerType(tables.NAVFN, NavfnParams),
    "global_planner/GlobalPlanner": PlannerType(
        global_planner_tables.SEARCH_PLANNER, SearchPlannerParams),
    "carrot_planner/CarrotPlanner": PlannerType(global_planner_tables.CARROT, CarrotParams),
}
LOCAL_PLANNERS: Dict[str, PlannerType] = {
    tables.LOCAL_PLANNER: PlannerType(
        tables.TRAJECTORY_PLANNER, _trajectory_planner_params,
        renamed={"pdist_scale": "path_distance_bias",
                 "gdist_scale": "goal_distance_bias",
                 "min_in_place_rotational_vel": "min_in_place_vel_theta"},
        remark=_remark_on_trajectory_planner),
}


@dataclass(frozen=True)
class Slot:
    """A parameter that names a planner: which ones there are, and what a user's has to be."""

    types: Mapping[str, PlannerType]
    interface: Interface


SLOTS: Dict[str, Slot] = {
    "base_local_planner": Slot(LOCAL_PLANNERS, LOCAL_PLANNER),
    "base_global_planner": Slot(GLOBAL_PLANNERS, GLOBAL_PLANNER),
}
# Namespaces of planners that people configure beside the one that they fly.
_OTHER_PLANNERS = ("DWAPlannerROS", "TebLocalPlannerROS", "EBandPlannerROS", "DWBLocalPlanner",
                   "SBPLLatticePlanner")
_DEFAULT_RATE_HZ = 20.0


def planner_namespaces(tree: Mapping[str, Any]) -> List[str]:
    """Every namespace that is a planner's, chosen or not."""
    flyable = [plugin_name(name) for slot in SLOTS.values() for name in slot.types]
    chosen = [plugin_name(tree[key]) for key in SLOTS if isinstance(tree.get(key), str)]
    return [*flyable, *chosen, *_OTHER_PLANNERS]


def settle_planner_names(tree: Namespace, notes: Notes) -> None:
    """Replaces planners that do not fly here by those that do, and says so."""
    for key, slot in SLOTS.items():
        name = tree.get(key)
        if not isinstance(name, str) or name in slot.types:
            continue
        if is_dotted(name):
            check_class(name, slot.interface, key, notes)
            continue
        tree[key] = next((known for known in slot.types if plugin_name(known) == name), None)
        if tree[key] is not None:
            notes.remark(key, RENAMED, f"{name} is called {tree[key]} today")
        else:
            tree[key] = next(iter(slot.types))
            notes.remark(key, UNSUPPORTED,
                         f"{name} is not supported here; {tree[key]} flies instead")


def settle_planners(tree: Namespace, notes: Notes) -> None:
    """Brings the chosen planners' namespaces into the state in which the original leaves them."""
    chosen = {plugin_name(tree[key]): key for key in SLOTS if isinstance(tree[key], str)}
    for name, key in chosen.items():
        planner = subtree(tree, name, "", notes)
        planner_type = SLOTS[key].types.get(tree[key])
        if planner_type is not None:  # a user's planner knows its parameters itself
            _settle_planner(planner, name, planner_type, notes)
    flyable = {plugin_name(name): key for key, slot in SLOTS.items() for name in slot.types}
    for name in sorted(set(tree).difference(chosen)):
        if name in flyable:
            key = flyable[name]
            _settle_unused(tree, name, f"unused: {key} is {tree[key]}", notes)
        elif name in _OTHER_PLANNERS:
            notes.remark(name, UNSUPPORTED, "no such planner flies here, nothing below is read")


def planner_type(tree: Mapping[str, Any], key: str) -> Any:
    """The type of the planner that a settled tree names, None for a user's."""
    return SLOTS[key].types.get(tree[key])


def planner_params(tree: Mapping[str, Any], key: str) -> Any:
    """The dataclass of the planner that a settled tree names, or the user's ``Plugin``."""
    own = planner_type(tree, key)
    name = plugin_name(tree[key])
    namespace = tree.get(name, {})
    if own is None:
        return Plugin(load_class(tree[key], SLOTS[key].interface), Parameters(namespace, name))
    return own.params(**fields(namespace, own.table.parameters))


def reconfigurable_planners(tree: Mapping[str, Any]) -> Dict[str, Table]:
    """Namespace -> table of the chosen planners that can be reconfigured, the local one first."""
    found = {}
    for key in SLOTS:
        own = planner_type(tree, key)
        if own is not None and own.table.reconfigurable:
            found[plugin_name(tree[key])] = own.table
    return found


def local_planner_frequency(tree: Mapping[str, Any]) -> Any:
    """The local planner's own ``controller_frequency``, None where there is none."""
    key = "base_local_planner"
    if planner_type(tree, key) is None:
        return None
    return tree[plugin_name(tree[key])].get("controller_frequency")


def local_planner_period_s(tree: Mapping[str, Any]) -> float:
    """The period that rollouts reckon with.

    The original looks for ``controller_frequency`` from the local planner
    upwards, and assumes 20 Hz when it is missing or not positive.
    """
    own = local_planner_frequency(tree)
    rate_hz = tree["controller_frequency"] if own is None else own
    return 1.0 / rate_hz if rate_hz > 0.0 else 1.0 / _DEFAULT_RATE_HZ


def _settle_planner(planner: Namespace, name: str, own: PlannerType, notes: Notes) -> None:
    for old, new in own.renamed.items():
        if old in planner:
            _take_old_name(planner, name, old, new, notes)
    settle(planner, name, own.table, notes, also_known=own.renamed)
    if own.remark is not None:
        own.remark(planner, notes)


def _settle_unused(tree: Namespace, name: str, reason: str, notes: Notes) -> None:
    if name == TRAJECTORY_PLANNER:
        planner = subtree(tree, name, "", notes)
        settle(planner, name, Table(fixed=tables.ROTATE_FROM_PLANNER), notes, also_known=planner)
        reason += "; recoveries that turn take its limits all the same"
    notes.remark(name, UNUSED, reason)


def _take_old_name(planner: Namespace, name: str, old: str, new: str, notes: Notes) -> None:
    place = join(name, old)
    if new in planner:
        notes.remark(place, IGNORED, f"ignored by move_base: {new} is there as well")
        return
    planner[new] = planner[old]
    notes.moved(join(name, new), place)
    notes.remark(place, RENAMED, f"called {new} today")
