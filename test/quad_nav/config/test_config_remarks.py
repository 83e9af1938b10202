"""Remarks on legal parameters: unknown, unsupported, ignored, clamped, renamed, caution."""

from __future__ import annotations

import pytest

from quad_nav.config import load
from quad_nav.recovery import ClearCostmapParams, MoveSlowAndClearParams, RotateParams, TurnLimits

SEEING = {"observation_sources": "scan", "scan": {"data_type": "LaserScan"}}


def remarks(tree):
    """(kind, line) of each remark; the costmaps have sources, so that none is on empty costmaps."""
    tree = {"global_costmap": dict(SEEING), "local_costmap": dict(SEEING), **tree}
    return [(remark.kind, str(remark)) for remark in load(tree, "/nav").remarks]


def planner(**parameters):
    return {"TrajectoryPlannerROS": parameters}


def dwa(**parameters):
    return {"base_local_planner": "dwa_local_planner/DWAPlannerROS", "DWAPlannerROS": parameters}


def slow(**parameters):
    return {
        "recovery_behaviors": [{"name": "slow", "type": "MoveSlowAndClear"}],
        "slow": parameters,
    }


@pytest.mark.parametrize(
    "tree, kind, line",
    [
        (
            {"recovery_behaviour_enabled": True},
            "unknown",
            "recovery_behaviour_enabled: unknown parameter, nothing reads it; did you mean"
            " recovery_behavior_enabled?",
        ),
        ({"zzz": 1}, "unknown", "zzz: unknown parameter, nothing reads it"),
        (
            planner(max_vel_y=0.0),
            "unknown",
            "TrajectoryPlannerROS/max_vel_y: unknown parameter, nothing reads it; did you mean"
            " max_vel_x?",
        ),
        (
            planner(path_distance_bias=32.0),
            "clamped",
            "TrajectoryPlannerROS/path_distance_bias: 32.0 clamped to 5.0, the largest that"
            " move_base allows",
        ),
        (
            planner(min_vel_theta=0.4),
            "clamped",
            "TrajectoryPlannerROS/min_vel_theta: 0.4 clamped to 0.0, the largest that"
            " move_base allows",
        ),
        (
            planner(vx_samples=0),
            "clamped",
            "TrajectoryPlannerROS/vx_samples: 0 clamped to 1, the smallest that move_base allows",
        ),
        (
            planner(vx_samples=6.5),
            "clamped",
            "TrajectoryPlannerROS/vx_samples: 6.5 rounded to 7; expected a whole number",
        ),
        (
            planner(pdist_scale=2.0),
            "renamed",
            "TrajectoryPlannerROS/pdist_scale: old name of path_distance_bias",
        ),
        (
            planner(pdist_scale=2.0, path_distance_bias=1.0),
            "ignored",
            "TrajectoryPlannerROS/pdist_scale: ignored by move_base: path_distance_bias is set too",
        ),
        (
            planner(acc_limit_x=2.0),
            "ignored",
            "TrajectoryPlannerROS/acc_limit_x: ignored by move_base: renamed to acc_lim_x",
        ),
        (
            planner(meter_scoring=False),
            "ignored",
            "TrajectoryPlannerROS/meter_scoring: ignored by move_base: distances are always scored"
            " in"
            " metres",
        ),
        (
            planner(world_model="costmap"),
            "unsupported",
            "TrajectoryPlannerROS/world_model: not supported by this package: the costmap is"
            " the only world model",
        ),
        (
            planner(escape_vel=0.1),
            "caution",
            "TrajectoryPlannerROS/escape_vel: the robot escapes forwards; expected a negative"
            " velocity, to back up",
        ),
        (
            {**planner(controller_frequency=20.0), "controller_frequency": 5.0},
            "caution",
            "TrajectoryPlannerROS/controller_frequency: rollouts assume 20.0 Hz, but the control"
            " loop runs"
            " at 5.0 Hz",
        ),
        (
            {"GlobalPlanner": {"anything": 1}},
            "unused",
            "GlobalPlanner: unused: base_global_planner is navfn/NavfnROS; expected"
            " base_global_planner=global_planner/GlobalPlanner to fly with it",
        ),
        (
            {"base_global_planner": "GlobalPlanner", "GlobalPlanner": {"default_tolerance": 0.5}},
            "ignored",
            "GlobalPlanner/default_tolerance: ignored by move_base: read and never used",
        ),
        (
            dwa(max_trans_vel=0.7),
            "ignored",
            "DWAPlannerROS/max_trans_vel: ignored by move_base: renamed to max_vel_trans",
        ),
        (
            dwa(acc_lim_x=30.0),
            "clamped",
            "DWAPlannerROS/acc_lim_x: 30.0 clamped to 20.0, the largest that move_base allows",
        ),
        (
            dwa(occdist_scale=0),
            "caution",
            "DWAPlannerROS/occdist_scale: 0 disables the scoring of obstacles: the robot may hit"
            " them",
        ),
        (
            {**dwa(), **planner(max_vel_theta=0.4)},
            "unused",
            "TrajectoryPlannerROS: unused: base_local_planner is"
            " dwa_local_planner/DWAPlannerROS; expected"
            " base_local_planner=base_local_planner/TrajectoryPlannerROS to fly with it;"
            " rotate_recovery still reads its limits",
        ),
        (
            {"TebLocalPlannerROS": {"max_vel_x": 1.0}},
            "unsupported",
            "TebLocalPlannerROS: planner not supported; its parameters are not read",
        ),
        (
            {"TrajectoryPlannerROS": {"y_vels": [-0.3, 0.3]}},
            "ignored",
            "TrajectoryPlannerROS/y_vels: ignored by move_base: it is a list; expected a string,"
            " as in '-0.3, 0.3'",
        ),
        (
            {"DWAPlannerROS": {"max_vel_x": 1.0}},
            "unused",
            "DWAPlannerROS: unused: base_local_planner is base_local_planner/TrajectoryPlannerROS;"
            " expected base_local_planner=dwa_local_planner/DWAPlannerROS to fly with it",
        ),
        (
            {"base_global_planner": "NavfnROS"},
            "renamed",
            "base_global_planner: NavfnROS is an old name of navfn/NavfnROS",
        ),
        (
            {"aggressive_reset": {"reset_distance": 0.5}},
            "ignored",
            "aggressive_reset/reset_distance: ignored by move_base: without recovery_behaviors it"
            " is"
            " 1.84",
        ),
        (
            {
                "recovery_behaviors": [{"name": "clear", "type": "ClearCostmapRecovery"}],
                "clear": {"affected_maps": "all"},
            },
            "caution",
            "clear/affected_maps: 'all' clears both; expected local, global or both",
        ),
        (
            {"recovery_behaviors": [{"name": "back", "type": "twist_recovery/TwistRecovery"}]},
            "unsupported",
            "recovery_behaviors/back: twist_recovery/TwistRecovery is not supported, skipping"
            " this behaviour; expected one of clear_costmap_recovery/ClearCostmapRecovery,"
            " rotate_recovery/RotateRecovery, move_slow_and_clear/MoveSlowAndClear",
        ),
        (
            slow(planner_namespace="DWAPlannerROS", max_trans_param_name="max_vel_trans"),
            "caution",
            "slow/planner_namespace: DWAPlannerROS is not the local planner; limiting"
            " TrajectoryPlannerROS instead",
        ),
        (
            slow(max_rot_param_name="max_vel_thet"),
            "caution",
            "slow/max_rot_param_name: TrajectoryPlannerROS has no speed parameter"
            " max_vel_thet; did you mean max_vel_theta?",
        ),
        (
            slow(limited_speed=0.1),
            "unknown",
            "slow/limited_speed: unknown parameter, nothing reads it; did you mean"
            " limited_rot_speed?",
        ),
        (
            {"local_costmap": {**SEEING, "plugins": []}},
            "ignored",
            "local_costmap/observation_sources: ignored by move_base: with plugins, expected"
            " in the obstacle layer's namespace",
        ),
        (
            {"local_costmap": {"plugins": [], "inflation_radius": 1.0}},
            "ignored",
            "local_costmap/inflation_radius: ignored by move_base: plugins has no"
            " costmap_2d::InflationLayer",
        ),
        (
            {"local_costmap": {"plugins": [], "inflater": {"inflation_radius": 1.0}}},
            "ignored",
            "local_costmap/inflater: ignored by move_base: plugins has no layer of this name",
        ),
        (
            {"local_costmap": {"plugins": [], "map_type": "costmap"}},
            "ignored",
            "local_costmap/map_type: ignored by move_base: it is unused beside plugins",
        ),
        (
            {"local_costmap": {"plugins": [], "static_map": True}},
            "ignored",
            "local_costmap/static_map: ignored by move_base: plugins has no"
            " costmap_2d::StaticLayer",
        ),
        (
            {"local_costmap": {}},
            "caution",
            "local_costmap: no map and no observation_sources: this costmap never has obstacles",
        ),
        (
            {"local_costmap": {**SEEING, "obstacle_layer": {"rear": {"topic": "scan1"}}}},
            "caution",
            "local_costmap/obstacle_layer/rear: looks like a source, but observation_sources"
            " does not list it; not read",
        ),
        (
            {"local_costmap": {"observation_sources": "scan", "scan": {"topic": "scan0"}}},
            "caution",
            "local_costmap/scan: no data_type: move_base subscribes to a PointCloud",
        ),
        (
            {"local_costmap": {**SEEING, "inflation_layer": {"robot_radius": 0.3}}},
            "unknown",
            "local_costmap/inflation_layer/robot_radius: unknown parameter, nothing reads it",
        ),
    ],
    ids=str,
)
def test_remark(tree, kind, line):
    assert (kind, "/nav/" + line) in remarks(tree)


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
