"""NavFn against recordings of the original."""
from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from quad_nav.errors import PlanningError
from quad_nav.geometry import Pose2D, yaw_from_quaternion
from quad_nav.grid import GridSpec
from quad_nav.plan.navfn import Navfn, NavfnParams, navigation_costs, path_from, potential_from

DATA = Path(__file__).parent / "data" / "navfn"


def _load(core: bool) -> list:
    cases = []
    for entry in json.loads((DATA / "index.json").read_text()):
        with np.load(DATA / f"{entry['case']}.npz") as file:
            recorded = dict(file)
        meta = json.loads(str(recorded.pop("meta")))
        if meta.get("core", False) == core:
            cases.append(pytest.param(recorded, meta, id=f"{entry['case']}: {entry['note']}"))
    return cases


@pytest.mark.parametrize("recorded, meta", _load(core=False))
def test_make_plan(recorded, meta):
    spec = GridSpec(meta["size_x"], meta["size_y"], meta["resolution"], *meta["origin"])
    planner = Navfn(NavfnParams(meta["params"]["allow_unknown"],
                                meta["params"]["default_tolerance"]))
    costs = recorded["grid_in"].copy()
    for k, call in enumerate(meta["calls"]):
        suffix = f"_{k}" if k else ""
        potential = recorded["potential" + suffix]
        planner.potential = None
        try:
            plan = planner.make_plan(spec, costs, Pose2D(*call["start"]), Pose2D(*call["goal"]))
        except PlanningError:
            plan = np.zeros((0, 3))

        assert (len(plan) > 0) == call["found"]
        np.testing.assert_array_equal(costs, recorded["grid_after" + suffix])
        if potential.size:
            np.testing.assert_array_equal(planner.potential, potential)
        else:
            assert planner.potential is None
        _assert_same_plan(plan, recorded["plan" + suffix])
        if call["found"]:
            cells = recorded["path_cells" + suffix].astype(float)[::-1] * spec.resolution_m
            np.testing.assert_allclose(plan[:-1, :2] - meta["origin"], cells,
                                       atol=1e-4 * spec.resolution_m, rtol=0)
        if k == 0 and potential.size:
            np.testing.assert_array_equal(
                navigation_costs(costs, meta["params"]["allow_unknown"]), recorded["navcost"])


def _assert_same_plan(plan, recorded_plan):
    assert len(plan) == len(recorded_plan)
    np.testing.assert_allclose(plan[:, :2], recorded_plan[:, :2], atol=1e-5, rtol=0)
    yaws = np.array([yaw_from_quaternion(q) for q in recorded_plan[:, 3:]])
    np.testing.assert_allclose(plan[:, 2], yaws, atol=1e-9, rtol=0)


@pytest.mark.parametrize("recorded, meta", _load(core=True))
def test_wave_and_descent(recorded, meta):
    method = meta["params"]["method"]
    heuristic = "Astar" in method
    start, goal = tuple(meta["start_cell"]), tuple(meta["goal_cell"])
    nav_costs = navigation_costs(recorded["grid_in"], meta["params"]["allow_unknown"])

    potential = potential_from(nav_costs, source=goal, target=start,
                               stop_at_target=heuristic or "(true)" in method,
                               heuristic=heuristic)

    np.testing.assert_array_equal(nav_costs, recorded["navcost"])
    np.testing.assert_array_equal(potential, recorded["potential"])
    if "last_path_cost" in meta:
        assert potential[start[1], start[0]] == np.float32(meta["last_path_cost"])
    path, arrived = path_from(potential, start, goal)
    assert arrived == meta["found"]
    if not arrived:
        assert not recorded["path_cells"].size
        return
    np.testing.assert_allclose(path, recorded["path_cells"], atol=1e-4, rtol=0)
