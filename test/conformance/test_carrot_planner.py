"""The carrot planner against recordings of the original."""
from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from quad_nav.errors import PlanningError
from quad_nav.geometry import Pose2D, angle_difference, yaw_from_quaternion
from quad_nav.grid import GridSpec
from quad_nav.plan.carrot import Carrot, CarrotParams

DATA = Path(__file__).parent / "data" / "carrot_planner"


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
    planner = Carrot(CarrotParams(), recorded["footprint"])
    costs = recorded["costmap"].copy()
    try:
        plan = planner.make_plan(spec, costs, Pose2D(*meta["start"]), Pose2D(*meta["goal"]))
    except PlanningError:
        plan = None

    assert (plan is not None) == meta["found"]
    np.testing.assert_array_equal(costs, recorded["costmap"])
    if plan is None:
        return
    assert len(plan) == len(recorded["plan"])
    np.testing.assert_allclose(plan[:, :2], recorded["plan"][:, :2], atol=1e-9, rtol=0)
    turns = [angle_difference(yaw, yaw_from_quaternion(quaternion))
             for yaw, quaternion in zip(plan[:, 2], recorded["plan"][:, 3:])]
    np.testing.assert_allclose(turns, 0.0, atol=1e-9, rtol=0)
