"""The inflation layer, cost for cost."""

from __future__ import annotations

from pathlib import Path
from typing import Any, List, Mapping

from families.case import load_case
from families.comparison import Comparison, Difference
from quad_nav import footprint as footprints
from quad_nav.config import load
from quad_nav.costmap.cost_grid import Bounds, CostGrid, Window
from quad_nav.costmap.inflation import InflationLayer, InflationLayerParams
from quad_nav.geometry import Pose2D
from quad_nav.grid import GridSpec


def check(path: Path) -> List[Difference]:
    case, comparison = load_case(path), Comparison()
    arrays, meta = case.arrays, case.meta
    radii_m = footprints.radii(arrays["footprint"])
    comparison.near("inscribed_radius", radii_m[0], meta["inscribed_radius"], 1e-12)
    comparison.near("circumscribed_radius", radii_m[1], meta["circumscribed_radius"], 1e-12)

    resolution_m = meta["params"]["resolution"]
    layer = InflationLayer(_layer_params(meta["params"]), resolution_m, radii_m[0])
    comparison.exact("cell_inflation_radius", layer.radius_cells, meta["cell_inflation_radius"])
    if layer.radius_cells > 0:
        comparison.exact("cost_table", layer.cost_table, arrays["cost_table"])

    master = CostGrid(GridSpec(meta["size_x"], meta["size_y"], resolution_m, *meta["origin"]))
    master.costs[...] = arrays["grid_in"]
    x0, y0, xn, yn = arrays["window"].tolist()
    layer.update_costs(master, Window(x0, xn, y0, yn))
    comparison.exact("grid_out", master.costs, arrays["grid_out"])

    for k, (before, after) in enumerate(zip(arrays["bounds_in"].tolist(), arrays["bounds_out"])):
        bounds = layer.update_bounds(Pose2D(0.0, 0.0), 0.0, Bounds(*before))
        comparison.exact(
            f"bounds_out[{k}]",
            [bounds.min_x_m, bounds.min_y_m, bounds.max_x_m, bounds.max_y_m],
            after,
        )
    return comparison.differences


def _layer_params(params: Mapping[str, Any]) -> InflationLayerParams:
    """The layer's among the recorded parameters, which are the costmap's and the layer's."""
    given = {
        name: params[name]
        for name in ("inflation_radius", "cost_scaling_factor", "inflate_unknown")
        if name in params
    }
    (layer,) = load(
        {
            "local_costmap": {
                "plugins": [{"name": "inflation", "type": "costmap_2d::InflationLayer"}],
                "inflation": given,
            },
        }
    ).local_costmap.layers
    assert isinstance(layer[1], InflationLayerParams)
    return layer[1]
