"""Choice of the planners, and their namespaces.

To add a planner, add a line to ``GLOBAL_PLANNERS`` or ``LOCAL_PLANNERS``, and one to
``quad_nav.scenario.assembly``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Dict, Iterable, List, Mapping, Optional, Tuple

from quad_nav.config.fixes import with_fixes
from quad_nav.config.notes import CAUTION, IGNORED, RENAMED, UNSUPPORTED, UNUSED, Notes, join
from quad_nav.config.other_planners import dwa_limits, lost_names
from quad_nav.config.plugins import (
    GLOBAL_PLANNER,
    LOCAL_PLANNER,
    Interface,
    is_dotted,
    plugin_name,
    plugin_of,
)
from quad_nav.config.reader import (
    Namespace,
    Table,
    check_class,
    made,
    normalise,
    normalise_value,
    subtree,
)
from quad_nav.control.dwa_planner_params import DwaParams
from quad_nav.control.trajectory_planner_params import TrajectoryPlannerParams
from quad_nav.navigator.params import DEFAULT_GLOBAL_PLANNER, DEFAULT_LOCAL_PLANNER
from quad_nav.plan.carrot import CarrotParams
from quad_nav.plan.global_planner import SearchPlannerParams
from quad_nav.plan.navfn import NavfnParams
from quad_nav.recovery import TurnLimits

TRAJECTORY_PLANNER = "TrajectoryPlannerROS"
SEARCH_PLANNER = "global_planner/GlobalPlanner"
CARROT = "carrot_planner/CarrotPlanner"
DWA_PLANNER = "dwa_local_planner/DWAPlannerROS"
_UNUSED = "read and never used"
_ONE_MODEL = "the costmap is the only world model"


def _look_at_trajectory_planner(planner: Namespace, path: str, notes: Notes) -> None:
    if isinstance(planner.get("y_vels"), list):
        text = "ignored by move_base: it is a list; expected a string, as in '-0.3, 0.3'"
        notes.remark(join(path, "y_vels"), IGNORED, text)
        del planner["y_vels"]
    if planner.get("meter_scoring") is False and planner.get("respect_meter_scoring") is not True:
        text = "ignored by move_base: distances are always scored in metres"
        notes.remark(join(path, "meter_scoring"), IGNORED, text)
    if isinstance(planner.get("escape_vel"), (int, float)) and planner["escape_vel"] > 0:
        text = "the robot escapes forwards; expected a negative velocity, to back up"
        notes.remark(join(path, "escape_vel"), CAUTION, text)


def _look_at_dwa(planner: Namespace, path: str, notes: Notes) -> None:
    if planner.get("occdist_scale") == 0:
        text = "0 disables the scoring of obstacles: the robot may hit them"
        notes.remark(join(path, "occdist_scale"), CAUTION, text)


GLOBAL_PLANNERS: Dict[str, Table] = {
    DEFAULT_GLOBAL_PLANNER: Table((NavfnParams,)),
    SEARCH_PLANNER: Table(
        (SearchPlannerParams,),
        ignored={
            "default_tolerance": _UNUSED,
            "planner_window_x": _UNUSED,
            "planner_window_y": _UNUSED,
            "visualize_potential": "the name is publish_potential",
        },
    ),
    CARROT: Table((CarrotParams,), ignored={"step_size": _UNUSED, "min_dist_from_robot": _UNUSED}),
}
LOCAL_PLANNERS: Dict[str, Table] = {
    DEFAULT_LOCAL_PLANNER: Table(
        (TrajectoryPlannerParams,),
        restores=True,
        unsupported={"world_model": _ONE_MODEL, "point_grid": _ONE_MODEL},
        ignored={
            "stop_time_buffer": _UNUSED,
            "backup_vel": "escape_vel overrides it",
            "acc_limit_x": "renamed to acc_lim_x",
            "acc_limit_y": "renamed to acc_lim_y",
            "acc_limit_th": "renamed to acc_lim_theta",
            "acc_lim_th": "renamed to acc_lim_theta",
        },
        renamed={
            "pdist_scale": "path_distance_bias",
            "gdist_scale": "goal_distance_bias",
            "min_in_place_rotational_vel": "min_in_place_vel_theta",
        },
        look=_look_at_trajectory_planner,
    ),
    DWA_PLANNER: Table(
        (DwaParams,),
        restores=True,
        # The planner warns about names from before ROS Melodic and does not read them.
        ignored={
            "max_trans_vel": "renamed to max_vel_trans",
            "min_trans_vel": "renamed to min_vel_trans",
            "max_rot_vel": "renamed to max_vel_theta",
            "min_rot_vel": "renamed to min_vel_theta",
            "rot_stopped_vel": "renamed to theta_stopped_vel",
            "trans_stopped_velocity": "renamed to trans_stopped_vel",
            "rot_stopped_velocity": "renamed to theta_stopped_vel",
            "acc_lim_th": "renamed to acc_lim_theta",
            "acc_limit_x": "renamed to acc_lim_x",
            "acc_limit_y": "renamed to acc_lim_y",
            "acc_limit_th": "renamed to acc_lim_theta",
            "acc_limit_trans": "renamed to acc_lim_trans",
            "pdist_scale": "renamed to path_distance_bias",
            "gdist_scale": "renamed to goal_distance_bias",
            "vtheta_samples": "renamed to vth_samples",
            "dwa": "renamed to use_dwa",
            "penalize_negative_x": "upstream has removed this critic",
        },
        # Read from the planner's namespace or from the node's level, as upstream does.
        inherited=("latch_xy_goal_tolerance",),
        look=_look_at_dwa,
    ),
}


@dataclass(frozen=True)
class Slot:
    """Parameter that names a planner: the supported types, and the interface of plugins."""

    types: Mapping[str, Table]
    interface: Interface


SLOTS: Dict[str, Slot] = {
    "base_local_planner": Slot(LOCAL_PLANNERS, LOCAL_PLANNER),
    "base_global_planner": Slot(GLOBAL_PLANNERS, GLOBAL_PLANNER),
}
# Other planners that configurations often have a namespace for.
_OTHER_PLANNERS = ("TebLocalPlannerROS", "EBandPlannerROS", "DWBLocalPlanner", "SBPLLatticePlanner")
_DEFAULT_RATE_HZ = 20.0
_NAMED = 4  # parameters in a line about many


def planner_names(namespace: str, parameter: str) -> Tuple[str, ...]:
    """Return the planners that a parameter may name; () if it does not name one."""
    return tuple(SLOTS[parameter].types) if not namespace and parameter in SLOTS else ()


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
    """Complete old names of planners, and let others fly for planners that are not here."""
    for key, slot in SLOTS.items():
        name = tree.get(key)
        if not isinstance(name, str) or name in slot.types:
            continue
        if is_dotted(name):
            check_class(name, slot.interface, key, notes)
            continue
        known = next((known for known in slot.types if plugin_name(known) == name), None)
        if known is not None:
            notes.remark(key, RENAMED, f"{name} is an old name of {known}")
        else:
            known = _substitute(tree, slot)
            limits = _move_limits(tree, name, known)
            others = " or ".join(one for one in slot.types if one != known)
            text = f"{name} is not here: {known} flies{limits}; expected it, or {others}"
            notes.remark(key, CAUTION, text)
        tree[key] = known


def change_planners(tree: Namespace, keys: Iterable[str], notes: Notes) -> None:
    """Complete a normalised tree with other planners than before: those that ``keys`` name."""
    for key in keys:
        name, slot = tree[key], SLOTS[key]
        if is_dotted(name):
            check_class(name, slot.interface, key, notes)
        elif name not in slot.types:
            notes.problem(key, f"{name} is not supported; expected {' or '.join(slot.types)}")
    if not notes.faults:
        normalise_planners(tree, notes)


def _substitute(tree: Namespace, slot: Slot) -> str:
    """Return a planner that is here, one that has parameters if there is any."""
    known = list(slot.types)
    preferred = [known[0] if slot is SLOTS["base_global_planner"] else DWA_PLANNER, *known]
    return next((one for one in preferred if tree.get(plugin_name(one))), preferred[0])


def _move_limits(tree: Namespace, name: str, known: str) -> str:
    """Give DWAPlannerROS the limits of another local planner; return what is kept and lost."""
    given = tree.pop(plugin_name(name), None)
    if not isinstance(given, dict) or not given:
        return ""
    kept: Dict[str, Any] = {}
    if known == DWA_PLANNER and not tree.get(plugin_name(known)):
        tree[plugin_name(known)] = kept = dwa_limits(given)
    lost = lost_names(given) if kept else list(given)
    text = f" with its {', '.join(one for one in kept if one in given)}" if kept else ""
    more = f" and {len(lost) - _NAMED} more" if len(lost) > _NAMED else ""
    return f"{text}, without {', '.join(lost[:_NAMED])}{more}" if lost else text


def normalise_planners(tree: Namespace, notes: Notes) -> None:
    """Normalise the namespaces of the chosen planners as move_base does."""
    chosen = {plugin_name(tree[key]): key for key in SLOTS if isinstance(tree[key], str)}
    for name, key in chosen.items():
        namespace = subtree(tree, name, "", notes)
        table = planner_table(tree, key)
        if table is not None:  # plugins check their parameters themselves
            normalise(namespace, name, table, notes)
            for inherited in table.inherited:
                normalise_value(tree, "", table[inherited], notes)
    flyable = {plugin_name(name): (key, name) for key, slot in SLOTS.items() for name in slot.types}
    for name in [name for name in tree if name not in chosen]:
        if name in flyable:
            key, planner = flyable[name]
            reason = f"unused: {key} is {tree[key]}; expected {key}={planner} to fly with it"
            _normalise_unused(tree, name, reason, notes)
        elif name in _OTHER_PLANNERS:
            notes.remark(name, UNSUPPORTED, "planner not supported; its parameters are not read")


def planner_table(tree: Mapping[str, Any], key: str) -> Optional[Table]:
    """Return the parameters of the planner that a normalised tree names, None for a plugin."""
    return SLOTS[key].types.get(tree[key])


def planner_params(tree: Mapping[str, Any], key: str) -> Any:
    """Make the dataclass of the planner that a normalised tree names, or a ``Plugin``."""
    name, table = plugin_name(tree[key]), planner_table(tree, key)
    namespace = tree.get(name, {})
    if table is None:
        return plugin_of(tree[key], SLOTS[key].interface, namespace, name)
    inherited = {one: tree[one] for one in table.inherited if one in tree}
    return with_fixes(made(table.owners[0], {**inherited, **namespace}), tree)


def local_planner_frequency(tree: Mapping[str, Any]) -> Any:
    """Return the local planner's own ``controller_frequency``, None if it has none."""
    key = "base_local_planner"
    if planner_table(tree, key) is None:
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
