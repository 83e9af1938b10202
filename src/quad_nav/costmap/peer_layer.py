"""Peer layer: where the other robots stand and where they will be.

In the global costmap peers cost, and are no obstacles: a plan goes round them if that is not much
longer, because a peer may have to make room. In the local costmap a parked peer is an obstacle. The
obstacle layers ignore LIDAR points on known peers (``ObstacleLayer.excluded_circles``), so that no
obstacle stays where a peer was.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Sequence, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.costmap.cost_grid import NOWHERE, Bounds, CostGrid, Window
from quad_nav.costmap.cost_grid_kernel import raise_discs
from quad_nav.costmap.layer import Layer, LayerParams
from quad_nav.geometry import Pose2D
from quad_nav.grid import GridSpec


@dataclass(frozen=True)
class PeerArea:
    """Discs of equal cost.

    Attributes:
        points: float64[n, 2], their centres in the costmap's frame, metres.
        radius_m: Their radius.
        cost: Cost of cells in them.
    """

    points: NDArray[np.float64]
    radius_m: float
    cost: int


@dataclass(frozen=True)
class PeerLayerParams(LayerParams):
    """Parameters of the peer layer: none of its own. Without peers it writes nothing."""

    def make_layer(self, spec: GridSpec, rolling_window: bool, default_cost: int) -> PeerLayer:
        """Make a peer layer."""
        return PeerLayer(self)


class PeerLayer(Layer):
    """Writer of the areas of peers."""

    def __init__(self, params: PeerLayerParams = PeerLayerParams()) -> None:
        super().__init__(params)
        self._areas: Tuple[PeerArea, ...] = ()
        self._written = NOWHERE

    def set_areas(self, areas: Sequence[PeerArea]) -> None:
        """Replace all areas, from the next update on."""
        self._areas = tuple(areas)

    def reset(self, now_s: float) -> None:
        """Forget all areas."""
        self._areas = ()

    def update_bounds(self, robot: Pose2D, now_s: float, bounds: Bounds) -> Bounds:
        """Add the areas of now and those written last."""
        now = NOWHERE
        for area in self._areas:
            if len(area.points) == 1:
                x_m, y_m = area.points[0].tolist()
                around = Bounds(x_m, y_m, x_m, y_m)
            else:
                around = NOWHERE.including(area.points)
            now = now.union(around.grown(area.radius_m))
        before, self._written = self._written, now
        return bounds.union(before).union(now)

    def update_costs(self, master: CostGrid, window: Window) -> None:
        """Raise the cells of the areas."""
        for area in self._areas:
            raise_discs(master.view, area.points, area.radius_m, area.cost)
