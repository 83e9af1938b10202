"""Upstream bugs: fixed by default, and ``fixes/upstream`` restores them."""

from __future__ import annotations

import numpy as np
import pytest
from upstream import UPSTREAM

from quad_nav.config import load, updated
from quad_nav.geometry import Pose2D, Pose3D, Scan, Twist2D
from quad_nav.grid import LETHAL
from quad_nav.navigator.control_supervisor import ProgressParams
from quad_nav.navigator.tick import RobotPoses
from quad_nav.peers.peer_params import PeerParams
from quad_nav.recovery import RecoveryContext
from quad_nav.scenario.assembly import build_navigator, set_footprint

LIDAR = {
    "data_type": "LaserScan",
    "marking": True,
    "clearing": False,
    "max_obstacle_height": 2.0,
    "expected_update_rate": 21.0,
}
TREE = {
    name: {"observation_sources": "scan", "scan": LIDAR, "obstacle_range": 5.0}
    for name in ("global_costmap", "local_costmap")
}
HERE = Pose2D(5.0, 5.0)


def navigator_with(tree):
    return build_navigator(load({**TREE, **tree}))


def see_a_wall_three_metres_ahead(navigator, now_s=0.0):
    scan = Scan(now_s, 0.0, 0.01, 0.02, 60.0, np.full(2, 3.0, dtype=np.float32))
    for costmap in (navigator.global_costmap, navigator.local_costmap):
        costmap.layers["obstacle_layer"].add_scan("scan", scan, Pose3D(5.0, 5.0, 1.0), now_s)
        costmap.update(now_s, HERE)


def test_fixes_are_on_by_default_and_upstream_switches_all_off():
    defaults, upstream = load({}), load(UPSTREAM)
    assert defaults.navigator.progress == ProgressParams(10.0, 0.1, 0.1)
    assert upstream.navigator.progress == ProgressParams(0.0, 0.1, 1.0)
    assert defaults.navigator.escape_collision and defaults.navigator.sensor_timeout_s == 1.0
    assert not upstream.navigator.escape_collision and upstream.navigator.sensor_timeout_s == 0.0
    assert defaults.peers == PeerParams(True, 0.05, 0.5, True, True)
    assert upstream.peers == PeerParams(False, 0.05, 0.5, False, False)
    assert defaults.scan_validator.reject_implausible_scans
    assert not upstream.scan_validator.reject_implausible_scans


def test_upstream_wins_over_the_parameters_of_deviations():
    ours = {"sensor_timeout": 3.0, "peers": {"avoid_peers": True, "margin": 0.2}}
    configuration = load({**ours, **UPSTREAM})
    assert configuration.navigator.sensor_timeout_s == 0.0
    assert not configuration.peers.avoid_peers and configuration.peers.margin_m == 0.2
    configuration = updated(configuration, "fixes", {"upstream": False})
    assert configuration.navigator == load(ours).navigator
    assert configuration.peers == load(ours).peers


def test_upstream_keeps_the_patience_of_the_first_reconfiguration():
    """move_base has its own value until it is reconfigured itself."""
    configuration = updated(load({}), "fixes", {"upstream": True})
    assert configuration.navigator.controller_patience_s == 15.0
    configuration = updated(configuration, "", {"planner_patience": 4.0})
    configuration = updated(configuration, "fixes", {"upstream": False})
    assert configuration.navigator.controller_patience_s == 5.0


@pytest.mark.parametrize(
    "old, new",
    [
        ("avoid_peers", "peers/avoid_peers"),
        ("peer_margin", "peers/margin"),
        ("progress_timeout", "progress_timeout"),
        ("sensor_timeout", "sensor_timeout"),
        ("respect_meter_scoring", "TrajectoryPlannerROS/respect_meter_scoring"),
        ("stop_after_rotation", "fixes/upstream"),
    ],
)
def test_an_old_name_is_remarked_on_with_the_new_one(old, new):
    (remark,) = [one for one in load({"fixes": {old: False}}).remarks if "fixes" in one.place]
    assert str(remark) == f"/fixes/{old}: nothing reads it here; did you mean {new}?"


@pytest.mark.parametrize("tree, is_left", [({}, False), (UPSTREAM, True)])
def test_the_default_recovery_clears_any_obstacle_layer(tree, is_left):
    navigator = navigator_with(tree)
    see_a_wall_three_metres_ahead(navigator)
    grid = navigator.global_costmap.layers["obstacle_layer"].grid.costs
    assert (grid == LETHAL).any()
    clear = navigator.recoveries[0].behaviour  # beyond 3 m / 2
    clear.step(RecoveryContext(0.0, navigator.global_costmap, navigator.local_costmap, HERE, HERE))
    assert (grid == LETHAL).any() == is_left


@pytest.mark.parametrize("tree", [{}, UPSTREAM])
def test_deviations_reach_planner_and_recoveries(tree):
    navigator = navigator_with(tree)
    on = not tree
    assert navigator.controller.params.reject_colliding_escape is on
    assert navigator.controller.params.end_blocked_escape is on
    assert navigator.controller.params.predict_goal_turn is on
    assert navigator.recoveries[1].behaviour.params.stop_after_rotation is on
    dwa = build_navigator(load({**tree, "base_local_planner": "dwa_local_planner/DWAPlannerROS"}))
    assert dwa.controller.params.predict_goal_turn is on


def test_switching_fixes_in_flight_changes_every_owner_but_the_recoveries():
    upstream = load(UPSTREAM)
    switched = updated(load({}), "fixes", UPSTREAM["fixes"])
    assert switched.navigator == upstream.navigator
    assert switched.local_planner == upstream.local_planner
    assert (switched.peers, switched.scan_validator) == (upstream.peers, upstream.scan_validator)
    assert switched.recoveries == load({}).recoveries != upstream.recoveries


@pytest.mark.parametrize("own, leaves", [({}, True), ({"escape_collision": False}, False)])
def test_a_robot_in_collision_escapes(own, leaves):
    """Its back is 0.36 m behind it, in the cell of the wall at 0.38 m."""
    away = Pose2D(5.0, 5.0, 3.14)
    node = {
        "robot_radius": 0.35,
        "plugins": [
            {"name": "obstacle_layer", "type": "costmap_2d::ObstacleLayer"},
            {"name": "inflation_layer", "type": "costmap_2d::InflationLayer"},
        ],
        "obstacle_layer": {**TREE["local_costmap"], "footprint_clearing_enabled": False},
    }
    navigator = build_navigator(
        load(
            {
                "global_costmap": node,
                "local_costmap": {**node, "rolling_window": True, "width": 4.0, "height": 4.0},
                **own,
            }
        )
    )
    scan = Scan(0.0, -0.05, 0.05, 0.02, 60.0, np.full(3, 0.38, dtype=np.float32))
    for costmap in (navigator.global_costmap, navigator.local_costmap):
        costmap.layers["obstacle_layer"].add_scan("scan", scan, Pose3D(5.0, 5.0, 1.0), 0.0)
    navigator.set_goal(Pose2D(2.0, 5.0, 3.14), 0.0)
    tick = navigator.tick(0.0, RobotPoses(away, away), Twist2D())
    assert any("every trajectory collides" in warning for warning in tick.warnings)
    assert tick.command == (Twist2D(0.1) if leaves else Twist2D())


@pytest.mark.parametrize(
    "tree, stale_after_s",
    [({}, 1.0), ({"sensor_timeout": 0.0}, 21.0), ({"sensor_timeout": 3.0}, 3.0)],
)
def test_sensor_timeout_limits_the_expected_update_rate(tree, stale_after_s):
    navigator = navigator_with(tree)
    see_a_wall_three_metres_ahead(navigator, 10.0)
    assert navigator.local_costmap.is_current(10.0 + stale_after_s)
    assert not navigator.local_costmap.is_current(10.1 + stale_after_s)


@pytest.mark.parametrize("tree, reach_m", [({}, 1.01), (UPSTREAM, 0.47)])
def test_trajectory_planner_follows_the_footprint_in_force(tree, reach_m):
    """Upstream's keeps the one of its start, here of the default radius 0.46 m and padding."""
    configuration = load(tree)
    navigator = build_navigator(configuration)
    square = np.array([(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)])
    set_footprint(navigator, configuration, navigator.local_costmap, square)
    assert np.abs(navigator.controller.footprint).max() == pytest.approx(reach_m)
