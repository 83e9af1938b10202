"""Values of an empty parameter tree: ``defaults.json``."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Dict, List

from families.case import InvalidValue, Recorded
from families.comparison import Comparison, Difference
from quad_nav.config import Configuration, load, values
from quad_nav.control.trajectory_planner import TrajectoryPlannerParams
from quad_nav.costmap.inflation import InflationLayer
from quad_nav.costmap.layered import LayeredCostmap
from quad_nav.costmap.obstacle import ObstacleLayer

_METRES = 1e-12  # tolerance of radii


def check(path: Path) -> List[Difference]:
    comparison = Comparison()
    try:
        recorded = json.loads(path.read_text(encoding="utf-8"), object_hook=Recorded)
    except (OSError, ValueError) as error:
        raise InvalidValue(f"cannot be read: {error}") from error
    configuration = load({})
    _check_costmap(configuration, recorded["costmap_defaults"], comparison)
    _check_planner(configuration.local_planner, recorded["trajectory_planner_defaults"], comparison)
    dwa = values(load({"base_local_planner": "dwa_local_planner/DWAPlannerROS"}), "DWAPlannerROS")
    del dwa["restore_defaults"]  # a button, not recorded
    _compare(comparison, "dwa_defaults", dwa, recorded["dwa_defaults"])
    return comparison.differences


def _check_costmap(
    configuration: Configuration, recorded: Recorded, comparison: Comparison
) -> None:
    params = configuration.local_costmap
    costmap = LayeredCostmap(params)
    spec = costmap.spec
    obstacles, inflation = costmap.layers["obstacle_layer"], costmap.layers["inflation_layer"]
    assert isinstance(obstacles, ObstacleLayer) and isinstance(inflation, InflationLayer)
    found: Dict[str, Dict[str, Any]] = {
        "info": {
            "size_x": spec.size_x,
            "size_y": spec.size_y,
            "resolution": spec.resolution_m,
            "origin_x": spec.origin_x_m,
            "origin_y": spec.origin_y_m,
            "rolling": params.rolling_window,
            "layers": list(costmap.layers),
            "default_value": costmap.costs[0, 0],
            "current": costmap.is_current(0.0),
        },
        "dynamic_parameters": {
            "transform_tolerance": params.transform_tolerance_s,
            "publish_frequency": params.publish_frequency_hz,
            "width": params.width_m,
            "height": params.height_m,
            "robot_radius": params.robot_radius_m,
            "footprint_padding": params.footprint_padding_m,
            "footprint": "[]" if params.footprint is None else params.footprint,
        },
        "layers": {
            "default_value": obstacles.grid.default_cost,
            "footprint_clearing_enabled": obstacles.params.footprint_clearing_enabled,
            "max_obstacle_height": obstacles.params.max_obstacle_height_m,
            "combination_method": obstacles.params.combination_method,
            "enabled": obstacles.params.enabled,
            "sources": [source.name for source in obstacles.params.sources],
        },
    }
    info = recorded["info"]
    comparison.near(
        "costmap_defaults.info.inscribed", costmap.inscribed_radius_m, info["inscribed"], _METRES
    )
    comparison.near(
        "costmap_defaults.info.circumscribed",
        costmap.circumscribed_radius_m,
        info["circumscribed"],
        _METRES,
    )
    for part, fields in found.items():
        _compare(comparison, f"costmap_defaults.{part}", fields, recorded[part])
    _compare(
        comparison,
        "costmap_defaults.layers.inflation",
        {
            "inflation_radius": inflation.params.inflation_radius_m,
            "cost_scaling_factor": inflation.params.cost_scaling_factor,
            "inflate_unknown": inflation.params.inflate_unknown,
            "enabled": inflation.params.enabled,
            "cell_inflation_radius": inflation.radius_cells,
        },
        recorded["layers"]["inflation"],
    )


def _check_planner(
    params: TrajectoryPlannerParams, recorded: Recorded, comparison: Comparison
) -> None:
    """By the original's names; what it shortens is under its short name there."""
    planner = {
        "acc_lim_x": params.acc_lim_x_mps2,
        "acc_lim_y": params.acc_lim_y_mps2,
        "acc_lim_theta": params.acc_lim_theta_radps2,
        "max_vel_x": params.max_vel_x_mps,
        "min_vel_x": params.min_vel_x_mps,
        "max_vel_th": params.max_vel_theta_radps,
        "min_vel_th": params.min_vel_theta_radps,
        "min_in_place_vel_th": params.min_in_place_vel_theta_radps,
        "sim_time": params.sim_time_s,
        "sim_granularity": params.sim_granularity_m,
        "angular_sim_granularity": params.angular_sim_granularity_rad,
        "path_distance_bias": params.path_distance_bias,
        "goal_distance_bias": params.goal_distance_bias,
        "occdist_scale": params.occdist_scale,
        "oscillation_reset_dist": params.oscillation_reset_dist_m,
        "escape_reset_dist": params.escape_reset_dist_m,
        "escape_reset_theta": params.escape_reset_theta_rad,
        "vx_samples": params.vx_samples,
        "vtheta_samples": params.vtheta_samples,
        "heading_lookahead": params.heading_lookahead_m,
        "holonomic_robot": params.holonomic_robot,
        "backup_vel": params.escape_vel_mps,
        "dwa": params.dwa,
        "heading_scoring": params.heading_scoring,
        "heading_scoring_timestep": params.heading_scoring_timestep_s,
        "simple_attractor": params.simple_attractor,
        "y_vels": params.y_vels_mps,
    }
    ros = {
        "rot_stopped_velocity": params.rot_stopped_velocity_radps,
        "trans_stopped_velocity": params.trans_stopped_velocity_mps,
        "xy_goal_tolerance": params.xy_goal_tolerance_m,
        "yaw_goal_tolerance": params.yaw_goal_tolerance_rad,
        "prune_plan": params.prune_plan,
        "max_vel_th": params.max_rotational_vel_radps,
        "latch_xy_goal_tolerance": params.latch_xy_goal_tolerance,
    }
    _compare(comparison, "trajectory_planner_defaults.planner", planner, recorded["planner"])
    _compare(comparison, "trajectory_planner_defaults.ros", ros, recorded["ros"])


def _compare(comparison: Comparison, place: str, found: Dict[str, Any], recorded: Recorded) -> None:
    for name, value in found.items():
        comparison.exact(f"{place}.{name}", value, recorded[name])
