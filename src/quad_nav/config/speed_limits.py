"""Speeds that ``move_slow_and_clear/MoveSlowAndClear`` limits.

Upstream changes two parameters of a planner that the configuration names. Here the recovery limits
all speeds of the chosen local planner, those of flying backwards included.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Dict, Mapping, Optional, Tuple

from quad_nav.config.notes import CAUTION, Notes, join
from quad_nav.config.planners import DWA_PLANNER
from quad_nav.config.plugins import plugin_name
from quad_nav.config.reader import made
from quad_nav.control.dwa_planner_params import DwaParams
from quad_nav.control.trajectory_planner_params import TrajectoryPlannerParams
from quad_nav.files.values import nearest
from quad_nav.navigator.params import DEFAULT_LOCAL_PLANNER
from quad_nav.parameter import parameters_of
from quad_nav.recovery import MoveSlowAndClearParams


@dataclass(frozen=True)
class Speeds:
    """Parameters of a local planner that limit its speeds."""

    owner: type
    translation: Tuple[str, ...]
    rotation: Tuple[str, ...]

    @property
    def fields(self) -> Dict[str, str]:
        """Return parameter -> field of every speed."""
        return {
            parameter.name: parameter.field
            for parameter in parameters_of(self.owner)
            if parameter.unit in ("m/s", "rad/s") and parameter.kind == "double"
        }


# Plugins are not in it: they have no reconfigurable parameters.
SPEEDS: Dict[str, Speeds] = {
    DEFAULT_LOCAL_PLANNER: Speeds(
        TrajectoryPlannerParams,
        translation=("max_vel_x", "min_vel_x", "escape_vel"),
        rotation=("max_vel_theta", "min_vel_theta", "min_in_place_vel_theta", "max_rotational_vel"),
    ),
    DWA_PLANNER: Speeds(
        DwaParams,
        translation=(
            "max_vel_trans",
            "min_vel_trans",
            "max_vel_x",
            "min_vel_x",
            "max_vel_y",
            "min_vel_y",
        ),
        rotation=("max_vel_theta", "min_vel_theta"),
    ),
}
_UPSTREAM_NAMESPACE = "DWAPlannerROS"
# Parameters that name one more speed, and their upstream defaults.
_NAMES = {"max_trans_param_name": "max_trans_vel", "max_rot_param_name": "max_rot_vel"}


def check_slow(namespace: Mapping[str, Any], name: str, planner: str, notes: Notes) -> None:
    """Add remarks on names that are not of ``planner``, the chosen local planner."""
    own, speeds = plugin_name(planner), SPEEDS.get(planner)
    if speeds is None:
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
        if isinstance(speed, str) and speed not in ("", original, *speeds.fields):
            notes.remark(
                join(name, key),
                CAUTION,
                f"{own} has no speed parameter {speed}",
                nearest(speed, speeds.fields),
            )


def slow_params(namespace: Mapping[str, Any], planner: str) -> MoveSlowAndClearParams:
    """Make the recovery's dataclass from a normalised namespace."""
    speeds: Optional[Speeds] = SPEEDS.get(planner)

    def limited(names: Tuple[str, ...], key: str) -> Tuple[str, ...]:
        known = speeds.fields if speeds else {}
        return tuple(
            dict.fromkeys(known[name] for name in (*names, namespace.get(key, "")) if name in known)
        )

    def named(key: str) -> str:
        given = namespace.get("planner_namespace", "") or _UPSTREAM_NAMESPACE
        if speeds is None or given.strip("/") != plugin_name(planner):
            return ""  # upstream calls the dynamic_reconfigure server of another planner
        return speeds.fields.get(namespace.get(key, "") or _NAMES[key], "")

    return made(
        MoveSlowAndClearParams,
        namespace,
        named_translation_field=named("max_trans_param_name"),
        named_rotation_field=named("max_rot_param_name"),
        translation_fields=limited(speeds.translation if speeds else (), "max_trans_param_name"),
        rotation_fields=limited(speeds.rotation if speeds else (), "max_rot_param_name"),
    )
