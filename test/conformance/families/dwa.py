"""The dynamic window planner: closed loops call by call."""

from __future__ import annotations

from pathlib import Path
from typing import List, Optional

from upstream import UPSTREAM

from families.case import Recorded, load_case
from families.comparison import Comparison, Difference
from families.loop import period_s, replayed
from quad_nav.config import load, values
from quad_nav.control.controller import Control
from quad_nav.control.dwa_critics import NO_LEGAL_TRAJECTORY
from quad_nav.control.dwa_planner import DwaPlanner
from quad_nav.geometry import Twist2D

_TOLERANCE = 1e-6


def check(path: Path) -> List[Difference]:
    case, comparison = load_case(path), Comparison()
    recorded, meta = case.arrays, case.meta
    configuration = load(
        {
            "base_local_planner": "dwa_local_planner/DWAPlannerROS",
            "DWAPlannerROS": meta["params"],
            **UPSTREAM,
        }
    )
    params = configuration.local_planner
    effective = {**values(configuration, "DWAPlannerROS"), "cheat_factor": params.cheat_factor}
    del effective["restore_defaults"]  # a button, not recorded
    for name, value in effective.items():
        comparison.exact(f"effective.{name}", value, meta["effective"][name])
    planner = DwaPlanner(params, recorded["footprint"], period_s(meta))
    for k, control in replayed(planner, case):
        _check_call(planner, control, recorded, meta, k, comparison)
    return comparison.differences


def _check_call(
    planner: DwaPlanner,
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
    exact(f"state_flags[{k}]", _state(planner, meta["flag_names"]), recorded["state_flags"][k] != 0)
    exact(f"plan_lengths[{k}] (global)", len(planner.plan), recorded["plan_lengths"][k, 0])
    best, goal_mode = planner.best, bool(recorded["goal_mode"][k])
    exact(f"goal_mode[{k}]", best is None, goal_mode)
    if control is not None:
        exact(f"goal_mode[{k}] (of the command)", control.goal_mode, goal_mode)
    if goal_mode or best is None:
        return
    near(f"best_cost[{k}]", best.cost, recorded["best_cost"][k], _TOLERANCE)
    exact(f"best_n_points[{k}]", len(best.points), recorded["best_n_points"][k])
    if control is None:
        exact(f"best_cost[{k}] (no legal trajectory)", best.cost, NO_LEGAL_TRAJECTORY)
    else:
        near(f"best_vel[{k}]", best.sample, recorded["best_vel"][k], _TOLERANCE)


def _state(planner: DwaPlanner, names: List[str]) -> List[bool]:
    state = {
        "xy_tolerance_latch": planner.xy_tolerance_latch,
        "rotating_to_goal": planner.rotating_to_goal,
    }
    for axis, verb, short in zip(
        planner.oscillation.axes, ("forward", "strafing", "rotating"), ("forward", "strafe", "rot")
    ):
        state[f"{verb}_pos"], state[f"{verb}_neg"] = axis.going_positive, axis.going_negative
        state[f"{short}_pos_only"], state[f"{short}_neg_only"] = (
            axis.positive_only,
            axis.negative_only,
        )
    return [state[name] for name in names]
