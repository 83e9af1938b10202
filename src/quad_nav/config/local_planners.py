"""Namespaces of the local planners: old names, remarks, and the dataclasses that they fill."""

from __future__ import annotations

from typing import Any, Dict, Mapping

from quad_nav.config.notes import CAUTION, IGNORED, RENAMED, Notes, join
from quad_nav.config.reader import Namespace, Table, made, normalise, subtree
from quad_nav.control.dwa_planner_params import DwaParams
from quad_nav.control.trajectory_planner_params import TrajectoryPlannerParams
from quad_nav.parameter import InvalidValue

TRAJECTORY_PLANNER = "TrajectoryPlannerROS"
DWA_PLANNER = "DWAPlannerROS"

_RENAMED: Dict[str, str] = {
    "pdist_scale": "path_distance_bias",
    "gdist_scale": "goal_distance_bias",
    "min_in_place_rotational_vel": "min_in_place_vel_theta",
}

TRAJECTORY_PLANNER_TABLE = Table(
    (TrajectoryPlannerParams,),
    restores=True,
    unsupported={
        "world_model": "the costmap is the only world model",
        "point_grid": "the costmap is the only world model",
    },
    ignored={
        "stop_time_buffer": "read and never used",
        "backup_vel": "escape_vel overrides it",
        "acc_limit_x": "renamed to acc_lim_x",
        "acc_limit_y": "renamed to acc_lim_y",
        "acc_limit_th": "renamed to acc_lim_theta",
        "acc_lim_th": "renamed to acc_lim_theta",
    },
)
DWA_TABLE = Table(
    (DwaParams,),
    restores=True,
    unsupported={
        "publish_traj_pc": "the sampled trajectories are not published",
        "odom_topic": "the topic of the odometry is odom; remap it",
    },
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
)
# Read from the planner's namespace or from the node's level, as upstream does.
LATCH = DWA_TABLE["latch_xy_goal_tolerance"]


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
    if planner.get("meter_scoring") is False and planner["respect_meter_scoring"] is not True:
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


def trajectory_planner_params(tree: Mapping[str, Any]) -> TrajectoryPlannerParams:
    """Make the planner's dataclass from a normalised tree."""
    return made(TrajectoryPlannerParams, tree[TRAJECTORY_PLANNER])


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
    latch = {LATCH.name: tree[LATCH.name]} if LATCH.name in tree else {}
    return made(DwaParams, {**latch, **tree[DWA_PLANNER]})
