"""Changes in flight, and the description for dynamic_reconfigure."""

from __future__ import annotations

import pytest

from quad_nav.config import load, reconfigurable, updated, values
from quad_nav.config.fixes import GROUPS
from quad_nav.errors import InputError

TREE = {
    "controller_frequency": 1.0,
    "conservative_reset_dist": 1.0,
    "TrajectoryPlannerROS": {"max_vel_x": 0.3},
    "local_costmap": {"static_map": True, "inflation_radius": 0.4},
}


@pytest.fixture
def configuration():
    return load(TREE, "/nav")


def test_namespaces(configuration):
    namespaces = reconfigurable(configuration)
    assert list(namespaces) == [
        "",
        "TrajectoryPlannerROS",
        "global_costmap",
        "global_costmap/obstacle_layer",
        "global_costmap/inflation_layer",
        "local_costmap",
        "local_costmap/static_layer",
        "local_costmap/obstacle_layer",
        "local_costmap/inflation_layer",
        *GROUPS,
    ]


def names_of(configuration, namespace):
    """Names of upstream's parameters in their order."""
    return [one.name for one in reconfigurable(configuration)[namespace] if not one.is_own]


@pytest.mark.parametrize(
    "namespace, names",
    [
        (
            "local_costmap",
            "transform_tolerance update_frequency publish_frequency width height resolution"
            " origin_x origin_y footprint robot_radius footprint_padding",
        ),
        (
            "local_costmap/obstacle_layer",
            "enabled footprint_clearing_enabled max_obstacle_height combination_method",
        ),
        (
            "local_costmap/inflation_layer",
            "enabled cost_scaling_factor inflation_radius inflate_unknown",
        ),
        ("local_costmap/static_layer", "enabled"),
    ],
)
def test_parameters_are_in_the_order_of_upstream(configuration, namespace, names):
    assert names_of(configuration, namespace) == names.split()


def test_the_node_and_the_planner_have_as_many_as_upstream(configuration):
    node, planner = names_of(configuration, ""), names_of(configuration, "TrajectoryPlannerROS")
    assert node[:3] == ["base_global_planner", "base_local_planner", "planner_frequency"]
    assert (len(node), len(planner)) == (16, 28)
    assert planner[-2:] == ["y_vels", "restore_defaults"]


def test_types_are_those_of_the_messages(configuration):
    for namespace, parameters in reconfigurable(configuration).items():
        now = values(configuration, namespace)
        kinds = {"double": float, "int": int, "bool": bool, "str": str}
        for parameter in parameters:
            assert type(now[parameter.name]) is kinds[parameter.kind], parameter.name
            assert type(parameter.default) is kinds[parameter.kind], parameter.name


def test_change_of_the_planner_leaves_the_rest(configuration):
    changed = updated(configuration, "TrajectoryPlannerROS", {"max_vel_x": 0.5, "dwa": True})
    assert (changed.local_planner.max_vel_x_mps, changed.local_planner.dwa) == (0.5, True)
    assert configuration.local_planner.max_vel_x_mps == 0.3
    assert changed.navigator == configuration.navigator
    assert changed.recoveries == configuration.recoveries
    assert values(changed, "TrajectoryPlannerROS")["max_vel_x"] == 0.5


def test_changes_of_costmaps_and_layers(configuration):
    changed = updated(configuration, "local_costmap/inflation_layer", {"inflation_radius": 1})
    assert dict(changed.local_costmap.layers)["inflation_layer"].inflation_radius_m == 1.0
    assert changed.global_costmap == configuration.global_costmap
    changed = updated(changed, "local_costmap", {"width": 4, "footprint": "[[1,0],[0,1],[0,-1]]"})
    assert changed.local_costmap.width_m == 4.0
    assert changed.local_costmap.footprint == ((1.0, 0.0), (0.0, 1.0), (0.0, -1.0))
    assert dict(changed.local_costmap.layers)["inflation_layer"].inflation_radius_m == 1.0


def test_voxel_layer():
    configuration = load({"local_costmap": {"map_type": "voxel"}}, "")
    assert (
        names_of(configuration, "local_costmap/obstacle_layer")
        == (
            "enabled footprint_clearing_enabled max_obstacle_height origin_z z_resolution z_voxels"
            " unknown_threshold mark_threshold combination_method"
        ).split()
    )
    changed = updated(configuration, "local_costmap/obstacle_layer", {"z_voxels": 4})
    assert dict(changed.local_costmap.layers)["obstacle_layer"].z_voxels == 4


def test_values_are_clamped(configuration):
    changed = updated(
        configuration,
        "TrajectoryPlannerROS",
        {"max_vel_x": -3.0, "vx_samples": 1000, "min_vel_theta": 0.5},
    )
    planner = changed.local_planner
    assert (planner.max_vel_x_mps, planner.min_vel_theta_radps) == (0.0, 0.0)
    assert planner.vx_samples == 300


def test_first_change_of_move_base_sets_the_described_controller_patience(configuration):
    assert configuration.navigator.controller_patience_s == 15.0
    changed = updated(configuration, "", {"planner_frequency": 2.0})
    assert changed.navigator.planner_frequency_hz == 2.0
    assert changed.navigator.controller_patience_s == 5.0
    elsewhere = updated(configuration, "local_costmap", {"width": 4})
    assert elsewhere.navigator.controller_patience_s == 15.0


def test_recoveries_keep_what_they_were_loaded_with(configuration):
    changed = updated(configuration, "", {"conservative_reset_dist": 2.0})
    assert changed.navigator.conservative_reset_dist_m == 2.0
    assert dict(changed.recoveries)["conservative_reset"].reset_distance_m == 1.0


def test_restore_defaults_goes_back_to_what_was_loaded(configuration):
    changed = updated(configuration, "TrajectoryPlannerROS", {"max_vel_x": 0.5, "sim_time": 2.0})
    restored = updated(changed, "TrajectoryPlannerROS", {"restore_defaults": True, "sim_time": 3.0})
    assert restored.local_planner == configuration.local_planner
    assert restored.to_tree() == configuration.to_tree()


def test_all_refused_changes_are_reported_and_none_is_made(configuration):
    changes = {
        "planner_frequency": 2.0,
        "controller_frequency": 0.0,
        "planner_patience": float("nan"),
        "shutdown_costmaps": 1,
        "speed": 1.0,
    }
    with pytest.raises(InputError) as caught:
        updated(configuration, "", changes)
    told = caught.value.problems
    assert told.pop().startswith("speed: unknown parameter; expected one of base_global_planner,")
    assert told == [
        "controller_frequency: 0.0 is out of range; expected a positive number of Hz",
        "planner_patience: nan is not finite; expected a number of seconds, 0 or more",
        "shutdown_costmaps: 1 is not a boolean; expected true or false",
    ]
    assert configuration.navigator.planner_frequency_hz == 0.0


def test_size_out_of_range_is_refused(configuration):
    with pytest.raises(InputError, match="^global_costmap: 21474836 x 10 m .* take 3264.2 GB of"):
        updated(configuration, "global_costmap", {"width": 21474836})


def test_too_many_trajectories_are_refused(configuration):
    with pytest.raises(InputError) as caught:
        updated(configuration, "TrajectoryPlannerROS", {"sim_granularity": 1e-8})
    # 20 x 20 samples, 0.3 m/s for 1.7 s
    assert caught.value.problems == [
        "TrajectoryPlannerROS: 400 trajectories of up to 5.1e+07 points are too many; expected at"
        " most 100000000 points in total (use fewer samples, a shorter sim_time, a lower speed or a"
        " coarser granularity)"
    ]
    with pytest.raises(InputError, match="400 trajectories of up to 1.7e[+]08 points"):
        updated(configuration, "TrajectoryPlannerROS", {"angular_sim_granularity": 1e-8})


@pytest.mark.parametrize(
    "change, told",
    [
        ({"vx_samples": 21474836}, "4294967200 trajectories of up to 37.4 points"),
        ({"sim_time": 1e16}, "600 trajectories of up to 2.2e[+]17 points"),
        ({"max_vel_trans": 1e9, "max_vel_y": 1e9}, "600 trajectories of up to 6.8e[+]10 points"),
    ],
)
def test_dwa_planner_is_refused_the_same(change, told):
    dwa = load({"base_local_planner": "dwa_local_planner/DWAPlannerROS"}, "")
    with pytest.raises(InputError, match=told):
        updated(dwa, "DWAPlannerROS", change)
    changed = updated(dwa, "DWAPlannerROS", {"vx_samples": 300, "max_vel_y": 1e9})
    assert changed.local_planner.vx_samples == 300


def test_groups_of_dynamic_reconfigure_are_ignored(configuration):
    changed = updated(configuration, "local_costmap", {"groups": {"id": 0}, "width": 4})
    assert changed.local_costmap.width_m == 4.0
