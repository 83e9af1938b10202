"""Published occupancies, and the geometry of footprints."""

from __future__ import annotations

import json
from pathlib import Path
from typing import List

import numpy as np

from families.case import Case, load_case
from families.comparison import Comparison, Difference
from quad_nav import footprint as footprints
from quad_nav.costmap.cost_grid import CostGrid, occupancy
from quad_nav.geometry import Pose2D
from quad_nav.grid import GridSpec

_TOLERANCE = 1e-12


def check(path: Path) -> List[Difference]:
    case, comparison = load_case(path), Comparison()
    if "cost" in case.arrays:
        comparison.exact("occupancy", occupancy(case.arrays["cost"]), case.arrays["occupancy"])
    else:
        _check_footprint(case, comparison)
    return comparison.differences


def _check_footprint(case: Case, comparison: Comparison) -> None:
    arrays, meta = case.arrays, case.meta
    params = meta["params"]
    # The original reads the numbers of a footprint as float32.
    unpadded = (
        np.array(json.loads(params["footprint"]), dtype=np.float32)
        if "footprint" in params
        else footprints.circle(params["robot_radius"])
    )
    padded = footprints.pad(unpadded, params["footprint_padding"])
    oriented = footprints.oriented(padded, Pose2D(*meta["pose"]))
    for name, found in (("unpadded", unpadded), ("padded", padded), ("oriented", oriented)):
        comparison.near(name, found, arrays[name], _TOLERANCE)
    for polygon, suffix in ((padded, ""), (unpadded, "_unpadded")):
        radii_m = footprints.radii(polygon)
        for name, radius_m in zip(("inscribed_radius", "circumscribed_radius"), radii_m):
            comparison.near(name + suffix, radius_m, meta[name + suffix], _TOLERANCE)
    place = meta["grid"]
    grid = CostGrid(
        GridSpec(place["size_x"], place["size_y"], place["resolution"], *place["origin"]),
        place["background"],
    )
    grid.fill_polygon(oriented, 0)
    comparison.exact("filled", grid.costs, arrays["filled"])
