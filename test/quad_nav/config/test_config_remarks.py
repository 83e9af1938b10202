"""Faults and remarks: each has its place and what was expected; all are reported at once."""

from __future__ import annotations

import re

import pytest
import yaml

from quad_nav.config import load
from quad_nav.errors import InputError
from quad_nav.recovery import ClearCostmapParams, MoveSlowAndClearParams, RotateParams, TurnLimits

SEEING = {"observation_sources": "scan", "scan": {"data_type": "LaserScan"}}
# A tree, and indented the fault in it.
FAULTS = """
{local_costmap: {width: three}}
    local_costmap/width: 'three' is not a number; expected a positive number of metres
{local_costmap: {resolution: 0}}
    local_costmap/resolution: 0 is out of range; expected a positive number of metres
{global_costmap: {update_frequency: .nan}}
    global_costmap/update_frequency: nan is not finite; expected a number of Hz, 0 or more
{global_costmap: {inflation_radius: true}}
    global_costmap/inflation_radius: True is not a number; expected a number of metres, 0 or more
{global_costmap: {inflation_radius: 1e-1}}
    global_costmap/inflation_radius: '1e-1' is not a number but a string (write 0.1); expected a
    number of metres, 0 or more
{local_costmap: {rolling_window: 1}}
    local_costmap/rolling_window: 1 is not a boolean; expected true or false
{local_costmap: {static_map: 'yes'}}
    local_costmap/static_map: 'yes' is not a boolean; expected true or false
{local_costmap: 3}
    local_costmap: 3 is a value; expected a namespace of parameters
{controller_frequency: 0}
    controller_frequency: 0 is out of range; expected a positive number of Hz
{TrajectoryPlannerROS: {pdist_scale: high}}
    TrajectoryPlannerROS/pdist_scale: 'high' is not a number; expected a number, 0 or more
{base_local_planner: dwa_local_planner/DWAPlannerROS, latch_xy_goal_tolerance: 'yes'}
    latch_xy_goal_tolerance: 'yes' is not a boolean; expected true or false
{local_costmap: {obstacle_layer: {combination_method: 2}}}
    local_costmap/obstacle_layer/combination_method: 2 is not a valid choice; expected one of 0
    (Overwrite), 1 (Maximum), 99 (Nothing)
{local_costmap: {observation_sources: scan, scan: {data_type: Laser}}}
    local_costmap/scan/data_type: 'Laser' is not a type of sensor; expected LaserScan, PointCloud
    or PointCloud2
{local_costmap: {plugins: [{name: obstacles}]}}
    local_costmap/plugins: {'name': 'obstacles'} is not a layer; expected {name: , type: }
{local_costmap: {footprint: [[0, 1], [1, 0]]}}
    local_costmap/footprint: [[0, 1], [1, 0]]: fewer than three points; expected a list [[x1, y1],
    [x2, y2], [x3, y3], ...] of metres
{local_costmap: {footprint: '[[0, 1], [1, 0], [x, 1]]'}}
    local_costmap/footprint: '[[0, 1], [1, 0], [x, 1]]': 'x' is not a number; expected a list [[x1,
    y1], [x2, y2], [x3, y3], ...] of metres
{recovery_behaviors: [{name: clear, type: ClearCostmapRecovery}], clear: {layer_names:
obstacle_layer}}
    clear/layer_names: 'obstacle_layer' is not a list of names; expected names of layers, as in
    [obstacle_layer]
"""
# A tree, and indented the kind of the remark and its line.
REMARKS = """
{recovery_behaviour_enabled: true}
    unknown: recovery_behaviour_enabled: unknown parameter, nothing reads it; did you mean
    recovery_behavior_enabled?
{zzz: 1}
    unknown: zzz: unknown parameter, nothing reads it
{TrajectoryPlannerROS: {path_distance_bias: 32.0}}
    clamped: TrajectoryPlannerROS/path_distance_bias: 32.0 clamped to 5.0, the largest that
    move_base allows
{TrajectoryPlannerROS: {vx_samples: 0}}
    clamped: TrajectoryPlannerROS/vx_samples: 0 clamped to 1, the smallest that move_base allows
{TrajectoryPlannerROS: {vx_samples: 6.5}}
    clamped: TrajectoryPlannerROS/vx_samples: 6.5 rounded to 7; expected a whole number
{TrajectoryPlannerROS: {pdist_scale: 2.0, path_distance_bias: 1.0}}
    ignored: TrajectoryPlannerROS/pdist_scale: ignored by move_base: path_distance_bias is set too
{TrajectoryPlannerROS: {acc_limit_x: 2.0}}
    ignored: TrajectoryPlannerROS/acc_limit_x: ignored by move_base: renamed to acc_lim_x
{TrajectoryPlannerROS: {meter_scoring: false}}
    ignored: TrajectoryPlannerROS/meter_scoring: ignored by move_base: distances are always scored
    in metres
{TrajectoryPlannerROS: {world_model: costmap}}
    unsupported: TrajectoryPlannerROS/world_model: not supported by this package: the costmap is
    the only world model
{TrajectoryPlannerROS: {escape_vel: 0.1}}
    caution: TrajectoryPlannerROS/escape_vel: the robot escapes forwards; expected a negative
    velocity, to back up
{TrajectoryPlannerROS: {controller_frequency: 20.0}, controller_frequency: 5.0}
    caution: TrajectoryPlannerROS/controller_frequency: rollouts assume 20.0 Hz, but the control
    loop runs at 5.0 Hz
{GlobalPlanner: {anything: 1}}
    unused: GlobalPlanner: unused: base_global_planner is navfn/NavfnROS; expected
    base_global_planner=global_planner/GlobalPlanner to fly with it
{base_global_planner: GlobalPlanner, GlobalPlanner: {default_tolerance: 0.5}}
    ignored: GlobalPlanner/default_tolerance: ignored by move_base: read and never used
{base_local_planner: dwa_local_planner/DWAPlannerROS, DWAPlannerROS: {occdist_scale: 0}}
    caution: DWAPlannerROS/occdist_scale: 0 disables the scoring of obstacles: the robot may hit
    them
{base_local_planner: dwa_local_planner/DWAPlannerROS, DWAPlannerROS: {}, TrajectoryPlannerROS:
{max_vel_theta: 0.4}}
    unused: TrajectoryPlannerROS: unused: base_local_planner is dwa_local_planner/DWAPlannerROS;
    expected base_local_planner=base_local_planner/TrajectoryPlannerROS to fly with it;
    rotate_recovery still reads its limits
{TebLocalPlannerROS: {max_vel_x: 1.0}}
    unsupported: TebLocalPlannerROS: planner not supported; its parameters are not read
{TrajectoryPlannerROS: {y_vels: [-0.3, 0.3]}}
    ignored: TrajectoryPlannerROS/y_vels: ignored by move_base: it is a list; expected a string, as
    in '-0.3, 0.3'
{base_global_planner: NavfnROS}
    renamed: base_global_planner: NavfnROS is an old name of navfn/NavfnROS
{aggressive_reset: {reset_distance: 0.5}}
    ignored: aggressive_reset/reset_distance: ignored by move_base: without recovery_behaviors it
    is 1.84
{recovery_behaviors: [{name: clear, type: ClearCostmapRecovery}], clear: {affected_maps: all}}
    caution: clear/affected_maps: 'all' clears both; expected local, global or both
{recovery_behaviors: [{name: back, type: twist_recovery/TwistRecovery}]}
    unsupported: recovery_behaviors/back: twist_recovery/TwistRecovery is not supported; expected
    one of clear_costmap_recovery/ClearCostmapRecovery, rotate_recovery/RotateRecovery,
    move_slow_and_clear/MoveSlowAndClear; flying with the default recoveries instead
{recovery_behaviors: none}
    caution: recovery_behaviors: 'none' is not a list; expected a list of {name: , type: }; flying
    with the default recoveries instead
{recovery_behaviors: [{name: turn}]}
    caution: recovery_behaviors: {'name': 'turn'} is not a behaviour; expected {name: , type: };
    flying with the default recoveries instead
{recovery_behaviors: [{name: a, type: RotateRecovery}, {name: a, type: ClearCostmapRecovery}]}
    caution: recovery_behaviors: 'a' is used twice; expected unique names; flying with the default
    recoveries instead
{recovery_behaviors: [{name: slow, type: MoveSlowAndClear}], slow: {planner_namespace:
DWAPlannerROS, max_trans_param_name: max_vel_trans}}
    caution: slow/planner_namespace: DWAPlannerROS is not the local planner; limiting
    TrajectoryPlannerROS instead
{recovery_behaviors: [{name: slow, type: MoveSlowAndClear}], slow: {max_rot_param_name:
max_vel_thet}}
    caution: slow/max_rot_param_name: TrajectoryPlannerROS has no speed parameter max_vel_thet; did
    you mean max_vel_theta?
{local_costmap: {observation_sources: scan, scan: {data_type: LaserScan}, plugins: []}}
    ignored: local_costmap/observation_sources: ignored by move_base: with plugins, expected in the
    obstacle layer's namespace
{local_costmap: {plugins: [], inflation_radius: 1.0}}
    ignored: local_costmap/inflation_radius: ignored by move_base: plugins has no
    costmap_2d::InflationLayer
{local_costmap: {plugins: [], inflater: {inflation_radius: 1.0}}}
    ignored: local_costmap/inflater: ignored by move_base: plugins has no layer of this name
{local_costmap: {plugins: [], map_type: costmap}}
    ignored: local_costmap/map_type: ignored by move_base: it is unused beside plugins
{local_costmap: {plugins: [], static_map: true}}
    ignored: local_costmap/static_map: ignored by move_base: plugins has no costmap_2d::StaticLayer
{local_costmap: {}}
    caution: local_costmap: no map and no observation_sources: this costmap never has obstacles
{local_costmap: {observation_sources: scan, scan: {data_type: LaserScan}, obstacle_layer: {rear:
{topic: scan1}}}}
    caution: local_costmap/obstacle_layer/rear: looks like a source, but observation_sources does
    not list it; not read
{local_costmap: {observation_sources: scan, scan: {topic: scan0}}}
    caution: local_costmap/scan: no data_type: move_base subscribes to a PointCloud
{local_costmap: {observation_sources: scan, scan: {data_type: LaserScan}, inflation_layer:
{robot_radius: 0.3}}}
    unknown: local_costmap/inflation_layer/robot_radius: unknown parameter, nothing reads it
"""


def cases(table):
    """(tree, line) of each case of a table."""
    found = re.findall(r"((?:^\S.*\n)+)((?:^ .*\n)+)", table, re.MULTILINE)
    return [
        pytest.param(yaml.safe_load(tree), " ".join(line.split()), id=" ".join(tree.split()))
        for tree, line in found
    ]


def problems(tree):
    with pytest.raises(InputError) as caught:
        load(tree, "/nav")
    return caught.value.problems


def remarks(tree):
    """kind: line of each remark; the costmaps have sources, so that none is on empty costmaps."""
    tree = {"global_costmap": dict(SEEING), "local_costmap": dict(SEEING), **tree}
    found = load(tree, "/nav").remarks
    return [f"{remark.kind}: {remark}".replace("/nav/", "") for remark in found]


def planner(**parameters):
    return {"TrajectoryPlannerROS": parameters}


def slow(**parameters):
    return {
        "recovery_behaviors": [{"name": "slow", "type": "MoveSlowAndClear"}],
        "slow": parameters,
    }


@pytest.mark.parametrize("tree, line", cases(FAULTS))
def test_fault_is_named_with_place_and_expectation(tree, line):
    assert problems(tree) == [f"/nav/{line}"]


def test_all_faults_are_reported_at_once():
    told = problems(
        {
            "conservative_reset_dist": "far",
            "TrajectoryPlannerROS": {"sim_time": 0},
            "NavfnROS": {"allow_unknown": "no"},
            "global_costmap": {"width": None},
            "local_costmap": {"circumscribed_radius": "wide", "cost_scaling_factor": [1]},
        }
    )
    assert [line.split(":")[0] for line in told] == [
        "/nav/conservative_reset_dist",
        "/nav/TrajectoryPlannerROS/sim_time",
        "/nav/NavfnROS/allow_unknown",
        "/nav/global_costmap/width",
        "/nav/local_costmap/cost_scaling_factor",  # where it was written, not where it goes
        "/nav/local_costmap/circumscribed_radius",
    ]


def test_tree_that_is_not_a_mapping():
    assert problems([1]) == ["/nav: [1] is not a parameter tree; expected names with values"]


def test_whole_numbers_are_taken_for_doubles_and_the_other_way_round():
    configuration = load({"local_costmap": {"update_frequency": 10, "width": 3.0}}, "")
    assert configuration.local_costmap.update_frequency_hz == 10.0
    assert configuration.local_costmap.width_m == 3.0
    assert isinstance(configuration.to_tree()["local_costmap"]["width"], int)


@pytest.mark.parametrize("tree, line", cases(REMARKS))
def test_remark(tree, line):
    assert line in remarks(tree)


def test_ordinary_parameters_need_no_remark():
    assert remarks({"controller_frequency": 10.0, **planner(max_vel_x=0.5, dwa=True)}) == []


def test_old_names_work_unless_the_new_one_is_set():
    alone = load(planner(gdist_scale=2.0, min_in_place_rotational_vel=0.3), "").local_planner
    assert (alone.goal_distance_bias, alone.min_in_place_vel_theta_radps) == (2.0, 0.3)
    both = load(planner(gdist_scale=2.0, goal_distance_bias=1.0), "").local_planner
    assert both.goal_distance_bias == 1.0


def test_rollouts_assume_the_planners_own_rate_then_the_nodes():
    own = {**planner(controller_frequency=20.0), "controller_frequency": 5.0}
    assert load(own, "").local_planner_period_s == 0.05
    assert load({"controller_frequency": 5.0}, "").local_planner_period_s == 0.2
    assert load(planner(controller_frequency=-1.0), "").local_planner_period_s == 0.05


def test_listed_recoveries_keep_their_order_and_parameters():
    tree = {
        "recovery_behaviors": [
            {"name": "look", "type": "rotate_recovery/RotateRecovery"},
            {"name": "forget", "type": "ClearCostmapRecovery"},
        ],
        "forget": {"reset_distance": 0.5, "layer_names": ["obstacles"], "affected_maps": "local"},
        "look": {"frequency": 10},
        **planner(max_vel_theta=0.7, yaw_goal_tolerance=0.2),
    }
    configuration = load(tree, "")
    assert configuration.recoveries == (
        (
            "look",
            RotateParams(
                frequency_hz=10.0,
                limits=TurnLimits(max_vel_theta_radps=0.7, yaw_goal_tolerance_rad=0.2),
            ),
        ),
        (
            "forget",
            ClearCostmapParams(
                reset_distance_m=0.5, layer_names=("obstacles",), affected_maps="local"
            ),
        ),
    )
    assert configuration.navigator.recovery_behaviors == (
        ("look", "rotate_recovery/RotateRecovery"),
        ("forget", "clear_costmap_recovery/ClearCostmapRecovery"),
    )


@pytest.mark.parametrize(
    "listed",
    [
        3,
        ["rotate_recovery"],
        [{"name": "turn", "type": "RotateRecovery"}, {"name": "x", "type": "my_cpp/Recovery"}],
        [{"name": "turn", "type": "RotateRecovery"}, {"name": "turn", "type": "RotateRecovery"}],
    ],
)
def test_a_list_of_recoveries_with_a_mistake_leaves_the_default_ones(listed):
    flown = load({"recovery_behaviors": listed}, "")
    assert flown.recoveries == load({}, "").recoveries
    assert len(flown.recoveries) == 4
    assert load(flown.to_tree(), "").recoveries == flown.recoveries
    assert load({"recovery_behaviors": []}, "").recoveries == ()  # as it was written


def test_move_slow_limits_every_speed_of_the_planner():
    ((name, params),) = load(slow(limited_trans_speed=0.1, clearing_distance=1), "").recoveries
    assert name == "slow"
    assert params == MoveSlowAndClearParams(
        clearing_distance_m=1.0,
        limited_trans_speed_mps=0.1,
        translation_fields=("max_vel_x_mps", "min_vel_x_mps", "escape_vel_mps"),
        rotation_fields=(
            "max_vel_theta_radps",
            "min_vel_theta_radps",
            "min_in_place_vel_theta_radps",
            "max_rotational_vel_radps",
        ),
    )


def test_move_slow_limits_the_chosen_local_planner():
    tree = {
        **slow(planner_namespace="DWAPlannerROS", max_trans_param_name="max_trans_vel"),
        "base_local_planner": "dwa_local_planner/DWAPlannerROS",
    }
    assert remarks(tree) == []
    ((_, params),) = load(tree, "").recoveries
    assert params.translation_fields == (
        "max_vel_trans_mps",
        "min_vel_trans_mps",
        "max_vel_x_mps",
        "min_vel_x_mps",
        "max_vel_y_mps",
        "min_vel_y_mps",
    )
    assert params.rotation_fields == ("max_vel_theta_radps", "min_vel_theta_radps")


def test_names_of_speeds_may_be_upstream_or_of_the_planner():
    names = {
        "planner_namespace": "TrajectoryPlannerROS",
        "max_trans_param_name": "max_vel_x",
        "max_rot_param_name": "max_rot_vel",
    }
    assert remarks(slow(**names)) == []
    ((_, named),) = load(slow(**names), "").recoveries
    assert named.limit == load(slow(), "").recoveries[0][1].limit


def test_no_rotation_when_it_is_not_allowed():
    recoveries = load({"clearing_rotation_allowed": False}, "").recoveries
    assert [name for name, _ in recoveries] == ["conservative_reset", "aggressive_reset"]


def test_radii_of_move_base_itself():
    tree = {"local_costmap": {"circumscribed_radius": 0.5}}
    configuration = load(tree, "")
    assert dict(configuration.recoveries)["aggressive_reset"].reset_distance_m == 2.0
    assert configuration.clearing_radius_m == 0.5
    assert load({**tree, "clearing_radius": 0.7}, "").clearing_radius_m == 0.7
