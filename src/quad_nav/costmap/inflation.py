"""Inflation layer: costs that fall with the distance to the nearest obstacle.

At distance d from a lethal cell the cost is 254 for d = 0, 253 up to the inscribed radius r (a
robot with its centre there touches the obstacle), and 252 exp(-k (d - r)) beyond it, with k the
cost scaling factor, cut to a whole number. Beyond the inflation radius it is 0.

Obstacles just outside of a window reach into it. Seeds are therefore taken from one inflation
radius around the window, and cells up to two radii away can change.

Each update spreads all costs of the window again. A new or lost seed changes more than its own
radius: a cell passes on one seed only, so a cell that it wins no longer passes on the former one,
and so on from cell to cell. Only regions that are not connected are independent of each other.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.costmap.cost_grid import EVERYWHERE, Bounds, CostGrid, Window
from quad_nav.costmap.inflation_kernel import STEP_BITS, Ranks, inflate
from quad_nav.costmap.layer import Layer, LayerParams
from quad_nav.geometry import Pose2D
from quad_nav.grid import INSCRIBED, LETHAL, GridSpec
from quad_nav.parameter import flag, number


@dataclass(frozen=True)
class InflationLayerParams(LayerParams):
    """Parameters of ``costmap_2d::InflationLayer``."""

    cost_scaling_factor: float = number(
        "cost_scaling_factor", 10.0, "1/m", 0, 100, "Decay of costs beyond the inscribed radius."
    )
    inflation_radius_m: float = number(
        "inflation_radius", 0.55, "metres", 0, 50, "Distance to which obstacles are inflated."
    )
    inflate_unknown: bool = flag("inflate_unknown", False, "Inflate unknown cells, too.")

    def make_layer(self, spec: GridSpec, rolling_window: bool, default_cost: int) -> InflationLayer:
        """Make an inflation layer."""
        return InflationLayer(self, spec.resolution_m)


class InflationLayer(Layer):
    """Costs around the obstacles of the layers before it.

    Attributes:
        radius_cells: Inflation radius in cells, rounded up.
        cost_table: uint8[radius_cells + 2, radius_cells + 2], cost at (abs(dx), abs(dy)) cells.
    """

    params: InflationLayerParams

    def __init__(
        self, params: InflationLayerParams, resolution_m: float, inscribed_radius_m: float = 0.0
    ) -> None:
        super().__init__(params)
        self._resolution_m = resolution_m
        self._inscribed_radius_m = inscribed_radius_m
        self._last_bounds = EVERYWHERE
        self._redo_everything = True
        self._make_tables()

    def reconfigure(self, params: InflationLayerParams) -> None:
        """Take other parameters and write all costs again at the next update."""
        if params != self.params:
            self.params = params
            self._redo_everything = True
            self._make_tables()

    def resize(self, spec: GridSpec) -> None:
        """Follow the master grid to another resolution; the layers before it ask for updates."""
        self._resolution_m = spec.resolution_m
        self._make_tables()

    def set_footprint(self, footprint: NDArray[np.float64], inscribed_radius_m: float) -> None:
        """Take another inscribed radius, and write all costs again at the next update."""
        self._inscribed_radius_m = inscribed_radius_m
        self._redo_everything = True
        self._make_tables()

    def reset(self, now_s: float) -> None:
        """Cancel a full update; the layer collects nothing."""
        self._redo_everything = False

    def update_bounds(self, robot: Pose2D, now_s: float, bounds: Bounds) -> Bounds:
        """Return what changed now or in the last update, grown by the inflation radius."""
        last, self._last_bounds = self._last_bounds, bounds
        if self._redo_everything:
            self._redo_everything = False
            return EVERYWHERE
        return bounds.union(last).grown(self.params.inflation_radius_m)

    def update_costs(self, master: CostGrid, window: Window) -> None:
        """Spread costs from the lethal cells in and around the window."""
        if self.radius_cells == 0:
            return
        reach, spec = self.radius_cells, master.spec
        inflate(
            master.costs,
            max(0, window.x0 - reach),
            min(spec.size_x, window.xn + reach),
            max(0, window.y0 - reach),
            min(spec.size_y, window.yn + reach),
            self._ranks,
            self.params.inflate_unknown,
        )

    def _make_tables(self) -> None:
        params = self.params
        self.radius_cells, self.cost_table, self._ranks = _tables(
            params.inflation_radius_m,
            params.cost_scaling_factor,
            self._resolution_m,
            self._inscribed_radius_m,
        )


@lru_cache(maxsize=64)  # the robots of a fleet have the same
def _tables(
    inflation_radius_m: float,
    cost_scaling_factor: float,
    resolution_m: float,
    inscribed_radius_m: float,
) -> Tuple[int, NDArray[np.uint8], Ranks]:
    """Return the radius in cells, the costs at distances and their ranks, all read-only."""
    radius_cells = int(max(0.0, math.ceil(inflation_radius_m / resolution_m)))

    def cost_at(distance_cells: float) -> int:
        if distance_cells == 0.0:
            return LETHAL
        beyond_m = distance_cells * resolution_m - inscribed_radius_m
        if distance_cells * resolution_m <= inscribed_radius_m:
            return INSCRIBED
        return int((INSCRIBED - 1) * math.exp(-1.0 * cost_scaling_factor * beyond_m))

    n = radius_cells + 2
    squared = np.array([[dx * dx + dy * dy for dx in range(n)] for dy in range(n)])
    cost_table = np.array([[cost_at(math.sqrt(d)) for d in row] for row in squared], dtype=np.uint8)
    return radius_cells, cost_table, _ranked(squared, cost_table, radius_cells)


def _ranked(squared: NDArray[np.int64], cost_table: NDArray[np.uint8], radius_cells: int) -> Ranks:
    """Rank the distances up to the radius that have a cost.

    Args:
        squared: int64[n, n], squares of the distances in cells.
        cost_table: uint8[n, n], their costs.
        radius_cells: Inflation radius.
    """
    distances, ranks = np.unique(squared.ravel(), return_inverse=True)
    costs = np.zeros(len(distances), np.uint8)
    costs[ranks] = cost_table.ravel()
    costs = np.trim_zeros(costs[distances <= radius_cells**2], "b")
    shift = STEP_BITS + squared.size.bit_length()
    fits = shift + len(costs).bit_length() < 32
    ranks = np.minimum(ranks, len(costs)).reshape(squared.shape)
    states = ((ranks + 1) << shift) - 1
    return Ranks(costs, states.astype(np.int32 if fits else np.int64), shift)
