"""The trajectory planner against recordings of the original."""
from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from quad_nav.control.oscillation import Oscillation
from quad_nav.control.rollout import Rollout, footprint_cost
from quad_nav.control.trajectory_planner import TrajectoryPlanner, TrajectoryPlannerParams
from quad_nav.control.velocity_search import choose_trajectory
from quad_nav.errors import ControlError
from quad_nav.geometry import Pose2D, Twist2D, multiply_quaternions, rotation_from_quaternion
from quad_nav.grid import GridSpec

DATA = Path(__file__).parent / "data" / "trajectory_planner"

FIELD_OF = {
    "max_vel_x": "max_vel_x_mps", "min_vel_x": "min_vel_x_mps",
    "max_vel_theta": "max_vel_theta_radps",
    "min_in_place_vel_theta": "min_in_place_vel_theta_radps",
    "acc_lim_x": "acc_lim_x_mps2", "acc_lim_y": "acc_lim_y_mps2",
    "acc_lim_theta": "acc_lim_theta_radps2",
    "yaw_goal_tolerance": "yaw_goal_tolerance_rad", "xy_goal_tolerance": "xy_goal_tolerance_m",
    "escape_vel": "escape_vel_mps", "heading_scoring_timestep": "heading_scoring_timestep_s",
    "sim_time": "sim_time_s", "sim_granularity": "sim_granularity_m",
    "angular_sim_granularity": "angular_sim_granularity_rad",
    "pdist_scale": "path_distance_bias", "gdist_scale": "goal_distance_bias",
    "y_vels": "y_vels_mps",
}
FLAGS = ("stuck_left", "stuck_right", "rotating_left", "rotating_right", "stuck_left_strafe",
         "stuck_right_strafe", "strafe_left", "strafe_right", "escaping")


def _load(mode: str) -> list:
    cases = []
    for entry in json.loads((DATA / "index.json").read_text()):
        with np.load(DATA / f"{entry['case']}.npz") as file:
            recorded = dict(file)
        meta = json.loads(str(recorded.pop("meta")))
        if meta["mode"] == mode:
            cases.append(pytest.param(recorded, meta, id=f"{entry['case']}: {entry['note']}"))
    return cases


def _params(meta: dict) -> TrajectoryPlannerParams:
    fields = {FIELD_OF.get(name, name): value for name, value in meta["params"].items()}
    if "y_vels_mps" in fields:
        fields["y_vels_mps"] = tuple(float(v) for v in fields["y_vels_mps"].split(","))
    fields["meter_scoring"] = meta["meter_scoring_effective"]
    return replace(TrajectoryPlannerParams(), **fields)


def _period_s(meta: dict) -> float:
    return 1.0 / meta["controller_frequency"] if meta["controller_frequency"] else 0.05


def _plan(rows: np.ndarray) -> np.ndarray:
    return np.column_stack((rows[:, :2], 2.0 * np.arctan2(rows[:, 2], rows[:, 3])))


def _nums(oscillation: Oscillation) -> list:
    since, escape = oscillation.since, oscillation.escape_from
    return [since.x_m, since.y_m, escape.x_m, escape.y_m, escape.yaw_rad]


def _single_precision(pose: np.ndarray) -> list:
    return [float(v) for v in np.asarray(pose, dtype=np.float32)]


@pytest.mark.parametrize("recorded, meta", _load("single"))
def test_one_search(recorded, meta):
    params, oscillation = _params(meta), Oscillation()
    spec = GridSpec(meta["size_x"], meta["size_y"], meta["resolution"], *meta["origin"])
    rollout = Rollout(params, spec, recorded["costmap"], recorded["footprint"],
                      _plan(recorded["plan"]), Pose2D(*recorded["pose"]),
                      Twist2D(*recorded["velocity"]))

    np.testing.assert_array_equal(rollout.grids.within_robot, recorded["within_robot"] != 0)
    np.testing.assert_array_equal(rollout.grids.path, recorded["path_dist"])
    np.testing.assert_array_equal(rollout.grids.goal, recorded["goal_dist"])

    best = choose_trajectory(rollout, params, oscillation, _period_s(meta))

    np.testing.assert_allclose([*best.sample, best.cost], recorded["best"], atol=1e-9, rtol=0)
    np.testing.assert_allclose(best.points, recorded["best_points"], atol=1e-9, rtol=0)
    command = best.sample if best.cost >= 0.0 else (0.0, 0.0, 0.0)
    np.testing.assert_allclose(command, recorded["cmd"], atol=1e-9, rtol=0)
    assert meta["flag_names"] == list(FLAGS)
    assert [getattr(oscillation, name) for name in FLAGS] == [
        bool(flag) for flag in recorded["state_flags"]]
    np.testing.assert_allclose(_nums(oscillation), recorded["state_nums"], atol=1e-9, rtol=0)


@pytest.mark.parametrize("recorded, meta", _load("single"))
def test_scores(recorded, meta):
    spec = GridSpec(meta["size_x"], meta["size_y"], meta["resolution"], *meta["origin"])
    rollout = Rollout(_params(meta), spec, recorded["costmap"], recorded["footprint"],
                      _plan(recorded["plan"]), Pose2D(*recorded["pose"]),
                      Twist2D(*recorded["velocity"]))
    samples, results = recorded["samples"], recorded["sample_results"]

    costs, ends = rollout.score(samples)

    np.testing.assert_allclose(costs, results[:, 0], atol=1e-9, rtol=1e-12)
    np.testing.assert_allclose(np.nan_to_num(ends), results[:, 2:], atol=1e-9, rtol=0)
    for sample, result in zip(samples, results):
        assert len(rollout.trajectory(tuple(sample)).points) == result[1]


@pytest.mark.parametrize("recorded, meta", _load("single"))
def test_footprint_costs(recorded, meta):
    spec = GridSpec(meta["size_x"], meta["size_y"], meta["resolution"], *meta["origin"])

    costs = [footprint_cost(spec, recorded["costmap"], recorded["footprint"], Pose2D(*pose))
             for pose in recorded["footprint_poses"]]

    np.testing.assert_array_equal(costs, recorded["footprint_costs"])


@pytest.mark.parametrize("recorded, meta", _load("loop"))
def test_loop(recorded, meta):
    planner = TrajectoryPlanner(_params(meta), recorded["footprint"], _period_s(meta))
    local_from_plan = _local_from_plan(meta)
    set_at = {int(step): recorded[f"plan_{j}"]
              for j, step in enumerate(recorded["plan_set_step"])}
    for k in range(len(recorded["pose"])):
        if k in set_at:
            planner.set_plan(_plan(set_at[k]))
        ox, oy = recorded["window_offset"][k]
        world = recorded["world"][recorded["world_index"][k]]
        costs = world[oy:oy + meta["size_y"], ox:ox + meta["size_x"]]
        spec = GridSpec(meta["size_x"], meta["size_y"], meta["resolution"], *recorded["origin"][k])
        try:
            control = planner.compute_velocity(
                spec, costs, Pose2D(*recorded["pose"][k]), Twist2D(*recorded["velocity"][k]),
                local_from_plan)
        except ControlError:
            control = None
        _check_call(planner, control, recorded, meta, k)


def _local_from_plan(meta: dict) -> Pose2D:
    """The inverse of the recorded frame's pose, to the last bit as tf2 computes it.

    The plan's points lie on cell borders, so the last bit decides about their
    cells. tf2 turns the translation by two quaternion products, and takes the
    rotation from quaternion to matrix and back.
    """
    frame = meta.get("map_to_costmap_frame")  # pose of the costmap frame in the map frame
    if frame is None:
        return Pose2D(0.0, 0.0, 0.0)
    qx, qy, qz, qw = frame["quaternion_xyzw"]
    inverse = (-qx, -qy, -qz, qw)
    translation = multiply_quaternions(
        multiply_quaternions(inverse, (-frame["x"], -frame["y"], 0.0, 0.0)), (qx, qy, qz, qw))
    rotation = rotation_from_quaternion(inverse)
    root = math.sqrt(np.trace(rotation) + 1.0)
    yaw = 2.0 * math.atan2((rotation[1, 0] - rotation[0, 1]) * (0.5 / root), root * 0.5)
    return Pose2D(translation[0], translation[1], yaw)


def _check_call(planner, control, recorded, meta, k):
    where = f"call {k}"
    assert (control is not None) == bool(recorded["ok"][k]), where
    command = control.command if control else Twist2D()
    np.testing.assert_allclose([command.vx_mps, command.vy_mps, command.vyaw_radps],
                               recorded["cmd"][k], atol=1e-9, rtol=0, err_msg=where)
    assert planner.is_goal_reached() == bool(recorded["goal_reached"][k]), where
    state = {name: getattr(planner.oscillation, name) for name in FLAGS}
    state.update(rotating_to_goal=planner.rotating_to_goal,
                 xy_tolerance_latch=planner.xy_tolerance_latch,
                 reached_goal=planner.is_goal_reached())
    assert [state[name] for name in meta["flag_names"]] == [
        bool(flag) for flag in recorded["state_flags"][k]], where
    np.testing.assert_allclose(_nums(planner.oscillation), recorded["state_nums"][k],
                               atol=1e-9, rtol=0, err_msg=where)
    assert len(planner.plan) == recorded["plan_lengths"][k, 0], where
    if recorded["goal_mode"][k]:
        assert control is None or control.goal_mode, where
        return
    cost = control.cost if control else planner.best.cost
    np.testing.assert_allclose(cost, recorded["best_cost"][k], atol=1e-9, rtol=0, err_msg=where)
    if control is not None:
        assert not control.goal_mode
        assert len(control.local_plan) == recorded["best_n_points"][k], where
        np.testing.assert_allclose(planner.best.sample, recorded["best_vel"][k], atol=1e-9,
                                   rtol=0, err_msg=where)
