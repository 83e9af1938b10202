"""What a costmap layer is.

A costmap is updated in two rounds. First every layer brings its own knowledge up to date
and says where the master grid has to be made again (``update_bounds``); then, on that
window, each one in turn writes into the master grid (``update_costs``).

A layer of your own: derive its parameters from ``LayerParams`` with a ``make_layer`` that
returns your ``Layer`` (or ``GridLayer``, if it keeps costs of its own between updates),
and name it in ``CostmapParams.layers``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, List, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.costmap.cost_grid import NOWHERE, Bounds, CostGrid, Window
from quad_nav.geometry import Pose2D
from quad_nav.grid import GridSpec


@dataclass(frozen=True)
class LayerParams:
    """Parameters that every layer has."""

    enabled: bool = True

    def make_layer(self, spec: GridSpec, rolling_window: bool, default_cost: int) -> Layer:
        """A layer for a master grid at ``spec`` whose empty cells have ``default_cost``."""
        raise NotImplementedError


class Layer:
    """Writes one kind of knowledge into a master grid.

    ``params`` may be replaced at any time with ``reconfigure``; a layer that is not
    enabled is passed over.
    """

    def __init__(self, params: Any) -> None:
        self.params = params

    def update_bounds(self, robot: Pose2D, now_s: float, bounds: Bounds) -> Bounds:
        """Get ready for an update; return ``bounds``, of the layers before, and one's own.

        ``robot`` is the robot's pose in the global frame.
        """
        return bounds

    def update_costs(self, master: CostGrid, window: Window) -> None:
        """Write into the window of the master grid, on top of the layers before."""

    def reconfigure(self, params: Any) -> None:
        """Take other parameters of the same kind."""
        self.params = params

    def resize(self, spec: GridSpec) -> None:
        """The master grid has another size, resolution or place, and is empty."""

    def set_footprint(self, footprint: NDArray[np.float64], inscribed_radius_m: float) -> None:
        """The padded footprint, float64[n, 2] in the robot's frame, has changed."""

    def reset(self, now_s: float) -> None:
        """Forget what was collected."""

    def clear_area(
        self, centre_x_m: float, centre_y_m: float, size_m: float, keep_inside: bool
    ) -> bool:
        """Forget a square's inside or its outside; False if there is nothing to forget."""
        return False

    def free_square(self, centre_x_m: float, centre_y_m: float, size_m: float) -> bool:
        """Take the obstacles in a square for gone; False if there is nothing to free."""
        return False

    def is_current(self, now_s: float) -> bool:
        """Whether what the layer knows is recent enough to drive by."""
        return True

    def stale_sources(self, now_s: float) -> List[Tuple[str, float]]:
        """(name, seconds since its last message) of each sensor that is silent."""
        return []


class GridLayer(Layer):
    """A layer with costs of its own, in ``grid``, kept between updates."""

    def __init__(self, params: Any, spec: GridSpec, default_cost: int) -> None:
        super().__init__(params)
        self.grid = CostGrid(spec, default_cost)
        self._cleared = NOWHERE
        self._awaits_update = False

    def resize(self, spec: GridSpec) -> None:
        self.grid.resize(spec)

    def update_bounds(self, robot: Pose2D, now_s: float, bounds: Bounds) -> Bounds:
        bounds = bounds.union(self._cleared)
        self._cleared = NOWHERE
        self._awaits_update = False
        return bounds

    def clear_area(
        self, centre_x_m: float, centre_y_m: float, size_m: float, keep_inside: bool
    ) -> bool:
        """As ``clear_costmap_recovery`` does: cells become unknown, which is "no opinion".

        The layer is not current until the next update has carried this to the master.
        """
        self.grid.forget_area(centre_x_m, centre_y_m, size_m, keep_inside)
        self._pass_on(self._whole_map())
        return True

    def is_current(self, now_s: float) -> bool:
        return not self._awaits_update

    def _pass_on(self, bounds: Bounds) -> None:
        """The next update makes the master grid there again; until then it is out of date."""
        self._cleared = self._cleared.union(bounds)
        self._awaits_update = True

    def _whole_map(self) -> Bounds:
        spec = self.grid.spec
        return Bounds(
            spec.origin_x_m,
            spec.origin_y_m,
            spec.origin_x_m + spec.size_x * spec.resolution_m,
            spec.origin_y_m + spec.size_y * spec.resolution_m,
        )
