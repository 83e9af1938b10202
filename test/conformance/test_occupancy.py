"""Footprints and published occupancies against the original's."""
from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from quad_nav import footprint as footprints
from quad_nav.costmap.cost_grid import CostGrid
from quad_nav.costmap.occupancy import occupancy
from quad_nav.geometry import Pose2D
from quad_nav.grid import GridSpec

DATA = Path(__file__).parent / "data" / "occupancy"
CASES = [entry["case"] for entry in json.loads((DATA / "index.json").read_text())]


@pytest.mark.parametrize("case", CASES)
def test_case(case):
    with np.load(DATA / f"{case}.npz") as arrays:
        recorded = dict(arrays)
    if "cost" in recorded:
        np.testing.assert_array_equal(occupancy(recorded["cost"]), recorded["occupancy"])
    else:
        check_footprint(recorded, json.loads(str(recorded["meta"])))


def check_footprint(recorded, meta):
    params = meta["params"]
    unpadded = (np.array(json.loads(params["footprint"]), dtype=np.float32) if "footprint" in params
                else footprints.circle(params["robot_radius"]))
    padded = footprints.pad(unpadded, params["footprint_padding"])
    oriented = footprints.oriented(padded, Pose2D(*meta["pose"]))
    near = {"rtol": 0.0, "atol": 1e-12}
    np.testing.assert_allclose(unpadded, recorded["unpadded"], **near)
    np.testing.assert_allclose(padded, recorded["padded"], **near)
    np.testing.assert_allclose(oriented, recorded["oriented"], **near)
    np.testing.assert_allclose(
        footprints.radii(padded), (meta["inscribed_radius"], meta["circumscribed_radius"]), **near)
    np.testing.assert_allclose(
        footprints.radii(unpadded),
        (meta["inscribed_radius_unpadded"], meta["circumscribed_radius_unpadded"]), **near)
    place = meta["grid"]
    grid = CostGrid(GridSpec(place["size_x"], place["size_y"], place["resolution"],
                             *place["origin"]), place["background"])
    grid.fill_polygon(oriented, 0)
    np.testing.assert_array_equal(grid.costs, recorded["filled"])
