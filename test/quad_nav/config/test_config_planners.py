"""Choice of planners: their parameters, and remarks on those that are not chosen."""

from __future__ import annotations

import numpy as np
import pytest

from quad_nav.config import load, planners, reconfigurable, updated, values
from quad_nav.control.dwa_planner import DwaParams
from quad_nav.errors import InputError
from quad_nav.plan.carrot import Carrot, CarrotParams
from quad_nav.plan.global_planner import SearchPlanner, SearchPlannerParams
from quad_nav.plan.navfn import Navfn, NavfnParams
from quad_nav.scenario.assembly import apply_configuration, build_navigator

SEEING = {"observation_sources": "scan", "scan": {"data_type": "LaserScan"}}
DWA = {"base_local_planner": "dwa_local_planner/DWAPlannerROS"}
SEARCH = {"base_global_planner": "global_planner/GlobalPlanner"}


def told(tree):
    """(kind, line) of each remark; the costmaps have sources, so that none is on empty costmaps."""
    tree = {"global_costmap": dict(SEEING), "local_costmap": dict(SEEING), **tree}
    return [(remark.kind, str(remark)) for remark in load(tree, "/nav").remarks]


@pytest.mark.parametrize(
    "name, namespace, planner, params",
    [
        (
            "navfn/NavfnROS",
            {"NavfnROS": {"allow_unknown": False}},
            Navfn,
            NavfnParams(allow_unknown=False),
        ),
        (
            "global_planner/GlobalPlanner",
            {"GlobalPlanner": {"use_dijkstra": False, "cost_factor": 1, "orientation_mode": 2}},
            SearchPlanner,
            SearchPlannerParams(use_dijkstra=False, cost_factor=1.0, orientation_mode=2),
        ),
        ("carrot_planner/CarrotPlanner", {}, Carrot, CarrotParams()),
        ("CarrotPlanner", {}, Carrot, CarrotParams()),
    ],
)
def test_chosen_planner_is_built_with_its_parameters(name, namespace, planner, params):
    configuration = load({"base_global_planner": name, **namespace})
    navigator = build_navigator(configuration)

    assert configuration.global_planner == params
    assert isinstance(navigator.planner, planner)
    assert navigator.planner.params == params


@pytest.mark.parametrize(
    "key, name", [(key, name) for key, slot in planners.SLOTS.items() for name in slot.types]
)
def test_every_planner_that_can_be_chosen_can_be_built(key, name):
    configuration = load({key: name})
    navigator = build_navigator(configuration)
    made = {"base_global_planner": navigator.planner, "base_local_planner": navigator.controller}
    chosen = {
        "base_global_planner": configuration.global_planner,
        "base_local_planner": configuration.local_planner,
    }
    assert made[key].params == chosen[key]
    apply_configuration(navigator, configuration)


def test_carrot_has_the_footprint_in_force():
    configuration = load({"base_global_planner": "carrot_planner/CarrotPlanner"})
    navigator = build_navigator(configuration)
    np.testing.assert_array_equal(navigator.planner.footprint, navigator.global_costmap.footprint)

    configuration = updated(configuration, "global_costmap", {"robot_radius": 0.2})
    apply_configuration(navigator, configuration)

    assert np.abs(navigator.planner.footprint).max() == pytest.approx(0.21)


@pytest.mark.parametrize(
    "tree, kind, line",
    [
        (
            {"GlobalPlanner": {"anything": 1}},
            "unused",
            "GlobalPlanner: unused: base_global_planner is navfn/NavfnROS; expected"
            " base_global_planner=global_planner/GlobalPlanner to fly with it",
        ),
        (
            {**SEARCH, "NavfnROS": {"allow_unknown": 3}},
            "unused",
            "NavfnROS: unused: base_global_planner is global_planner/GlobalPlanner; expected"
            " base_global_planner=navfn/NavfnROS to fly with it",
        ),
        (
            {**SEARCH, "GlobalPlanner": {"default_tolerance": 0.5}},
            "ignored",
            "GlobalPlanner/default_tolerance: ignored by move_base: read and never used",
        ),
        (
            {**SEARCH, "GlobalPlanner": {"use_djikstra": True}},
            "unknown",
            "GlobalPlanner/use_djikstra: unknown parameter, nothing reads it; did you mean"
            " use_dijkstra?",
        ),
        (
            {"base_global_planner": "GlobalPlanner"},
            "renamed",
            "base_global_planner: GlobalPlanner is an old name of global_planner/GlobalPlanner",
        ),
        (
            {"TebLocalPlannerROS": {}},
            "unsupported",
            "TebLocalPlannerROS: planner not supported; its parameters are not read",
        ),
    ],
    ids=str,
)
def test_only_remark(tree, kind, line):
    assert told(tree) == [(kind, "/nav/" + line)]


def test_dwa_flies_with_its_own_parameters_and_those_at_the_nodes_level():
    tree = {
        **DWA,
        "latch_xy_goal_tolerance": True,
        "controller_frequency": 5.0,
        "DWAPlannerROS": {"max_vel_x": 0.3, "controller_frequency": 10.0},
    }

    configuration = load(tree, "/nav")

    assert configuration.local_planner == DwaParams(
        max_vel_x_mps=0.3, latch_xy_goal_tolerance=True, controller_frequency_hz=10.0
    )
    assert configuration.local_planner_period_s == 0.1
    assert [line for kind, line in told(tree)] == [
        "/nav/DWAPlannerROS/controller_frequency: rollouts assume 10.0 Hz, but the control"
        " loop runs at 5.0 Hz"
    ]
    changed = updated(configuration, "DWAPlannerROS", {"max_vel_x": 0.2})
    assert changed.local_planner.max_vel_x_mps == 0.2
    assert list(reconfigurable(changed))[:2] == ["", "DWAPlannerROS"]


def test_rotations_read_limits_of_the_trajectory_planner_when_it_is_not_chosen():
    tree = {**DWA, "TrajectoryPlannerROS": {"max_vel_theta": 0.4, "max_vel_x": "not read"}}

    configuration = load(tree, "/nav")

    assert dict(configuration.recoveries)["rotate_recovery"].limits.max_vel_theta_radps == 0.4
    assert told(tree) == [
        (
            "unused",
            "/nav/TrajectoryPlannerROS: unused: base_local_planner is"
            " dwa_local_planner/DWAPlannerROS; expected"
            " base_local_planner=base_local_planner/TrajectoryPlannerROS to fly with it;"
            " rotate_recovery still reads its limits",
        )
    ]
    assert "TrajectoryPlannerROS" not in reconfigurable(configuration)
    tree["TrajectoryPlannerROS"]["max_vel_theta"] = "fast"
    with pytest.raises(InputError, match="TrajectoryPlannerROS/max_vel_theta: 'fast' is not a"):
        load(tree)


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

    changed = updated(configuration, "GlobalPlanner", {"cost_factor": 9.0, "orientation_mode": 3})

    assert changed.global_planner == SearchPlannerParams(
        neutral_cost=60, cost_factor=5.0, orientation_mode=3
    )
    assert changed.local_planner == configuration.local_planner
    navigator = build_navigator(configuration)
    apply_configuration(navigator, changed)
    assert navigator.planner.params.cost_factor == 5.0


def test_local_planner_is_reconfigurable_beside_any_global_one():
    changed = updated(load(SEARCH), "TrajectoryPlannerROS", {"max_vel_x": 0.2})
    assert changed.local_planner.max_vel_x_mps == 0.2
    assert changed.global_planner == SearchPlannerParams()


def test_planners_without_reconfigurable_parameters():
    for name in ("NavfnROS", "CarrotPlanner"):
        with pytest.raises(InputError, match=f"^{name}: not reconfigurable"):
            updated(load({"base_global_planner": name}), name, {})


def test_planners_cannot_change_in_flight():
    with pytest.raises(
        InputError,
        match="^base_global_planner: planners cannot change in flight, got 'navfn/NavfnROS';"
        " expected global_planner/GlobalPlanner$",
    ):
        updated(load(SEARCH), "", {"base_global_planner": "navfn/NavfnROS"})
    same = updated(load(SEARCH), "", {**SEARCH, "planner_frequency": 1.0})
    assert same.navigator.planner_frequency_hz == 1.0


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
            {"base_local_planner": "teb_local_planner/TebLocalPlannerROS"},
            "base_local_planner: teb_local_planner/TebLocalPlannerROS is not supported; expected"
            " --set base_local_planner=dwa_local_planner/DWAPlannerROS or"
            " base_local_planner/TrajectoryPlannerROS",
        ),
        (
            {"base_local_planner": "teb", "TrajectoryPlannerROS": {"max_vel_x": 0.5}},
            "base_local_planner: teb is not supported; expected"
            " --set base_local_planner=base_local_planner/TrajectoryPlannerROS or"
            " dwa_local_planner/DWAPlannerROS",
        ),
    ],
)
def test_planner_that_is_not_supported_is_refused_with_one_that_has_parameters(tree, fault):
    with pytest.raises(InputError) as caught:
        load(tree)
    assert caught.value.problems == [f"/{fault}"]


def test_invalid_choice():
    for value, expected in (
        (3, "3 is not a string; expected a plugin's name"),
        (None, "None is not a string; expected a plugin's name"),
    ):
        with pytest.raises(InputError, match=expected):
            load({"base_global_planner": value})
