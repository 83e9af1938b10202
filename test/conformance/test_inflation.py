"""The inflation layer against the original's, cost for cost."""
from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from quad_nav import footprint as footprints
from quad_nav.costmap.cost_grid import Bounds, CostGrid, Window
from quad_nav.costmap.inflation import InflationLayer, InflationLayerParams
from quad_nav.geometry import Pose2D
from quad_nav.grid import GridSpec

DATA = Path(__file__).parent / "data" / "inflation"
CASES = [entry["case"] for entry in json.loads((DATA / "index.json").read_text())]


@pytest.fixture(params=CASES)
def recorded(request):
    with np.load(DATA / f"{request.param}.npz") as arrays:
        return dict(arrays)


@pytest.fixture
def meta(recorded):
    return json.loads(str(recorded["meta"]))


@pytest.fixture
def layer(recorded, meta):
    params = meta["params"]
    inscribed_m, circumscribed_m = footprints.radii(recorded["footprint"])
    assert inscribed_m == pytest.approx(meta["inscribed_radius"], abs=1e-12)
    assert circumscribed_m == pytest.approx(meta["circumscribed_radius"], abs=1e-12)
    return InflationLayer(
        InflationLayerParams(inflation_radius_m=params["inflation_radius"],
                             cost_scaling_factor=params["cost_scaling_factor"],
                             inflate_unknown=params["inflate_unknown"]),
        params["resolution"], inscribed_m)


def test_cost_table(layer, recorded, meta):
    assert layer.radius_cells == meta["cell_inflation_radius"]
    if layer.radius_cells > 0:
        np.testing.assert_array_equal(layer.cost_table, recorded["cost_table"])


def test_costs(layer, recorded, meta):
    master = CostGrid(GridSpec(meta["size_x"], meta["size_y"], meta["params"]["resolution"],
                               *meta["origin"]))
    master.costs[...] = recorded["grid_in"]
    x0, y0, xn, yn = recorded["window"].tolist()
    layer.update_costs(master, Window(x0, xn, y0, yn))
    np.testing.assert_array_equal(master.costs, recorded["grid_out"])


def test_bounds(layer, recorded):
    for before, after in zip(recorded["bounds_in"].tolist(), recorded["bounds_out"].tolist()):
        assert layer.update_bounds(Pose2D(0.0, 0.0), 0.0, Bounds(*before)) == Bounds(*after)
