"""Namespaces of the local planners: old names, remarks, and the dataclasses that they fill."""

from __future__ import annotations

from typing import Any, Dict, Mapping

from quad_nav.config.fixes import FIXES
from quad_nav.config.notes import CAUTION, IGNORED, RENAMED, Notes, join
from quad_nav.config.reader import Namespace, fields, normalise, subtree
from quad_nav.config.spec import InvalidValue
from quad_nav.config.tables.dwa_planner import DWA_TABLE, LATCH
from quad_nav.config.tables.trajectory_planner import TRAJECTORY_PLANNER_TABLE
from quad_nav.control.dwa_planner_params import DwaParams
from quad_nav.control.trajectory_planner_params import TrajectoryPlannerParams

TRAJECTORY_PLANNER = "TrajectoryPlannerROS"
DWA_PLANNER = "DWAPlannerROS"

_RENAMED: Dict[str, str] = {
    "pdist_scale": "path_distance_bias",
    "gdist_scale": "goal_distance_bias",
    "min_in_place_rotational_vel": "min_in_place_vel_theta",
}


def normalise_trajectory_planner(tree: Namespace, notes: Notes) -> None:
    """Normalise the planner's namespace as move_base does."""
    planner = subtree(tree, TRAJECTORY_PLANNER, "", notes)
    for old, new in _RENAMED.items():
        if old in planner:
            _rename(planner, old, new, notes)
    if isinstance(planner.get("y_vels"), list):
        text = "ignored by move_base: it is a list; expected a string, as in '-0.3, 0.3'"
        notes.remark(join(TRAJECTORY_PLANNER, "y_vels"), IGNORED, text)
        del planner["y_vels"]
    normalise(planner, TRAJECTORY_PLANNER, TRAJECTORY_PLANNER_TABLE, notes, also_known=_RENAMED)
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
            "the robot escapes forwards; expected a negative velocity, to back up",
        )


def _is_respected(tree: Namespace) -> bool:
    fixes = tree.get(FIXES)
    return isinstance(fixes, dict) and fixes.get("respect_meter_scoring") is True


def trajectory_planner_params(tree: Mapping[str, Any]) -> TrajectoryPlannerParams:
    """Make the planner's dataclass from a normalised tree."""
    return TrajectoryPlannerParams(
        **fields(tree[TRAJECTORY_PLANNER], TRAJECTORY_PLANNER_TABLE.parameters)
    )


def _rename(planner: Namespace, old: str, new: str, notes: Notes) -> None:
    place = join(TRAJECTORY_PLANNER, old)
    if new in planner:
        notes.remark(place, IGNORED, f"ignored by move_base: {new} is set too")
        return
    planner[new] = planner[old]
    notes.moved(join(TRAJECTORY_PLANNER, new), place)
    notes.remark(place, RENAMED, f"old name of {new}")


def normalise_dwa(tree: Namespace, notes: Notes) -> None:
    """Normalise the planner's namespace as move_base does."""
    planner = subtree(tree, DWA_PLANNER, "", notes)
    normalise(planner, DWA_PLANNER, DWA_TABLE, notes)
    if LATCH.name in tree:
        try:
            LATCH.check(tree[LATCH.name])
        except InvalidValue as problem:
            notes.problem(LATCH.name, str(problem))
    if planner["occdist_scale"] == 0.0:
        notes.remark(
            join(DWA_PLANNER, "occdist_scale"),
            CAUTION,
            "0 disables the scoring of obstacles: the robot may hit them",
        )


def dwa_params(tree: Mapping[str, Any]) -> DwaParams:
    """Make the planner's dataclass from a normalised tree."""
    arguments = fields(tree[DWA_PLANNER], DWA_TABLE.parameters)
    if LATCH.name not in tree[DWA_PLANNER]:
        arguments[LATCH.field] = tree.get(LATCH.name, LATCH.default)
    return DwaParams(**arguments)
