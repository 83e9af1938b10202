"""The tutorial's files: exactly these values, and the tree that move_base makes of them."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from quad_nav.config import load, load_files
from quad_nav.config.configuration import MOVE_BASE_TABLE
from quad_nav.config.fixes import GROUPS
from quad_nav.config.planners import LOCAL_PLANNERS, TRAJECTORY_PLANNER
from quad_nav.costmap.inflation import InflationLayerParams
from quad_nav.recovery import ClearCostmapParams, RotateParams, TurnLimits

CONFIG = Path(__file__).resolve().parents[3] / "config"
RECORDED = Path(__file__).parent / "data" / "tutorial_parameters.yaml"

# The tutorial's files, without comments.
WRITTEN = {
    "base_local_planner_params": """
TrajectoryPlannerROS:
  {max_vel_x: 0.3, min_vel_x: 0.1, max_vel_theta: 0.7, min_in_place_vel_theta: 1.0,
   acc_lim_theta: 3.2, acc_lim_x: 2.0, acc_lim_y: 2.0, holonomic_robot: false, meter_scoring: true}
""",
    "costmap_common_params": """
{obstacle_range: 2.5, raytrace_range: 3.0, inflation_radius: 0.40, robot_radius: 0.35,
 transform_tolerance: 0.8, observation_sources: base_scan, base_scan:
  {sensor_frame: Lidar$(arg i), data_type: LaserScan, topic: scan$(arg i),
   expected_update_rate: 21.0, observation_persistence: 1.0, marking: true, clearing: true,
   min_obstacle_height: -0.10, max_obstacle_height: 2.0, obstacle_range: 2.0, inf_is_valid: true,
   raytrace_range: 6.0}}
""",
    "global_costmap_params": """
global_costmap:
  {global_frame: map, robot_base_frame: base_link$(arg i), update_frequency: 3.0,
   static_map: false, width: 12.0, height: 12.0}
""",
    "local_costmap_params": """
local_costmap:
  {global_frame: map, robot_base_frame: base_link$(arg i), update_frequency: 4.0,
   publish_frequency: 2.0, static_map: false, rolling_window: true, width: 3.0, height: 3.0,
   resolution: 0.025, origin_x: 0.0, origin_y: 0.0}
""",
    "move_base_params": "{conservative_reset_dist: 1.0, controller_frequency: 1.0}",
}


def tutorial(number: str = "0"):
    return load_files(CONFIG / "tutorial", {"i": number})


@pytest.mark.parametrize("stem", sorted(WRITTEN))
def test_file_holds_the_tutorials_values_and_nothing_else(stem):
    text = (CONFIG / "tutorial" / f"{stem}.yaml").read_text()
    assert yaml.safe_load(text) == yaml.safe_load(WRITTEN[stem])


def test_there_are_no_other_files():
    assert {path.stem for path in (CONFIG / "tutorial").iterdir()} == set(WRITTEN)


def test_tree_is_what_move_base_leaves_on_the_parameter_server():
    left = load(tutorial(), "/move_base0").to_tree()
    recorded = yaml.safe_load(RECORDED.read_text())
    planner = LOCAL_PLANNERS["base_local_planner/TrajectoryPlannerROS"]
    for group in GROUPS:
        del left[group]  # not in the original
    for namespace, table in (("", MOVE_BASE_TABLE), (TRAJECTORY_PLANNER, planner)):
        for own in (one for one in table.reconfigurable if one.is_own):
            del (left[namespace] if namespace else left)[own.name]
    assert left == recorded
    assert typed(left) == typed(recorded)  # 12 and 12.0 are equal, and not the same parameter


def typed(tree):
    return {
        key: typed(value) if isinstance(value, dict) else type(value) for key, value in tree.items()
    }


def test_a_restarted_node_finds_its_own_tree_and_flies_the_same():
    first = load(tutorial(), "/move_base0")
    second = load(first.to_tree(), "/move_base0")
    assert second.to_tree() == first.to_tree()
    assert second.local_costmap == first.local_costmap
    assert second.recoveries == first.recoveries
    assert len(second.remarks) == len(first.remarks)


def test_only_remark_is_on_the_long_update_period():
    remarks = load(tutorial(), "/move_base0").remarks
    told = [(remark.kind, remark.text.split()[0]) for remark in remarks]
    assert told == [("caution", "21.0")] * 2  # once for each costmap
    assert remarks[0].place.startswith("/move_base0/global_costmap/base_scan/expected_update")
    assert remarks[0].origin.endswith("costmap_common_params.yaml:12")


def test_costmaps():
    configuration = load(tutorial("1"), "/move_base1")
    for costmap in configuration.costmaps.values():
        (_, obstacles), (_, inflation) = costmap.layers
        (source,) = obstacles.sources
        assert (source.topic, source.sensor_frame) == ("scan1", "Lidar1")
        assert (source.obstacle_range_m, source.raytrace_range_m) == (2.0, 6.0)
        assert (source.min_obstacle_height_m, source.max_obstacle_height_m) == (-0.1, 2.0)
        assert (source.expected_update_period_s, source.inf_is_valid) == (21.0, True)
        assert inflation == InflationLayerParams(inflation_radius_m=0.4)
        assert (costmap.robot_radius_m, costmap.footprint) == (0.35, None)
        assert (costmap.global_frame, costmap.robot_base_frame) == ("map", "base_link1")


def test_planner_keeps_the_defaults_of_dynamic_reconfigure():
    configuration = load(tutorial(), "/move_base0")
    planner = configuration.local_planner
    assert (planner.min_vel_theta_radps, planner.max_vel_theta_radps) == (-1.0, 0.7)
    assert planner.max_rotational_vel_radps == 1.0  # the turn at the goal does not ask the above
    assert planner.goal_distance_bias == 0.8
    assert planner.y_vels_mps == (-0.3, -0.1, 0.1, -0.3)
    assert configuration.local_planner_period_s == 1.0


def test_controller_patience_is_15_s_until_the_first_reconfiguration():
    configuration = load(tutorial(), "/move_base0")
    assert configuration.navigator.controller_patience_s == 15.0
    assert configuration.to_tree()["controller_patience"] == 5.0


def test_default_recoveries():
    recoveries = load(tutorial(), "/move_base0").recoveries
    assert [name for name, _ in recoveries] == [
        "conservative_reset",
        "rotate_recovery",
        "aggressive_reset",
        "rotate_recovery",
    ]
    conservative, rotate, aggressive, _ = [params for _, params in recoveries]
    assert isinstance(conservative, ClearCostmapParams) and conservative.reset_distance_m == 1.0
    assert aggressive.reset_distance_m == pytest.approx(4 * 0.46)
    assert conservative.layer_names is None
    assert rotate == RotateParams(
        limits=TurnLimits(max_vel_theta_radps=0.7, min_in_place_vel_theta_radps=1.0)
    )


def test_shipped_default_loads_without_a_remark():
    configuration = load(load_files(CONFIG / "default", {"i": "0"}), "/move_base0")
    assert configuration.warnings == ()
