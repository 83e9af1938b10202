"""Speeds that ``move_slow_and_clear/MoveSlowAndClear`` limits.

Upstream changes two parameters of a planner that the configuration names. Here the recovery limits
all speeds of the chosen local planner, those of flying backwards included.
"""

from __future__ import annotations

from typing import Any, Dict, Mapping, Tuple

from quad_nav.config.notes import CAUTION, Notes, join
from quad_nav.config.planners import LOCAL_PLANNERS
from quad_nav.config.plugins import plugin_name
from quad_nav.config.reader import made
from quad_nav.files.values import nearest
from quad_nav.recovery import MoveSlowAndClearParams

# Speeds that tell when the robot has stopped, or when its footprint grows: they limit nothing.
_NO_LIMIT = ("_stopped_", "scaling_speed")
_UPSTREAM_NAMESPACE = "DWAPlannerROS"
# Parameters that name one more speed, and their upstream defaults.
_NAMES = {"max_trans_param_name": "max_trans_vel", "max_rot_param_name": "max_rot_vel"}


def check_slow(namespace: Mapping[str, Any], name: str, planner: str, notes: Notes) -> None:
    """Add remarks on names that are not of ``planner``, the chosen local planner."""
    own, speeds = plugin_name(planner), _speeds(planner)
    if not speeds:
        notes.remark(name, CAUTION, f"{own} is not limited: plugins have no reconfigurable speeds")
        return
    given = namespace.get("planner_namespace", "")
    if isinstance(given, str) and given.strip("/") not in ("", own):
        notes.remark(
            join(name, "planner_namespace"),
            CAUTION,
            f"{given} is not the local planner; limiting {own} instead",
        )
        return
    for key, original in _NAMES.items():
        speed = namespace.get(key, "")
        if isinstance(speed, str) and speed not in ("", original, *speeds):
            notes.remark(
                join(name, key),
                CAUTION,
                f"{own} has no speed parameter {speed}",
                nearest(speed, speeds),
            )


def _speeds(planner: str, *units: str) -> Dict[str, str]:
    """Return parameter -> field of every speed of a local planner; none of a plugin."""
    if planner not in LOCAL_PLANNERS:
        return {}
    return {
        parameter.name: parameter.field
        for parameter in LOCAL_PLANNERS[planner].table.parameters
        if parameter.kind == "double" and parameter.unit in (units or ("m/s", "rad/s"))
    }


def slow_params(namespace: Mapping[str, Any], planner: str) -> MoveSlowAndClearParams:
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
        given = namespace.get("planner_namespace", "") or _UPSTREAM_NAMESPACE
        if not speeds or given.strip("/") != plugin_name(planner):
            return ""  # upstream calls the dynamic_reconfigure server of another planner
        return speeds.get(namespace.get(key, "") or _NAMES[key], "")

    return made(
        MoveSlowAndClearParams,
        namespace,
        named_translation_field=named("max_trans_param_name"),
        named_rotation_field=named("max_rot_param_name"),
        translation_fields=limited("m/s", "max_trans_param_name"),
        rotation_fields=limited("rad/s", "max_rot_param_name"),
    )
