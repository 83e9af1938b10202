"""Let DWAPlannerROS fly with the limits of a local planner that is not here.

teb_local_planner, eband_local_planner, mpc_local_planner and others name velocities, accelerations
and tolerances much as DWAPlannerROS does. What they compute is lost.
"""

from __future__ import annotations

from typing import Any, Dict, List, Mapping

# DWAPlannerROS's name -> names of others, of which the first that is given counts.
_NAMES = {
    "max_vel_x": ("max_vel_x", "max_vel_lin", "max_vel_trans", "desired_linear_vel"),
    "max_vel_y": ("max_vel_y",),
    "max_vel_theta": ("max_vel_theta", "max_vel_th", "max_rotational_vel", "max_angular_vel"),
    "acc_lim_x": ("acc_lim_x", "max_acceleration", "max_translational_acceleration"),
    "acc_lim_y": ("acc_lim_y",),
    "acc_lim_theta": ("acc_lim_theta", "acc_lim_th", "max_rotational_acceleration"),
    "xy_goal_tolerance": ("xy_goal_tolerance",),
    "yaw_goal_tolerance": ("yaw_goal_tolerance",),
}


def dwa_limits(others: Mapping[str, Any]) -> Dict[str, Any]:
    """Return the parameters of DWAPlannerROS that follow from another planner's namespace."""
    # The accelerations of such planners are often so low that what one control period reaches is
    # less than DWAPlannerROS's least speeds, or than what its costs can tell apart: the robot would
    # not start. Without use_dwa the samples are what the whole rollout reaches.
    limits: Dict[str, Any] = {"min_vel_trans": 0.0, "min_vel_theta": 0.0, "use_dwa": False}
    for name, candidates in _NAMES.items():
        given = [others[one] for one in candidates if _is_number(others.get(one))]
        if given:
            limits[name] = given[0]
    sideways = limits.setdefault("max_vel_y", 0.0)
    limits["min_vel_y"] = -sideways
    if sideways == 0.0:
        limits["vy_samples"] = 1
    if "max_vel_x" in limits:
        limits["max_vel_trans"] = max(limits["max_vel_x"], sideways)
    return limits


def lost_names(others: Mapping[str, Any]) -> List[str]:
    """List the parameters that no limit of DWAPlannerROS stands for."""
    known = {name for names in _NAMES.values() for name in names}
    return [name for name in others if name not in known]


def footprint_of(others: Mapping[str, Any]) -> Dict[str, Any]:
    """Return costmap_2d's parameter for the ``footprint_model`` of TebLocalPlannerROS, or {}."""
    model = others.get("footprint_model")
    names = {"circular": ("radius", "robot_radius"), "polygon": ("vertices", "footprint")}
    if not isinstance(model, dict) or model.get("type") not in names:
        return {}
    name, own = names[model["type"]]
    return {own: model[name]} if name in model else {}


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)
