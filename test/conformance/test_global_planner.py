"""The global planner against recordings of the original."""
from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from quad_nav.config import load
from quad_nav.errors import PlanningError
from quad_nav.geometry import Pose2D, angle_difference, yaw_from_quaternion
from quad_nav.grid import GridSpec
from quad_nav.plan.global_planner import SearchPlanner

DATA = Path(__file__).parent / "data" / "global_planner"


def _cases() -> list:
    cases = []
    for entry in json.loads((DATA / "index.json").read_text()):
        with np.load(DATA / f"{entry['case']}.npz") as file:
            recorded = dict(file)
        meta = json.loads(str(recorded.pop("meta")))
        cases.append(pytest.param(recorded, meta, id=f"{entry['case']}: {entry['note']}"))
    return cases


@pytest.mark.parametrize("recorded, meta", _cases())
def test_make_plan(recorded, meta):
    spec = GridSpec(meta["size_x"], meta["size_y"], meta["resolution"], *meta["origin"])
    configuration = load({"base_global_planner": "global_planner/GlobalPlanner",
                          "GlobalPlanner": meta["params"]})
    planner = SearchPlanner(configuration.global_planner)
    costs = recorded["grid_in"].copy()
    try:
        plan = planner.make_plan(spec, costs, Pose2D(*meta["start"]), Pose2D(*meta["goal"]))
    except PlanningError:
        plan = np.zeros((0, 3))

    assert (len(plan) > 0) == meta["found"]
    np.testing.assert_array_equal(costs, recorded["grid_after"])
    assert len(plan) == len(recorded["plan"])
    np.testing.assert_allclose(plan[:, :2], recorded["plan"][:, :2], atol=1e-5, rtol=0)
    turns = [angle_difference(yaw, yaw_from_quaternion(quaternion))
             for yaw, quaternion in zip(plan[:, 2], recorded["plan"][:, 3:])]
    # Half a cell apart, two points of 1e-5 m tolerance give a direction to within this.
    np.testing.assert_allclose(turns, 0.0, atol=2e-3, rtol=0)
