"""The carrot planner."""

from __future__ import annotations

from pathlib import Path
from typing import List

from families.case import load_case
from families.comparison import Comparison, Difference
from families.loop import spec_at
from families.plans import NO_PLAN, compare_plans
from quad_nav.config import load
from quad_nav.errors import PlanningError
from quad_nav.geometry import Pose2D
from quad_nav.plan.carrot import Carrot


def check(path: Path) -> List[Difference]:
    case, comparison = load_case(path), Comparison()
    recorded, meta = case.arrays, case.meta
    configuration = load(
        {"base_global_planner": "carrot_planner/CarrotPlanner", "CarrotPlanner": meta["params"]}
    )
    planner = Carrot(configuration.global_planner, recorded["footprint"])
    costs = recorded["costmap"].copy()
    try:
        plan = planner.make_plan(
            spec_at(meta, meta["origin"]), costs, Pose2D(*meta["start"]), Pose2D(*meta["goal"])
        )
    except PlanningError:
        plan = NO_PLAN
    comparison.exact("found", len(plan) > 0, meta["found"])
    comparison.exact("costmap", costs, recorded["costmap"])
    if meta["found"]:  # the original leaves a plan behind when it finds none
        compare_plans(comparison, "plan", plan, recorded["plan"])
    return comparison.differences
