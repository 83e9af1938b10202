"""Recovery behaviours: move_base's default sequence, or a listed one.

Upstream's ``move_slow_and_clear/MoveSlowAndClear`` changes two parameters of a planner that the
configuration names. Here it limits all speeds of the chosen local planner, those of flying
backwards included.
"""

from __future__ import annotations

from typing import Any, Dict, List, Mapping, Optional, Tuple, Union

from quad_nav.config.fixes import with_fixes
from quad_nav.config.notes import CAUTION, IGNORED, UNSUPPORTED, Notes, join
from quad_nav.config.planners import LOCAL_PLANNERS, TRAJECTORY_PLANNER
from quad_nav.config.plugins import RECOVERY, Plugin, is_dotted, plugin_name, plugin_of
from quad_nav.config.reader import (
    Namespace,
    Table,
    check_class,
    made,
    named_types,
    normalise,
    subtree,
)
from quad_nav.costmap.layered import CostmapParams
from quad_nav.files.values import nearest
from quad_nav.recovery import (
    ClearCostmapParams,
    MoveSlowAndClearParams,
    RotateParams,
    TurnLimits,
)

RecoveryParams = Union[ClearCostmapParams, RotateParams, MoveSlowAndClearParams, Plugin]
NamedTypes = Tuple[Tuple[str, str], ...]

CLEAR = "clear_costmap_recovery/ClearCostmapRecovery"
ROTATE = "rotate_recovery/RotateRecovery"
MOVE_SLOW = "move_slow_and_clear/MoveSlowAndClear"
TABLES: Dict[str, Table] = {
    CLEAR: Table((ClearCostmapParams,)),
    ROTATE: Table((RotateParams,)),
    MOVE_SLOW: Table((MoveSlowAndClearParams,)),
}
_CONSERVATIVE, _AGGRESSIVE, _ROTATE = "conservative_reset", "aggressive_reset", "rotate_recovery"
_AFFECTED_MAPS = ("local", "global", "both")
# Speeds that tell when the robot has stopped, or when its footprint grows: they limit nothing.
_NO_LIMIT = ("_stopped_", "scaling_speed")
_SLOWED_UPSTREAM = "DWAPlannerROS"
# Parameters that name one more speed, and their upstream defaults.
_SPEED_NAMES = {"max_trans_param_name": "max_trans_vel", "max_rot_param_name": "max_rot_vel"}


def normalise_recoveries(tree: Namespace, notes: Notes) -> Optional[NamedTypes]:
    """Normalise the recoveries' namespaces as move_base does.

    Returns:
        (name, type) of each behaviour in ``recovery_behaviors``, None without that list.
    """
    listed = _listed(tree, notes)
    if listed is None:
        _normalise_default_distances(tree, notes)
    for name, kind in dict(listed or _default_sequence(tree)).items():
        # Behaviours of the default sequence need no namespace.
        if name not in tree and listed is None:
            continue
        namespace = subtree(tree, name, "", notes)
        if kind not in TABLES:
            continue  # plugins check their parameters themselves
        layers = ("layer_names",) if kind == CLEAR else ()
        normalise(namespace, name, TABLES[kind], notes, also_known=layers)
        if kind == CLEAR:
            _normalise_clearing(namespace, name, notes)
        elif kind == MOVE_SLOW:
            _look_at_slow(namespace, name, tree["base_local_planner"], notes)
    return listed


def recoveries(
    tree: Mapping[str, Any], listed: Optional[NamedTypes]
) -> Tuple[Tuple[str, RecoveryParams], ...]:
    """Return (name, parameters) of a normalised tree's recoveries, in the order of trial."""
    sequence = _default_sequence(tree) if listed is None else listed
    return tuple((name, with_fixes(_params(name, kind, tree), tree)) for name, kind in sequence)


def with_local_planner(
    named: Tuple[Tuple[str, RecoveryParams], ...], tree: Mapping[str, Any]
) -> Tuple[Tuple[str, RecoveryParams], ...]:
    """Return (name, parameters) of recoveries that slow down the local planner of a tree."""
    return tuple(
        (name, with_fixes(_params(name, MOVE_SLOW, tree), tree))
        if isinstance(params, MoveSlowAndClearParams)
        else (name, params)
        for name, params in named
    )


def circumscribed_radius_m(tree: Mapping[str, Any]) -> float:
    """Return move_base's circumscribed radius: its own parameter, not the footprint's."""
    costmap = tree["local_costmap"]
    return costmap.get("circumscribed_radius", CostmapParams.circumscribed_radius_m)


def _default_sequence(tree: Mapping[str, Any]) -> NamedTypes:
    rotation: NamedTypes = ()
    if tree.get("clearing_rotation_allowed", True):
        rotation = ((_ROTATE, ROTATE),)
    return ((_CONSERVATIVE, CLEAR), *rotation, (_AGGRESSIVE, CLEAR), *rotation)


def _normalise_default_distances(tree: Namespace, notes: Notes) -> None:
    """Set the two distances that move_base overwrites."""
    radius_m = circumscribed_radius_m(tree)
    if not isinstance(radius_m, float):
        return  # a fault, already noted
    distances = {_CONSERVATIVE: tree["conservative_reset_dist"], _AGGRESSIVE: 4.0 * radius_m}
    for name, distance in distances.items():
        namespace = subtree(tree, name, "", notes)
        if namespace.get("reset_distance", distance) != distance:
            text = f"ignored by move_base: without recovery_behaviors it is {distance}"
            notes.remark(join(name, "reset_distance"), IGNORED, text)
        namespace["reset_distance"] = distance


def _listed(tree: Namespace, notes: Notes) -> Optional[NamedTypes]:
    """Return (name, type) of the ``recovery_behaviors``, None without that list.

    As in move_base, a list with a mistake counts as none: the default behaviours run, never a part
    of the list. It is removed from the tree.
    """
    place = "recovery_behaviors"
    if place not in tree:
        return None
    found = Notes("")
    listed = named_types(tree[place], "", "a behaviour", found)
    listed = {name: full_type(kind) for name, kind in listed.items()}
    mistakes = [(place, CAUTION, fault.text) for fault in found.faults]
    for name, kind in listed.items():
        if is_dotted(kind):
            check_class(kind, RECOVERY, join(place, name), notes)
        elif kind not in TABLES:
            text = f"{kind} is not supported; expected one of {', '.join(TABLES)}"
            mistakes.append((join(place, name), UNSUPPORTED, text))
    if not mistakes:
        return tuple(listed.items())
    for where, remark_kind, text in mistakes:
        notes.remark(where, remark_kind, f"{text}; flying with the default recoveries instead")
    del tree[place]
    return None


def listed_names(tree: Mapping[str, Any]) -> List[str]:
    """List the namespaces of recoveries, supported or not."""
    entries = tree.get("recovery_behaviors")
    names = []
    if isinstance(entries, list):
        names = [str(entry.get("name")) for entry in entries if isinstance(entry, dict)]
    return [*names, _CONSERVATIVE, _AGGRESSIVE, _ROTATE]


def full_type(kind: str) -> str:
    """Complete a type without its package, as old configurations have it."""
    for known in TABLES:
        if kind == known.split("/")[1]:
            return known
    return kind


def _normalise_clearing(namespace: Namespace, name: str, notes: Notes) -> None:
    """Check layers; upstream takes an unknown word of ``affected_maps`` for both."""
    maps = namespace.get("affected_maps", "both")
    if isinstance(maps, str) and maps not in _AFFECTED_MAPS:
        expected = TABLES[CLEAR]["affected_maps"].expected
        text = f"{maps!r} clears both; expected {expected}"
        notes.remark(join(name, "affected_maps"), CAUTION, text)
        namespace["affected_maps"] = "both"
    layers = namespace.get("layer_names", [])
    if not isinstance(layers, list) or not all(isinstance(layer, str) for layer in layers):
        expected = "expected names of layers, as in [obstacle_layer]"
        notes.problem(join(name, "layer_names"), f"{layers!r} is not a list of names; {expected}")


def _params(name: str, kind: str, tree: Mapping[str, Any]) -> RecoveryParams:
    namespace = tree.get(name, {})
    if kind == CLEAR:
        names = namespace.get("layer_names")
        layers = None if names is None else tuple(names)
        return made(ClearCostmapParams, namespace, layer_names=layers)
    if kind == MOVE_SLOW:
        return _slow_params(namespace, tree["base_local_planner"])
    if kind == ROTATE:
        limits = made(TurnLimits, tree.get(TRAJECTORY_PLANNER, {}))
        return made(RotateParams, namespace, limits=limits)
    return plugin_of(kind, RECOVERY, namespace, name)


def _look_at_slow(namespace: Mapping[str, Any], name: str, planner: str, notes: Notes) -> None:
    """Add remarks on names that are not of the chosen local planner."""
    own, speeds = plugin_name(planner), _speeds(planner)
    if not speeds:
        notes.remark(name, CAUTION, f"{own} is not limited: plugins have no reconfigurable speeds")
        return
    given = namespace.get("planner_namespace", "")
    if isinstance(given, str) and given.strip("/") not in ("", own):
        text = f"{given} is not the local planner; limiting {own} instead"
        notes.remark(join(name, "planner_namespace"), CAUTION, text)
        return
    for key, original in _SPEED_NAMES.items():
        speed = namespace.get(key, "")
        if isinstance(speed, str) and speed not in ("", original, *speeds):
            text = f"{own} has no speed parameter {speed}"
            notes.remark(join(name, key), CAUTION, text, nearest(speed, speeds))


def _speeds(planner: str, *units: str) -> Dict[str, str]:
    """Return parameter -> field of every speed of a local planner; none of a plugin."""
    if planner not in LOCAL_PLANNERS:
        return {}
    return {
        parameter.name: parameter.field
        for parameter in LOCAL_PLANNERS[planner].parameters
        if parameter.kind == "double" and parameter.unit in (units or ("m/s", "rad/s"))
    }


def _slow_params(namespace: Mapping[str, Any], planner: str) -> MoveSlowAndClearParams:
    """Make the recovery's dataclass from a normalised namespace."""
    speeds = _speeds(planner)

    def limited(unit: str, key: str) -> Tuple[str, ...]:
        limits = [
            field
            for name, field in _speeds(planner, unit).items()
            if not any(word in name for word in _NO_LIMIT)
        ]
        extra = [speeds[name] for name in (namespace.get(key, ""),) if name in speeds]
        return tuple(dict.fromkeys([*limits, *extra]))

    def named(key: str) -> str:
        given = namespace.get("planner_namespace", "") or _SLOWED_UPSTREAM
        if not speeds or given.strip("/") != plugin_name(planner):
            return ""  # upstream calls the dynamic_reconfigure server of another planner
        return speeds.get(namespace.get(key, "") or _SPEED_NAMES[key], "")

    return made(
        MoveSlowAndClearParams,
        namespace,
        named_translation_field=named("max_trans_param_name"),
        named_rotation_field=named("max_rot_param_name"),
        translation_fields=limited("m/s", "max_trans_param_name"),
        rotation_fields=limited("rad/s", "max_rot_param_name"),
    )
