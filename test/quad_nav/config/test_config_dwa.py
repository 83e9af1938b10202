"""The namespace of DWAPlannerROS: defaults, old names, inherited latch."""

from __future__ import annotations

import pytest

from quad_nav.config.local_planners import DWA_PLANNER, dwa_params, normalise_dwa
from quad_nav.config.notes import CAUTION, CLAMPED, IGNORED, UNKNOWN, Notes
from quad_nav.control.dwa_planner import DwaParams


def normalised(namespace, **node_level):
    tree, notes = {DWA_PLANNER: namespace, **node_level}, Notes("/move_base0")
    normalise_dwa(tree, notes)
    return tree, notes


def test_an_empty_namespace_is_completed():
    tree, notes = normalised({})
    assert not notes.problems and not notes.remarks
    assert dwa_params(tree) == DwaParams()
    assert tree[DWA_PLANNER]["vy_samples"] == 10
    assert "sum_scores" not in tree[DWA_PLANNER]  # read once, not on the parameter server


def test_values_reach_their_fields():
    tree, _ = normalised(
        {
            "max_vel_trans": 1.5,
            "theta_stopped_vel": 0.3,
            "vth_samples": 7.0,
            "use_dwa": False,
            "sum_scores": True,
        }
    )
    params = dwa_params(tree)
    assert params.max_vel_trans_mps == 1.5
    assert params.rot_stopped_velocity_radps == 0.3
    assert params.vth_samples == 7 and isinstance(params.vth_samples, int)
    assert not params.use_dwa and params.sum_scores


@pytest.mark.parametrize(
    "old, new",
    [
        ("max_trans_vel", "max_vel_trans"),
        ("max_rot_vel", "max_vel_theta"),
        ("acc_lim_th", "acc_lim_theta"),
        ("rot_stopped_vel", "theta_stopped_vel"),
    ],
)
def test_old_names_have_no_effect_and_a_remark(old, new):
    tree, notes = normalised({old: 0.7})
    assert dwa_params(tree) == DwaParams()
    assert [(remark.kind, remark.place) for remark in notes.remarks] == [
        (IGNORED, f"/move_base0/DWAPlannerROS/{old}")
    ]
    assert notes.remarks[0].text == f"ignored by move_base: renamed to {new}"


@pytest.mark.parametrize(
    "own, node_level, in_force",
    [(None, None, False), (True, None, True), (None, True, True), (False, True, False)],
)
def test_latch_is_inherited(own, node_level, in_force):
    name = "latch_xy_goal_tolerance"
    tree, notes = normalised(
        {} if own is None else {name: own}, **({} if node_level is None else {name: node_level})
    )
    assert not notes.problems and not notes.remarks
    assert dwa_params(tree).latch_xy_goal_tolerance == in_force


def test_latch_that_is_not_a_boolean():
    _, notes = normalised({}, latch_xy_goal_tolerance="yes")
    assert notes.problems == [
        "/move_base0/latch_xy_goal_tolerance: 'yes' is not a boolean; expected true or false"
    ]


def test_faults_and_remarks():
    tree, notes = normalised(
        {
            "sim_time": 0.0,
            "vx_samples": 0,
            "acc_lim_x": 30.0,
            "occdist_scale": 0,
            "max_vel_tran": 1.0,
        }
    )
    assert notes.problems == [
        "/move_base0/DWAPlannerROS/sim_time: 0.0 is out of range; expected a positive number"
        " of seconds"
    ]
    assert {remark.place.split("/")[-1]: remark.kind for remark in notes.remarks} == {
        "vx_samples": CLAMPED,
        "acc_lim_x": CLAMPED,
        "occdist_scale": CAUTION,
        "max_vel_tran": UNKNOWN,
    }
    assert (tree[DWA_PLANNER]["vx_samples"], tree[DWA_PLANNER]["acc_lim_x"]) == (1, 20.0)
