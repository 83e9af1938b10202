"""NavFn: whole plans, and the wave and its descent on their own."""

from __future__ import annotations

from pathlib import Path
from typing import List

import numpy as np

from families.case import Case, load_case
from families.comparison import Comparison, Difference
from families.plans import NO_PLAN, compare_plans
from quad_nav.config import load
from quad_nav.errors import PlanningError
from quad_nav.geometry import Pose2D
from quad_nav.grid import GridSpec
from quad_nav.plan.navfn import Navfn, navigation_costs, path_from, potential_from

_CELLS = 1e-4  # tolerance of paths that are computed back from plans


def check(path: Path) -> List[Difference]:
    case, comparison = load_case(path), Comparison()
    if case.meta.get("core", False):
        _check_core(case, comparison)
    else:
        _check_plans(case, comparison)
    return comparison.differences


def _check_plans(case: Case, comparison: Comparison) -> None:
    """Calls of one planner on one costmap, each on what the one before left."""
    recorded, meta = case.arrays, case.meta
    spec = GridSpec(meta["size_x"], meta["size_y"], meta["resolution"], *meta["origin"])
    planner = Navfn(load({"NavfnROS": meta["params"]}).global_planner)
    costs = recorded["grid_in"].copy()
    for k, call in enumerate(meta["calls"]):
        suffix = f"_{k}" if k else ""
        planner.potential = None
        try:
            plan = planner.make_plan(spec, costs, Pose2D(*call["start"]), Pose2D(*call["goal"]))
        except PlanningError:
            plan = NO_PLAN
        comparison.exact("found" + suffix, len(plan) > 0, call["found"])
        comparison.exact("grid_after" + suffix, costs, recorded["grid_after" + suffix])
        potential = np.zeros((0, 0)) if planner.potential is None else planner.potential
        comparison.exact("potential" + suffix, potential, recorded["potential" + suffix])
        compare_plans(comparison, "plan" + suffix, plan, recorded["plan" + suffix])
        if call["found"] and len(plan):
            cells = (plan[:-1, :2] - meta["origin"])[::-1] / spec.resolution_m
            comparison.near("path_cells" + suffix, cells, recorded["path_cells" + suffix], _CELLS)
        if k == 0 and potential.size:
            comparison.exact(
                "navcost",
                navigation_costs(costs, planner.params.allow_unknown),
                recorded["navcost"],
            )


def _check_core(case: Case, comparison: Comparison) -> None:
    recorded, meta = case.arrays, case.meta
    method = meta["params"]["method"]
    heuristic = "Astar" in method
    start, goal = tuple(meta["start_cell"]), tuple(meta["goal_cell"])
    nav_costs = navigation_costs(recorded["grid_in"], meta["params"].get("allow_unknown", True))
    potential = potential_from(
        nav_costs,
        source=goal,
        target=start,
        stop_at_target=heuristic or "(true)" in method,
        heuristic=heuristic,
    )
    comparison.exact("navcost", nav_costs, recorded["navcost"])
    comparison.exact("potential", potential, recorded["potential"])
    if "last_path_cost" in meta:
        comparison.exact(
            "last_path_cost", potential[start[1], start[0]], np.float32(meta["last_path_cost"])
        )
    path, arrived = path_from(potential, start, goal)
    comparison.exact("found", arrived, meta["found"])
    comparison.exact("path_cells", path if arrived else np.zeros((0, 2)), recorded["path_cells"])
