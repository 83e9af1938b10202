"""The trees of the planners: which plugin flies, and TrajectoryPlannerROS's old names."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Dict, Mapping, Tuple

from quad_nav.config import tables
from quad_nav.config.notes import CAUTION, IGNORED, RENAMED, UNSUPPORTED, Notes, join
from quad_nav.config.reader import Namespace, settle, subtree
from quad_nav.config.spec import Table

TRAJECTORY_PLANNER = "TrajectoryPlannerROS"
NAVFN = "NavfnROS"

# What flies here, by the parameter that names it; the first one stands in for the others.
SUPPORTED: Dict[str, str] = {
    "base_global_planner": tables.GLOBAL_PLANNER,
    "base_local_planner": tables.LOCAL_PLANNER,
}
# Namespaces of planners that people configure beside the one that they fly.
OTHER_PLANNERS = ("DWAPlannerROS", "GlobalPlanner", "CarrotPlanner", "TebLocalPlannerROS",
                  "EBandPlannerROS", "DWBLocalPlanner", "SBPLLatticePlanner")


@dataclass(frozen=True)
class Speeds:
    """The parameters of a local planner that say how fast the robot may go and turn."""

    table: Table
    translation: Tuple[str, ...]
    rotation: Tuple[str, ...]


# By the planner's namespace.
SPEEDS: Dict[str, Speeds] = {
    TRAJECTORY_PLANNER: Speeds(
        tables.TRAJECTORY_PLANNER, translation=("max_vel_x", "min_vel_x", "escape_vel"),
        rotation=("max_vel_theta", "min_vel_theta", "min_in_place_vel_theta",
                  "max_rotational_vel")),
}

_RENAMED: Dict[str, str] = {
    "pdist_scale": "path_distance_bias",
    "gdist_scale": "goal_distance_bias",
    "min_in_place_rotational_vel": "min_in_place_vel_theta",
}
_DEFAULT_RATE_HZ = 20.0


def settle_planner_names(tree: Namespace, notes: Notes) -> None:
    """Replaces planners that do not fly here by those that do, and says so."""
    for key, supported in SUPPORTED.items():
        name = tree.get(key)
        if not isinstance(name, str) or name == supported:
            continue
        if name == supported.split("/")[1]:
            notes.remark(key, RENAMED, f"{name} is called {supported} today")
        else:
            notes.remark(key, UNSUPPORTED,
                         f"{name} is not supported here; {supported} flies instead")
        tree[key] = supported


def settle_planners(tree: Namespace, notes: Notes) -> None:
    """Brings the planners' namespaces into the state in which the original leaves them."""
    planner = subtree(tree, TRAJECTORY_PLANNER, "", notes)
    for old, new in _RENAMED.items():
        if old in planner:
            _take_old_name(planner, old, new, notes)
    settle(planner, TRAJECTORY_PLANNER, tables.TRAJECTORY_PLANNER, notes, also_known=_RENAMED)
    if planner.get("meter_scoring") is False:
        notes.remark(join(TRAJECTORY_PLANNER, "meter_scoring"), IGNORED,
                     "ignored by move_base: distances are always scored in metres")
    if isinstance(planner.get("escape_vel"), float) and planner["escape_vel"] > 0.0:
        notes.remark(join(TRAJECTORY_PLANNER, "escape_vel"), CAUTION,
                     "the robot escapes forwards: a velocity below 0 backs up")
    settle(subtree(tree, NAVFN, "", notes), NAVFN, tables.NAVFN, notes)


def local_planner_namespace(tree: Mapping[str, Any]) -> str:
    """The namespace of the local planner that flies, of a settled tree."""
    return tree["base_local_planner"].split("/")[-1]


def local_planner_period_s(tree: Mapping[str, Any]) -> float:
    """The period that rollouts reckon with.

    The original looks for ``controller_frequency`` from TrajectoryPlannerROS
    upwards, and assumes 20 Hz when it is missing or not positive.
    """
    own = tree[TRAJECTORY_PLANNER].get("controller_frequency")
    rate_hz = tree["controller_frequency"] if own is None else own
    return 1.0 / rate_hz if rate_hz > 0.0 else 1.0 / _DEFAULT_RATE_HZ


def _take_old_name(planner: Namespace, old: str, new: str, notes: Notes) -> None:
    place = join(TRAJECTORY_PLANNER, old)
    if new in planner:
        notes.remark(place, IGNORED, f"ignored by move_base: {new} is there as well")
        return
    planner[new] = planner[old]
    notes.moved(join(TRAJECTORY_PLANNER, new), place)
    notes.remark(place, RENAMED, f"called {new} today")
