"""The trajectory planner: single searches, and closed loops call by call."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Dict, List, Optional

import numpy as np
from upstream import UPSTREAM

from families.case import Case, InvalidValue, Recorded, load_case
from families.comparison import Comparison, Difference
from families.loop import period_s, plan_of, replayed, spec_at
from quad_nav.config import load
from quad_nav.control.controller import Control
from quad_nav.control.oscillation import Oscillation
from quad_nav.control.rollout import Rollout
from quad_nav.control.trajectory_planner import TrajectoryPlanner, TrajectoryPlannerParams
from quad_nav.control.velocity_search import choose_trajectory
from quad_nav.costmap.collision import footprint_cost
from quad_nav.geometry import Pose2D, Twist2D

_TOLERANCE = 1e-9


def check(path: Path) -> List[Difference]:
    case, comparison = load_case(path), Comparison()
    if case.meta["mode"] == "single":
        _check_single(case, comparison)
    elif case.meta["mode"] == "loop":
        _check_loop(case, comparison)
    else:
        raise InvalidValue(f"{case.meta['mode']!r} is no mode; expected single or loop")
    return comparison.differences


def _params(meta: Recorded) -> TrajectoryPlannerParams:
    params = load({"TrajectoryPlannerROS": meta["params"], **UPSTREAM}).local_planner
    in_metres = meta["meter_scoring_effective"]
    return replace(params, meter_scoring=in_metres, respect_meter_scoring=True)


def _flags(oscillation: Oscillation, names: List[str], more: Dict[str, bool]) -> List[bool]:
    return [more[name] if name in more else getattr(oscillation, name) for name in names]


def _numbers(oscillation: Oscillation) -> List[float]:
    since, escape = oscillation.since, oscillation.escape_from
    return [since.x_m, since.y_m, escape.x_m, escape.y_m, escape.yaw_rad]


# -- single ---------------------------------------------------------------------------


def _check_single(case: Case, comparison: Comparison) -> None:
    recorded, meta = case.arrays, case.meta
    params, oscillation = _params(meta), Oscillation()
    spec = spec_at(meta, meta["origin"])
    rollout = Rollout(
        params,
        spec,
        recorded["costmap"],
        recorded["footprint"],
        plan_of(recorded["plan"]),
        Pose2D(*recorded["pose"]),
        Twist2D(*recorded["velocity"]),
    )
    comparison.exact("within_robot", rollout.grids.within_robot, recorded["within_robot"] != 0)
    comparison.exact("path_dist", rollout.grids.path, recorded["path_dist"])
    comparison.exact("goal_dist", rollout.grids.goal, recorded["goal_dist"])

    best = choose_trajectory(rollout, params, oscillation, period_s(meta))
    comparison.near("best", [*best.sample, best.cost], recorded["best"], _TOLERANCE)
    comparison.near("best_points", best.points, recorded["best_points"], _TOLERANCE)
    command = best.sample if best.cost >= 0.0 else (0.0, 0.0, 0.0)
    comparison.near("cmd", command, recorded["cmd"], _TOLERANCE)
    comparison.exact(
        "state_flags", _flags(oscillation, meta["flag_names"], {}), recorded["state_flags"] != 0
    )
    comparison.near("state_nums", _numbers(oscillation), recorded["state_nums"], _TOLERANCE)

    _check_samples(rollout, recorded, comparison)
    costs = [
        footprint_cost(rollout.inputs.costmap, recorded["footprint"], tuple(pose))
        for pose in recorded["footprint_poses"]
    ]
    comparison.exact("footprint_costs", costs, recorded["footprint_costs"])


def _check_samples(rollout: Rollout, recorded: Recorded, comparison: Comparison) -> None:
    samples, results = recorded["samples"], recorded["sample_results"]
    costs, ends = rollout.score(samples)
    comparison.near("sample_results (cost)", costs, results[:, 0], _TOLERANCE)
    lengths = [len(rollout.trajectory(tuple(sample)).points) for sample in samples]
    comparison.exact("sample_results (number of points)", lengths, results[:, 1])
    comparison.near("sample_results (last point)", np.nan_to_num(ends), results[:, 2:], _TOLERANCE)


# -- loop -----------------------------------------------------------------------------


def _check_loop(case: Case, comparison: Comparison) -> None:
    meta = case.meta
    planner = TrajectoryPlanner(_params(meta), case.arrays["footprint"], period_s(meta))
    for k, control in replayed(planner, case):
        _check_call(planner, control, case.arrays, meta, k, comparison)


def _check_call(
    planner: TrajectoryPlanner,
    control: Optional[Control],
    recorded: Recorded,
    meta: Recorded,
    k: int,
    comparison: Comparison,
) -> None:
    exact, near = comparison.exact, comparison.near
    command = control.command if control else Twist2D()
    exact(f"ok[{k}]", control is not None, bool(recorded["ok"][k]))
    near(
        f"cmd[{k}]",
        [command.vx_mps, command.vy_mps, command.vyaw_radps],
        recorded["cmd"][k],
        _TOLERANCE,
    )
    exact(f"goal_reached[{k}]", planner.is_goal_reached(), bool(recorded["goal_reached"][k]))
    state = {
        "rotating_to_goal": planner.rotating_to_goal,
        "xy_tolerance_latch": planner.xy_tolerance_latch,
        "reached_goal": planner.is_goal_reached(),
    }
    exact(
        f"state_flags[{k}]",
        _flags(planner.oscillation, meta["flag_names"], state),
        recorded["state_flags"][k] != 0,
    )
    near(f"state_nums[{k}]", _numbers(planner.oscillation), recorded["state_nums"][k], _TOLERANCE)
    exact(f"plan_lengths[{k}] (global)", len(planner.plan), recorded["plan_lengths"][k, 0])
    if control is not None:
        exact(f"goal_mode[{k}]", control.goal_mode, bool(recorded["goal_mode"][k]))
    if not recorded["goal_mode"][k]:
        _check_best(planner, control, recorded, k, comparison)


def _check_best(
    planner: TrajectoryPlanner,
    control: Optional[Control],
    recorded: Recorded,
    k: int,
    comparison: Comparison,
) -> None:
    exact, near = comparison.exact, comparison.near
    best = planner.best
    cost = np.nan if best is None else best.cost
    near(f"best_cost[{k}]", cost, recorded["best_cost"][k], _TOLERANCE)
    if control is not None and best is not None:
        exact(f"best_n_points[{k}]", len(control.local_plan), recorded["best_n_points"][k])
        near(f"best_vel[{k}]", best.sample, recorded["best_vel"][k], _TOLERANCE)
