"""Choice of planners and their parameters; ``test_config_remarks`` has the remarks on them."""

from __future__ import annotations

import numpy as np
import pytest

from quad_nav.config import load, planners, reconfigurable, updated, values
from quad_nav.control.dwa_planner import DwaParams
from quad_nav.errors import InputError
from quad_nav.plan.carrot import Carrot, CarrotParams
from quad_nav.plan.global_planner import SearchPlanner, SearchPlannerParams
from quad_nav.plan.navfn import Navfn, NavfnParams
from quad_nav.recovery import TurnLimits
from quad_nav.scenario.assembly import apply_configuration, build_navigator

DWA = {"base_local_planner": "dwa_local_planner/DWAPlannerROS"}
SEARCH = {"base_global_planner": "global_planner/GlobalPlanner"}
LATCH = "latch_xy_goal_tolerance"


def dwa(namespace, **node_level):
    return load({**DWA, **node_level, "DWAPlannerROS": namespace}, "/nav")


def problems(tree):
    with pytest.raises(InputError) as caught:
        load(tree)
    return caught.value.problems


@pytest.mark.parametrize(
    "name, namespace, planner, params",
    [
        ("navfn/NavfnROS", {"allow_unknown": False}, Navfn, NavfnParams(allow_unknown=False)),
        (
            "global_planner/GlobalPlanner",
            {"use_dijkstra": False, "cost_factor": 1, "orientation_mode": 2},
            SearchPlanner,
            SearchPlannerParams(use_dijkstra=False, cost_factor=1.0, orientation_mode=2),
        ),
        ("CarrotPlanner", {}, Carrot, CarrotParams()),  # an old name
    ],
)
def test_chosen_planner_is_built_with_its_parameters(name, namespace, planner, params):
    configuration = load({"base_global_planner": name, name.split("/")[-1]: namespace})
    navigator = build_navigator(configuration)
    assert configuration.global_planner == navigator.planner.params == params
    assert isinstance(navigator.planner, planner)


@pytest.mark.parametrize(
    "key, name", [(key, name) for key, slot in planners.SLOTS.items() for name in slot.types]
)
def test_every_planner_that_can_be_chosen_can_be_built(key, name):
    configuration = load({key: name})
    navigator = build_navigator(configuration)
    assert navigator.planner.params == configuration.global_planner
    assert navigator.controller.params == configuration.local_planner
    apply_configuration(navigator, configuration)


def test_carrot_has_the_footprint_in_force():
    configuration = load({"base_global_planner": "carrot_planner/CarrotPlanner"})
    navigator = build_navigator(configuration)
    configuration = updated(configuration, "global_costmap", {"robot_radius": 0.2})
    apply_configuration(navigator, configuration)
    assert np.abs(navigator.planner.footprint).max() == pytest.approx(0.21)


def test_an_empty_namespace_of_dwa_is_completed():
    configuration = dwa({})
    assert configuration.local_planner == DwaParams()
    left = configuration.to_tree()["DWAPlannerROS"]
    assert left["vy_samples"] == 10
    assert "sum_scores" not in left  # read once, not on the parameter server


def test_values_of_dwa_reach_their_fields():
    params = dwa(
        {"max_vel_trans": 1.5, "theta_stopped_vel": 0.3, "vth_samples": 7.0, "sum_scores": True}
    ).local_planner
    assert (params.max_vel_trans_mps, params.rot_stopped_velocity_radps) == (1.5, 0.3)
    assert params.vth_samples == 7 and isinstance(params.vth_samples, int)
    assert params.sum_scores


@pytest.mark.parametrize(
    "own, node_level, in_force",
    [({}, {}, False), ({LATCH: True}, {}, True), ({}, {LATCH: True}, True)]
    + [({LATCH: False}, {LATCH: True}, False)],
)
def test_latch_is_inherited(own, node_level, in_force):
    assert dwa(own, **node_level).local_planner.latch_xy_goal_tolerance == in_force


def test_dwa_flies_at_its_own_rate():
    configuration = dwa({"max_vel_x": 0.3, "controller_frequency": 10.0}, controller_frequency=5.0)
    assert configuration.local_planner_period_s == 0.1
    changed = updated(configuration, "DWAPlannerROS", {"max_vel_x": 0.2})
    assert changed.local_planner.max_vel_x_mps == 0.2
    assert list(reconfigurable(changed))[:2] == ["", "DWAPlannerROS"]


def test_rotations_read_limits_of_the_trajectory_planner_when_it_is_not_chosen():
    limits = {"max_vel_theta": 0.4, "max_vel_x": "not read"}
    configuration = dwa({}, TrajectoryPlannerROS=limits)
    rotation = dict(configuration.recoveries)["rotate_recovery"]
    assert rotation.limits == TurnLimits(max_vel_theta_radps=0.4)
    assert "TrajectoryPlannerROS" not in reconfigurable(configuration)
    limits["max_vel_theta"] = "fast"
    with pytest.raises(InputError, match="TrajectoryPlannerROS/max_vel_theta: 'fast' is not a"):
        dwa({}, TrajectoryPlannerROS=limits)


def test_global_planner_is_reconfigurable():
    configuration = load({**SEARCH, "GlobalPlanner": {"neutral_cost": 60}})
    assert list(reconfigurable(configuration))[:3] == ["", "TrajectoryPlannerROS", "GlobalPlanner"]
    assert values(configuration, "GlobalPlanner") == {
        "lethal_cost": 253,
        "neutral_cost": 60,
        "cost_factor": 3.0,
        "publish_potential": True,
        "orientation_mode": 1,
        "orientation_window_size": 1,
        "outline_map": True,
    }
    navigator = build_navigator(configuration)
    changed = updated(configuration, "GlobalPlanner", {"cost_factor": 9.0, "orientation_mode": 3})
    apply_configuration(navigator, changed)
    assert changed.local_planner == configuration.local_planner
    assert navigator.planner.params == SearchPlannerParams(
        neutral_cost=60, cost_factor=5.0, orientation_mode=3
    )


def test_planners_without_reconfigurable_parameters():
    with pytest.raises(InputError, match="^NavfnROS: not reconfigurable"):
        updated(load({}), "NavfnROS", {})


def test_another_planner_has_the_parameters_of_its_namespace():
    """Those that were loaded, or those that a parameter server has by now."""
    tree = {"DWAPlannerROS": {"max_vel_x": 0.3}, "controller_frequency": 5.0}
    changed = updated(load(tree), "", DWA)
    assert changed.local_planner == DwaParams(max_vel_x_mps=0.3)
    assert changed.local_planner_period_s == 0.2
    assert changed.to_tree()["DWAPlannerROS"]["max_vel_x"] == 0.3
    stored = {"DWAPlannerROS": {"max_vel_x": 0.2}}
    assert updated(load(tree), "", DWA, stored).local_planner.max_vel_x_mps == 0.2
    with pytest.raises(InputError, match="DWAPlannerROS/max_vel_x: 'fast' is not a number"):
        updated(load({"DWAPlannerROS": {"max_vel_x": "fast"}}), "", DWA)


def test_defaults_of_another_planner_are_restored_as_it_was_loaded():
    changed = updated(load({"DWAPlannerROS": {"max_vel_x": 0.3}}), "", DWA)
    changed = updated(changed, "DWAPlannerROS", {"max_vel_x": 0.2})
    changed = updated(changed, "DWAPlannerROS", {"restore_defaults": True})
    assert changed.local_planner.max_vel_x_mps == 0.3
    restored = updated(changed, "", {"restore_defaults": True})
    assert restored.navigator.base_local_planner == "base_local_planner/TrajectoryPlannerROS"


@pytest.mark.parametrize("name", ["NavfnROS", "sbpl/SBPLLatticePlanner", "no.such.Planner", ""])
def test_an_unknown_planner_is_refused_in_flight(name):
    with pytest.raises(InputError, match="^/base_global_planner: "):
        updated(load({}), "", {"base_global_planner": name})


@pytest.mark.parametrize(
    "key, name", [(key, name) for key, slot in planners.SLOTS.items() for name in slot.types]
)
def test_planners_change_in_flight_and_back(key, name):
    """Nothing of the planner is left behind, speed limits of recoveries included."""
    listed = {"name": "slow", "type": "move_slow_and_clear/MoveSlowAndClear"}
    before = load({"recovery_behaviors": [listed]})
    navigator = build_navigator(before)
    [(_, slow)] = before.recoveries
    changed = updated(before, "", {key: name})
    apply_configuration(navigator, changed)
    params = navigator.planner.params, navigator.controller.params
    assert params == (changed.global_planner, changed.local_planner)
    fields = navigator.recoveries[0].behaviour.params.translation_fields
    assert fields and all(hasattr(changed.local_planner, field) for field in fields)
    back = updated(changed, "", {key: before.to_tree()[key]})
    apply_configuration(navigator, back)
    assert (back.global_planner, back.local_planner) == (
        before.global_planner,
        before.local_planner,
    )
    assert navigator.recoveries[0].behaviour.params == slow


@pytest.mark.parametrize(
    "tree, fault",
    [
        (
            {"base_global_planner": "sbpl/SBPLLatticePlanner"},
            "base_global_planner: sbpl/SBPLLatticePlanner is not supported; expected --set"
            " base_global_planner=navfn/NavfnROS or global_planner/GlobalPlanner or"
            " carrot_planner/CarrotPlanner",
        ),
        (
            {"base_local_planner": "teb"},
            "base_local_planner: teb is not supported; expected"
            " --set base_local_planner=dwa_local_planner/DWAPlannerROS or"
            " base_local_planner/TrajectoryPlannerROS",
        ),
        (
            {"base_local_planner": "teb", "TrajectoryPlannerROS": {"max_vel_x": 0.5}},
            "base_local_planner: teb is not supported; expected"
            " --set base_local_planner=base_local_planner/TrajectoryPlannerROS or"
            " dwa_local_planner/DWAPlannerROS",
        ),
        (
            {"base_global_planner": None},
            "base_global_planner: None is not a string; expected a plugin's name",
        ),
    ],
)
def test_planner_that_is_not_supported_is_refused_with_one_that_has_parameters(tree, fault):
    assert problems(tree) == [f"/{fault}"]
