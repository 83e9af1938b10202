"""The shipped configurations with moving obstacles are overlays on `config/default`."""

from __future__ import annotations

import pytest

from quad_moving.evasion import Evasion, EvasionParams
from quad_moving.tracker import Tracker
from quad_nav import config
from quad_nav.config.plugins import Parameters
from quad_nav.config.robot_tree import RobotSource, robot_tree
from quad_nav.errors import InputError
from quad_nav.scenario.assembly import build_navigator, build_scan_filters


@pytest.mark.parametrize("name", ["moving", "people"])
def test_an_overlay_has_the_values_of_the_default_and_its_own(name):
    default, moving = (config.load(robot_tree(RobotSource(one, 3))) for one in ("default", name))
    assert moving.remarks == ()
    assert moving.global_costmap == default.global_costmap
    assert moving.local_costmap.layers == default.local_costmap.layers
    assert moving.local_planner.max_vel_x_mps == 0.5 and moving.local_planner.holonomic_robot
    assert [one for one, _ in moving.scan_filters] == ["validator", "tracker"]
    assert [one for one, _ in moving.command_filters] == ["evasion", "peers"]


def test_the_filters_have_the_parameters_of_their_namespaces():
    tree = robot_tree(RobotSource("people", 0))
    tree["tracker"] = {"timeout": 2.0}
    configuration = config.load(tree)
    tracker = build_scan_filters(configuration).filters[1]
    evasion = build_navigator(configuration).filters.filters[0]
    assert isinstance(tracker, Tracker) and tracker.params.lost_after_s == 2.0
    assert isinstance(evasion, Evasion)
    expected = EvasionParams(max_speed_mps=1.0, horizon_s=0.0, max_acceleration_mps2=6.0)
    assert evasion.params == expected


@pytest.mark.parametrize(
    "name, value, problem",
    [
        ("speed", 1.0, "evasion/speed: unknown; expected one of clearance, max_speed"),
        ("clearance", 3.0, "evasion/clearance: 3.0 is out of range; expected 0 to 2 m"),
    ],
)
def test_a_wrong_parameter_is_refused(name, value, problem):
    with pytest.raises(InputError, match=problem):
        Evasion(Parameters({name: value}, "evasion"))
    tree = robot_tree(RobotSource("people", 0))
    tree["evasion"] = {name: value}
    with pytest.raises(InputError, match=problem.partition(": ")[2]):  # before anything flies
        config.load(tree)
