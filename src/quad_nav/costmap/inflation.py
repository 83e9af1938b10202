"""Inflation layer: costs that fall with the distance to the nearest obstacle.

At distance d from a lethal cell the cost is 254 for d = 0, 253 up to the inscribed radius r (a
robot with its centre there touches the obstacle), and 252 exp(-k (d - r)) beyond it, with k the
cost scaling factor, cut to a whole number. Beyond the inflation radius it is 0.

Obstacles just outside of a window reach into it. Seeds are therefore taken from one inflation
radius around the window, and cells up to two radii away can change.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quad_nav.costmap.cost_grid import EVERYWHERE, Bounds, CostGrid, Window
from quad_nav.costmap.layer import Layer, LayerParams
from quad_nav.geometry import Pose2D
from quad_nav.grid import INSCRIBED, LETHAL, GridSpec
from quad_nav.kernels.inflation import inflate


@dataclass(frozen=True)
class InflationLayerParams(LayerParams):
    """Parameters of ``costmap_2d::InflationLayer``.

    Attributes:
        cost_scaling_factor: Decay in 1/m beyond the inscribed radius.
    """

    inflation_radius_m: float = 0.55
    cost_scaling_factor: float = 10.0
    inflate_unknown: bool = False

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
            self.cost_table,
            self._rank_table,
            self.params.inflate_unknown,
        )

    def _make_tables(self) -> None:
        self.radius_cells = int(
            max(0.0, math.ceil(self.params.inflation_radius_m / self._resolution_m))
        )
        n = self.radius_cells + 2
        squared = np.array([[dx * dx + dy * dy for dx in range(n)] for dy in range(n)])
        self.cost_table = np.array(
            [[self.cost_at(math.sqrt(d)) for d in row] for row in squared], dtype=np.uint8
        )
        # Everything beyond the radius has one rank, the last.
        _, ranks = np.unique(np.minimum(squared, self.radius_cells**2 + 1), return_inverse=True)
        self._rank_table = ranks.reshape(n, n).astype(np.int32)

    def cost_at(self, distance_cells: float) -> int:
        """Return the cost of a cell at a distance from its obstacle."""
        if distance_cells == 0.0:
            return LETHAL
        beyond_m = distance_cells * self._resolution_m - self._inscribed_radius_m
        if distance_cells * self._resolution_m <= self._inscribed_radius_m:
            return INSCRIBED
        return int((INSCRIBED - 1) * math.exp(-1.0 * self.params.cost_scaling_factor * beyond_m))
