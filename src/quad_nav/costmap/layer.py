"""Interface of a costmap layer.

A costmap is updated in two rounds. First every layer updates its own knowledge and returns where
the master grid has to be written again (``update_bounds``). Then each layer in turn writes into
that window of the master grid (``update_costs``).

To write a layer, derive its parameters from ``LayerParams`` with a ``make_layer`` that returns your
``Layer`` (or ``GridLayer``, if it keeps costs of its own between updates), and name it in
``CostmapParams.layers``.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import Any, List, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.costmap.cost_grid import NOWHERE, Bounds, CostGrid, Square, Window
from quad_nav.geometry import Pose2D
from quad_nav.grid import FREE, GridSpec
from quad_nav.parameter import flag


class Redraw(enum.Enum):
    """Time at which the master grid is redrawn where a layer was cleared."""

    BEFORE_MOVING = "at the next update; until then the layer is not current"
    NEXT_UPDATE = "at the next update; the layer stays current, as upstream's"
    BY_CHANCE = "where updates for other reasons happen to pass"


@dataclass(frozen=True)
class LayerParams:
    """Parameters that every layer has."""

    enabled: bool = flag("enabled", True, "False skips the layer.")

    @property
    def bytes_per_cell(self) -> int:
        """Memory of the layer's own arrays for each cell of the costmap."""
        return 1

    def make_layer(self, spec: GridSpec, rolling_window: bool, default_cost: int) -> Layer:
        """Make a layer for a master grid at ``spec`` with empty cells of ``default_cost``."""
        raise NotImplementedError


class Layer:
    """Writer of one kind of knowledge into a master grid.

    Attributes:
        params: Parameters; ``reconfigure`` may replace them at any time.
    """

    def __init__(self, params: Any) -> None:
        self.params = params

    def update_bounds(self, robot: Pose2D, now_s: float, bounds: Bounds) -> Bounds:
        """Prepare an update of a robot at a pose in the global frame.

        Returns:
            Bounds that hold ``bounds``, where the layers before write, and where this layer writes.
        """
        return bounds

    def update_costs(self, master: CostGrid, window: Window) -> None:
        """Write into the window of the master grid, on top of the layers before."""

    def reconfigure(self, params: Any) -> None:
        """Take other parameters of the same kind."""
        self.params = params

    def resize(self, spec: GridSpec) -> None:
        """Follow the master grid to another size, resolution or position; it is empty."""

    def set_footprint(self, footprint: NDArray[np.float64], inscribed_radius_m: float) -> None:
        """Take another padded footprint, float64[n, 2] in the robot's frame."""

    def reset(self, now_s: float) -> None:
        """Forget collected knowledge."""

    def clear_area(
        self, square: Square, keep_inside: bool, redraw: Redraw = Redraw.BEFORE_MOVING
    ) -> None:
        """Forget the outside of a square (``keep_inside``) or its inside."""

    def free_square(self, square: Square, redraw: Redraw = Redraw.BEFORE_MOVING) -> bool:
        """Remove the obstacles in a square; False if there is nothing to free."""
        return False

    def is_current(self, now_s: float) -> bool:
        """Tell whether the layer's knowledge is recent enough to drive by."""
        return True

    def stale_sources(self, now_s: float) -> List[Tuple[str, float]]:
        """Return (name, seconds since its last message) of each silent sensor."""
        return []


class GridLayer(Layer):
    """Layer with costs of its own, in ``grid``, kept between updates."""

    def __init__(self, params: Any, spec: GridSpec, default_cost: int) -> None:
        super().__init__(params)
        self.grid = CostGrid(spec, default_cost)
        self._cleared = NOWHERE
        self._awaits_update = False

    def resize(self, spec: GridSpec) -> None:
        """Take the master grid's size, resolution and position, and forget all costs."""
        self.grid.resize(spec)

    def update_bounds(self, robot: Pose2D, now_s: float, bounds: Bounds) -> Bounds:
        """Add the areas that were cleared since the last update."""
        if self._cleared is not NOWHERE:
            bounds = bounds.union(self._cleared)
            self._cleared = NOWHERE
        self._awaits_update = False
        return bounds

    def clear_area(
        self, square: Square, keep_inside: bool, redraw: Redraw = Redraw.BEFORE_MOVING
    ) -> None:
        """Make cells unknown, as ``clear_costmap_recovery`` does."""
        self.grid.forget_area(square, keep_inside)
        self._pass_on(self._whole_map(), redraw)

    def free_square(self, square: Square, redraw: Redraw = Redraw.BEFORE_MOVING) -> bool:
        """Free a square of the layer; return False if it leaves the map."""
        if not self.grid.fill_polygon(square.corners, FREE):
            return False
        x_m, y_m, side_m = square
        self._pass_on(Bounds(x_m, y_m, x_m, y_m).grown(0.5 * side_m), redraw)
        return True

    def is_current(self, now_s: float) -> bool:
        """Tell whether the master grid has everything that was cleared."""
        return not self._awaits_update

    def _pass_on(self, bounds: Bounds, redraw: Redraw = Redraw.BEFORE_MOVING) -> None:
        """Have the next update write the master grid there."""
        if redraw is not Redraw.BY_CHANCE:
            self._cleared = self._cleared.union(bounds)
        if redraw is Redraw.BEFORE_MOVING:
            self._awaits_update = True

    def _whole_map(self) -> Bounds:
        spec = self.grid.spec
        return Bounds(
            spec.origin_x_m,
            spec.origin_y_m,
            spec.origin_x_m + spec.size_x * spec.resolution_m,
            spec.origin_y_m + spec.size_y * spec.resolution_m,
        )
