"""The peer layer: where the other robots stand and where they will be.

In the global costmap these are places to go round if that is not too long a way, and
not obstacles: a peer may have to make room. In the local costmap a peer that stays is
an obstacle. The LIDAR's points on a known peer are left out of the obstacle layers
(``ObstacleLayer.left_out``), so that it does not linger where it was.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Sequence, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.costmap.cost_grid import NOWHERE, Bounds, CostGrid, Window
from quad_nav.costmap.layer import Layer, LayerParams
from quad_nav.geometry import Pose2D
from quad_nav.grid import GridSpec
from quad_nav.kernels.peers import raise_discs


@dataclass(frozen=True)
class PeerArea:
    """Discs around points, float64[n, 2] in the costmap's frame, that cost so much."""

    points: NDArray[np.float64]
    radius_m: float
    cost: int


@dataclass(frozen=True)
class PeerLayerParams(LayerParams):
    """The layer has no parameters of its own; without peers it writes nothing."""

    def make_layer(self, spec: GridSpec, rolling_window: bool, default_cost: int) -> PeerLayer:
        return PeerLayer(self)


class PeerLayer(Layer):
    """Writes the areas that it was told of last."""

    def __init__(self, params: PeerLayerParams = PeerLayerParams()) -> None:
        super().__init__(params)
        self._areas: Tuple[PeerArea, ...] = ()
        self._written = NOWHERE

    def see(self, areas: Sequence[PeerArea]) -> None:
        """Forget the areas before; these count from the next update on."""
        self._areas = tuple(areas)

    def reset(self, now_s: float) -> None:
        self._areas = ()

    def update_bounds(self, robot: Pose2D, now_s: float, bounds: Bounds) -> Bounds:
        now = NOWHERE
        for area in self._areas:
            now = now.union(NOWHERE.including(area.points).grown(area.radius_m))
        before, self._written = self._written, now
        return bounds.union(before).union(now)

    def update_costs(self, master: CostGrid, window: Window) -> None:
        spec = master.spec
        for area in self._areas:
            raise_discs(
                master.costs,
                spec.origin_x_m,
                spec.origin_y_m,
                spec.resolution_m,
                area.points,
                area.radius_m,
                area.cost,
            )
