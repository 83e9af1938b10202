"""The tree of TrajectoryPlannerROS: old names, and what is odd about its parameters."""

from __future__ import annotations

from typing import Any, Dict, Mapping

from quad_nav.config import tables
from quad_nav.config.fixes import FIXES
from quad_nav.config.notes import CAUTION, IGNORED, RENAMED, Notes, join
from quad_nav.config.reader import Namespace, fields, settle, subtree
from quad_nav.control.trajectory_planner_params import TrajectoryPlannerParams

TRAJECTORY_PLANNER = "TrajectoryPlannerROS"

_RENAMED: Dict[str, str] = {
    "pdist_scale": "path_distance_bias",
    "gdist_scale": "goal_distance_bias",
    "min_in_place_rotational_vel": "min_in_place_vel_theta",
}


def settle_trajectory_planner(tree: Namespace, notes: Notes) -> None:
    """Brings the planner's namespace into the state in which the original leaves it."""
    planner = subtree(tree, TRAJECTORY_PLANNER, "", notes)
    for old, new in _RENAMED.items():
        if old in planner:
            _take_old_name(planner, old, new, notes)
    settle(planner, TRAJECTORY_PLANNER, tables.TRAJECTORY_PLANNER, notes, also_known=_RENAMED)
    if planner.get("meter_scoring") is False and not _is_respected(tree):
        notes.remark(
            join(TRAJECTORY_PLANNER, "meter_scoring"),
            IGNORED,
            "ignored by move_base: distances are always scored in metres",
        )
    if isinstance(planner.get("escape_vel"), float) and planner["escape_vel"] > 0.0:
        notes.remark(
            join(TRAJECTORY_PLANNER, "escape_vel"),
            CAUTION,
            "the robot escapes forwards: a velocity below 0 backs up",
        )


def _is_respected(tree: Namespace) -> bool:
    fixes = tree.get(FIXES)
    return isinstance(fixes, dict) and fixes.get("respect_meter_scoring") is True


def trajectory_planner_params(tree: Mapping[str, Any]) -> TrajectoryPlannerParams:
    """The dataclass of a settled tree."""
    return TrajectoryPlannerParams(
        **fields(tree[TRAJECTORY_PLANNER], tables.TRAJECTORY_PLANNER.parameters)
    )


def _take_old_name(planner: Namespace, old: str, new: str, notes: Notes) -> None:
    place = join(TRAJECTORY_PLANNER, old)
    if new in planner:
        notes.remark(place, IGNORED, f"ignored by move_base: {new} is there as well")
        return
    planner[new] = planner[old]
    notes.moved(join(TRAJECTORY_PLANNER, new), place)
    notes.remark(place, RENAMED, f"called {new} today")
