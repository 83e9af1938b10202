"""The dynamic window planner against recordings of the original."""
from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from quad_nav.control.dwa_critics import NO_LEGAL_TRAJECTORY
from quad_nav.control.dwa_planner import DwaParams, DwaPlanner
from quad_nav.errors import ControlError
from quad_nav.geometry import Pose2D, Twist2D, multiply_quaternions, rotation_from_quaternion
from quad_nav.grid import GridSpec

DATA = Path(__file__).parent / "data" / "dwa"

FIELD_OF = {
    "max_vel_trans": "max_vel_trans_mps", "min_vel_trans": "min_vel_trans_mps",
    "max_vel_x": "max_vel_x_mps", "min_vel_x": "min_vel_x_mps",
    "max_vel_y": "max_vel_y_mps", "min_vel_y": "min_vel_y_mps",
    "max_vel_theta": "max_vel_theta_radps", "min_vel_theta": "min_vel_theta_radps",
    "acc_lim_x": "acc_lim_x_mps2", "acc_lim_y": "acc_lim_y_mps2",
    "acc_lim_theta": "acc_lim_theta_radps2",
    "xy_goal_tolerance": "xy_goal_tolerance_m", "yaw_goal_tolerance": "yaw_goal_tolerance_rad",
    "trans_stopped_vel": "trans_stopped_velocity_mps",
    "theta_stopped_vel": "rot_stopped_velocity_radps",
    "sim_time": "sim_time_s", "sim_granularity": "sim_granularity_m",
    "angular_sim_granularity": "angular_sim_granularity_rad",
    "oscillation_reset_dist": "oscillation_reset_dist_m",
    "oscillation_reset_angle": "oscillation_reset_angle_rad",
    "forward_point_distance": "forward_point_distance_m", "scaling_speed": "scaling_speed_mps",
}
UNUSED = {"acc_lim_trans", "stop_time_buffer", "sim_period"}


def _load() -> list:
    cases = []
    for entry in json.loads((DATA / "index.json").read_text()):
        with np.load(DATA / f"{entry['case']}.npz") as file:
            recorded = dict(file)
        meta = json.loads(str(recorded.pop("meta")))
        cases.append(pytest.param(recorded, meta, id=f"{entry['case']}: {entry['note']}"))
    return cases


def _params(names: dict) -> DwaParams:
    fields = {FIELD_OF.get(name, name): value for name, value in names.items()
              if name not in UNUSED}
    return replace(DwaParams(), **fields)


def _period_s(meta: dict) -> float:
    return 1.0 / meta["controller_frequency"] if meta["controller_frequency"] else 0.05


def _plan(rows: np.ndarray) -> np.ndarray:
    return np.column_stack((rows[:, :2], 2.0 * np.arctan2(rows[:, 2], rows[:, 3])))


def test_the_defaults_are_those_in_force():
    defaults = json.loads((DATA.parent / "defaults.json").read_text())["dwa_defaults"]
    assert _params(defaults) == DwaParams()


@pytest.mark.parametrize("recorded, meta", _load())
def test_loop(recorded, meta):
    params = _params(meta["params"])
    assert params == _params(meta["effective"])
    planner = DwaPlanner(params, recorded["footprint"], _period_s(meta))
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
                               recorded["cmd"][k], atol=1e-6, rtol=0, err_msg=where)
    assert planner.is_goal_reached() == bool(recorded["goal_reached"][k]), where
    assert _state(planner, meta["flag_names"]) == [
        bool(flag) for flag in recorded["state_flags"][k]], where
    assert len(planner.plan) == recorded["plan_lengths"][k, 0], where
    if recorded["goal_mode"][k]:
        assert planner.best is None and (control is None or control.goal_mode), where
        return
    np.testing.assert_allclose(planner.best.cost, recorded["best_cost"][k], atol=1e-6, rtol=0,
                               err_msg=where)
    assert len(planner.best.points) == recorded["best_n_points"][k], where
    if control is None:
        assert planner.best.cost == NO_LEGAL_TRAJECTORY, where
        return
    assert not control.goal_mode, where
    np.testing.assert_allclose(planner.best.sample, recorded["best_vel"][k], atol=1e-6, rtol=0,
                               err_msg=where)


def _state(planner: DwaPlanner, names: list) -> list:
    state = {"xy_tolerance_latch": planner.xy_tolerance_latch,
             "rotating_to_goal": planner.rotating_to_goal}
    for axis, verb, short in zip(planner.oscillation.axes, ("forward", "strafing", "rotating"),
                                 ("forward", "strafe", "rot")):
        state[f"{verb}_pos"], state[f"{verb}_neg"] = axis.going_positive, axis.going_negative
        state[f"{short}_pos_only"], state[f"{short}_neg_only"] = (axis.positive_only,
                                                                  axis.negative_only)
    return [state[name] for name in names]
