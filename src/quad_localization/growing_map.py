"""A map that grows with every scan, at three resolutions.

The coarse ones widen the basin in which a scan finds its place: Kohlbrecher, Meyer, von Stryk and
Klingauf, "A flexible and scalable SLAM system with full 3D motion estimation", SSRR 2011.
"""

from __future__ import annotations

import math
from typing import List

import numpy as np
from numpy.typing import NDArray

from quad_localization.growing_map_kernel import MapView, insert
from quad_nav.costmap.static import StaticMap
from quad_nav.grid import GridSpec

LEVELS = 3
_BLOCK_M = 10.0
"""The map grows by so much at least, so that it rarely has to."""
_OCCUPIED, _FREE = 0.65, 0.196
"""Thresholds of map_server."""


class GrowingMap:
    """Occupancy of what scans have seen.

    Attributes:
        views: The map as kernels take it, the finest resolution first.
    """

    def __init__(self, resolution_m: float) -> None:
        """Create an empty map; ``resolution_m`` is that of the finest level."""
        self.views: List[MapView] = [
            MapView(np.zeros((0, 0), np.float32), 0.0, 0.0, resolution_m * 2**level)
            for level in range(LEVELS)
        ]
        self._seen = [np.zeros((0, 0), np.bool_) for _ in self.views]

    @property
    def is_empty(self) -> bool:
        """True before the first scan."""
        return not self.views[0].log_odds.size

    def distance_m(self, place: NDArray[np.float64]) -> float:
        """Return how far a place float64[2] is from the map, 0 from an empty one."""
        if self.is_empty:
            return 0.0
        view = self.views[0]
        low = np.array([view.origin_x_m, view.origin_y_m])
        high = low + view.resolution_m * np.array(view.log_odds.shape[::-1])
        return float(np.linalg.norm(place - np.clip(place, low, high)))

    def insert(self, sensor: NDArray[np.float64], points: NDArray[np.float64]) -> None:
        """Insert a scan: ends of beams float64[n, 2] from a sensor float64[2], all in ``map``."""
        corners = np.vstack([points, sensor[None]])
        self._grow_to(corners.min(axis=0), corners.max(axis=0))
        for view, seen in zip(self.views, self._seen):
            insert(view, sensor, points, seen)

    def _grow_to(self, low: NDArray[np.float64], high: NDArray[np.float64]) -> None:
        """Hold a rectangle, and keep a coarse cell around it."""
        coarsest = self.views[-1]
        margin_m, old = 2 * coarsest.resolution_m, np.array(coarsest.log_odds.shape[::-1])
        corner = np.array([coarsest.origin_x_m, coarsest.origin_y_m])
        far = corner + old * coarsest.resolution_m
        if self.is_empty:
            corner = far = coarsest.resolution_m * np.floor(low / coarsest.resolution_m)
        before = _cells(corner - (low - margin_m), coarsest.resolution_m)
        after = _cells(high + margin_m - far, coarsest.resolution_m)
        if not before.any() and not after.any():
            return
        corner = corner - before * coarsest.resolution_m
        for level, view in enumerate(self.views):
            scale = 2 ** (LEVELS - 1 - level)
            pads = [(scale * b, scale * a) for b, a in zip(before[::-1], after[::-1])]
            grown = np.pad(view.log_odds, pads)
            self.views[level] = MapView(
                grown, float(corner[0]), float(corner[1]), view.resolution_m
            )
            self._seen[level] = np.zeros(grown.shape, np.bool_)

    def grid(self) -> StaticMap:
        """Return the map with free, occupied and unknown cells."""
        view = self.views[0]
        occupied, free = (math.log(share / (1.0 - share)) for share in (_OCCUPIED, _FREE))
        cells = np.full(view.log_odds.shape, -1, np.int8)
        cells[view.log_odds < free] = 0
        cells[view.log_odds > occupied] = 100
        size_y, size_x = view.log_odds.shape
        spec = GridSpec(size_x, size_y, view.resolution_m, view.origin_x_m, view.origin_y_m)
        return StaticMap(cells, spec)


def _cells(missing_m: NDArray[np.float64], resolution_m: float) -> NDArray[np.int64]:
    """Return by how many cells to grow at each of two borders, 0 where nothing is missing."""
    wanted_m = np.where(missing_m > 0.0, np.maximum(missing_m, _BLOCK_M), 0.0)
    return np.ceil(wanted_m / resolution_m).astype(np.int64)
