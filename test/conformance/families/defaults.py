"""Values of an empty parameter tree: ``defaults.json``."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Dict, List

from families.case import InvalidValue, Recorded
from families.comparison import Comparison, Difference
from quad_nav.config import Configuration, load, reconfigurable, values
from quad_nav.config.reader import RESTORE_DEFAULTS
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
    _check_planner(configuration, recorded["trajectory_planner_defaults"], comparison)
    dwa_configuration = load({"base_local_planner": "dwa_local_planner/DWAPlannerROS"})
    dwa = _upstream_values(dwa_configuration, "DWAPlannerROS")
    _compare(comparison, "dwa_defaults", dwa, recorded["dwa_defaults"])
    return comparison.differences


def _check_costmap(
    configuration: Configuration, recorded: Recorded, comparison: Comparison
) -> None:
    costmap = LayeredCostmap(configuration.local_costmap)
    for part, fields in _costmap_fields(costmap).items():
        _compare(comparison, f"costmap_defaults.{part}", fields, recorded[part])
    _compare(
        comparison,
        "costmap_defaults.layers.inflation",
        _inflation_fields(costmap),
        recorded["layers"]["inflation"],
    )
    for name, radius_m in (
        ("inscribed", costmap.inscribed_radius_m),
        ("circumscribed", costmap.circumscribed_radius_m),
    ):
        place = f"costmap_defaults.info.{name}"
        comparison.near(place, radius_m, recorded["info"][name], _METRES)


def _costmap_fields(costmap: LayeredCostmap) -> Dict[str, Dict[str, Any]]:
    params, spec = costmap.params, costmap.spec
    obstacles = costmap.layers["obstacle_layer"]
    assert isinstance(obstacles, ObstacleLayer)
    return {
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


def _inflation_fields(costmap: LayeredCostmap) -> Dict[str, Any]:
    inflation = costmap.layers["inflation_layer"]
    assert isinstance(inflation, InflationLayer)
    return {
        "inflation_radius": inflation.params.inflation_radius_m,
        "cost_scaling_factor": inflation.params.cost_scaling_factor,
        "inflate_unknown": inflation.params.inflate_unknown,
        "enabled": inflation.params.enabled,
        "cell_inflation_radius": inflation.radius_cells,
    }


_UPSTREAM_NAMES = {
    "max_vel_theta": "max_vel_th",
    "min_vel_theta": "min_vel_th",
    "min_in_place_vel_theta": "min_in_place_vel_th",
    "escape_vel": "backup_vel",
}
"""Names of the trajectory planner's parameters in the original, where they are others."""
_ROS = {
    "rot_stopped_velocity": "rot_stopped_velocity_radps",
    "trans_stopped_velocity": "trans_stopped_velocity_mps",
    "xy_goal_tolerance": "xy_goal_tolerance_m",
    "yaw_goal_tolerance": "yaw_goal_tolerance_rad",
    "prune_plan": "prune_plan",
    "max_vel_th": "max_rotational_vel_radps",
    "latch_xy_goal_tolerance": "latch_xy_goal_tolerance",
}
"""Parameters of the ROS wrapper of the planner, and ours."""


def _check_planner(
    configuration: Configuration, recorded: Recorded, comparison: Comparison
) -> None:
    params, place = configuration.local_planner, "trajectory_planner_defaults"
    planner = _upstream_values(configuration, "TrajectoryPlannerROS")
    planner["y_vels"] = params.y_vels_mps
    planner = {_UPSTREAM_NAMES.get(name, name): value for name, value in planner.items()}
    _compare(comparison, f"{place}.planner", planner, recorded["planner"])
    wrapper = {name: getattr(params, field) for name, field in _ROS.items()}
    _compare(comparison, f"{place}.ros", wrapper, recorded["ros"])


def _upstream_values(configuration: Configuration, namespace: str) -> Dict[str, Any]:
    """Values of the parameters that upstream has, but for a button, which is not recorded."""
    found = values(configuration, namespace)
    return {
        parameter.name: found[parameter.name]
        for parameter in reconfigurable(configuration)[namespace]
        if not parameter.is_own and parameter != RESTORE_DEFAULTS
    }


def _compare(comparison: Comparison, place: str, found: Dict[str, Any], recorded: Recorded) -> None:
    for name, value in found.items():
        comparison.exact(f"{place}.{name}", value, recorded[name])
