"""Static layer: a map made beforehand."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Optional, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.costmap.cost_grid import NO_CELLS, NOWHERE, Bounds, CostGrid, Window, merge_maximum
from quad_nav.costmap.layer import GridLayer, LayerParams
from quad_nav.geometry import Pose2D, Pose3D
from quad_nav.grid import FREE, LETHAL, UNKNOWN, GridSpec
from quad_nav.parameter import deviation, fixed_flag, fixed_text, fixed_whole

UPDATE_BYTES_PER_CELL = 30
"""Memory of a map update's indices and costs, for each of its cells."""


@dataclass(frozen=True)
class StaticMap:
    """Map as in ``nav_msgs/OccupancyGrid``.

    Attributes:
        occupancy: int8[H, W], 0..100, or -1 for unknown.
        spec: Grid of the map.
        frame: Frame of the map.
        yaw_rad: Heading of the grid about its lower left corner, which costmaps ignore.
    """

    occupancy: NDArray[np.int8]
    spec: GridSpec
    frame: str = "map"
    yaw_rad: float = 0.0


@dataclass(frozen=True)
class StaticLayerParams(LayerParams):
    """Parameters of ``costmap_2d::StaticLayer``.

    Attributes:
        draw_all_map_updates: Draw every map update, cut at the map's borders, and in a rolling
            window the whole map; False restores upstream behaviour: the last one alone, and
            in a rolling window its area alone until the next map.
        restore_static_map: ``reset`` restores and draws the whole map; False restores upstream
            behaviour: what was cleared stays so, and only the area of the last map or map
            update is drawn.
        transform_map_bounds: Draw the map where it is in the costmap's frame; False restores
            upstream behaviour: only where its own coordinates are in that frame.
    """

    map_topic: str = fixed_text("map_topic", "map", "a topic's name", "Topic of the map.")
    first_map_only: bool = fixed_flag("first_map_only", False, "Ignore all maps but the first.")
    subscribe_to_updates: bool = fixed_flag(
        "subscribe_to_updates", False, "Subscribe to the updates of the map too."
    )
    track_unknown_space: bool = fixed_flag(
        "track_unknown_space", True, "Unknown cells of the map stay unknown."
    )
    use_maximum: bool = fixed_flag(
        "use_maximum", False, "Use the maximum of the map's and the other layers' costs."
    )
    lethal_cost_threshold: int = fixed_whole(
        "lethal_cost_threshold", 100, "Smallest occupancy of an obstacle.", low=0, high=100
    )
    unknown_cost_value: int = fixed_whole(
        "unknown_cost_value", -1, "Occupancy that means unknown; counts modulo 256."
    )
    trinary_costmap: bool = fixed_flag(
        "trinary_costmap", True, "Cells are free, unknown or obstacles, without values between."
    )
    draw_all_map_updates: bool = deviation()
    restore_static_map: bool = deviation()
    transform_map_bounds: bool = deviation()

    @property
    def bytes_per_cell(self) -> int:
        """Memory of costs, map, and the map's copy with updates."""
        return 3

    def make_layer(self, spec: GridSpec, rolling_window: bool, default_cost: int) -> StaticLayer:
        """Make a static layer."""
        return StaticLayer(self, spec, rolling_window, default_cost)


class StaticLayer(GridLayer):
    """Copy of a map in the master grid.

    A costmap that is no rolling window takes the map's size and position (see
    ``LayeredCostmap.set_map``).

    Attributes:
        map_from_global: Latest pose of the costmap's global frame in the map's frame. It counts
            in rolling windows only; None if unknown: then the layer draws nothing.
    """

    params: StaticLayerParams

    def __init__(
        self, params: StaticLayerParams, spec: GridSpec, rolling_window: bool, default_cost: int
    ) -> None:
        super().__init__(params, spec, default_cost)
        self.map_from_global: Optional[Pose3D] = Pose3D(0.0, 0.0, 0.0)
        self._rolling_window = rolling_window
        self._map: Optional[StaticMap] = None
        self._owns_map = False
        self._last_area = NO_CELLS  # of the last map or map update
        self._changed = NO_CELLS  # since the last update of the costmap
        self._has_changed = False

    def resize(self, spec: GridSpec) -> None:
        """Follow the master grid, in a costmap that is no rolling window."""
        if not self._rolling_window:
            super().resize(spec)

    def reconfigure(self, params: StaticLayerParams) -> None:
        """Take other parameters; a layer that was enabled or disabled draws its whole map."""
        if params.enabled != self.params.enabled:
            self._mark_all_changed()
        self.params = params

    @property
    def map_frame(self) -> str:
        """Frame of the map, "" without a map."""
        return self._map.frame if self._map else ""

    @property
    def accepts_maps(self) -> bool:
        """False if the layer has its first map and ignores others."""
        return self._map is None or not self.params.first_map_only

    def set_map(self, static_map: StaticMap) -> None:
        """Take a map; with ``first_map_only`` later ones are ignored."""
        if not self.accepts_maps:
            return
        self._map, self._owns_map = static_map, False
        if self.grid.spec != static_map.spec:
            self.grid.resize(static_map.spec)
        self.grid.costs[...] = self.costs_of(static_map.occupancy)
        self._mark_all_changed()

    def update_map(self, occupancy: NDArray[np.int8], cell_x: int, cell_y: int) -> None:
        """Replace a rectangle of the map; before the first map it is ignored.

        Args:
            occupancy: int8[h, w]; what lies outside of the map is cut off. Without
                ``draw_all_map_updates`` cells beyond the right border go on at the left of the
                next row, as upstream.
            cell_x: Column of its lower left cell.
            cell_y: Row of its lower left cell.
        """
        if self._map is None:
            return
        height, width = occupancy.shape
        spec = self.grid.spec
        rows, columns = np.ogrid[cell_y : cell_y + height, cell_x : cell_x + width]
        cells = rows * spec.size_x + columns
        known = (cells >= 0) & (cells < spec.size_x * spec.size_y)
        self._last_area = Window(cell_x, cell_x + width, cell_y, cell_y + height)
        if self.params.draw_all_map_updates:
            known &= (columns >= 0) & (columns < spec.size_x)
            self._last_area = self._last_area.intersection(self._everything())
            if self._last_area.is_empty:
                return
        self.grid.costs.reshape(-1)[cells[known]] = self.costs_of(occupancy)[known]
        if self._map.spec == spec:
            self._own_map().occupancy.reshape(-1)[cells[known]] = occupancy[known]
        self._changed = self._changed.union(self._last_area)
        self._has_changed = True

    def costs_of(self, occupancy: NDArray[np.int8]) -> NDArray[np.uint8]:
        """Convert occupancies, int8 of any shape, to costs by the layer's thresholds."""
        table = np.array([self._cost_of(value) for value in range(256)], dtype=np.uint8)
        return table[np.ascontiguousarray(occupancy, dtype=np.int8).view(np.uint8)]

    def _cost_of(self, value: int) -> int:
        """Return the cost of an occupancy read as a byte: unknown, -1, is 255."""
        params = self.params
        threshold = max(min(params.lethal_cost_threshold, 100), 0)
        if value == params.unknown_cost_value % 256:
            return UNKNOWN if params.track_unknown_space else FREE
        if value >= threshold:
            return LETHAL
        return FREE if params.trinary_costmap else int(value / threshold * LETHAL)

    def reset(self, now_s: float) -> None:
        """Restore the map with its updates; without ``restore_static_map`` only draw it again."""
        self._awaits_update = False
        if self._map is None:
            return
        self._changed = self._changed.union(self._last_area)
        self._has_changed = True
        if self.params.restore_static_map:
            if self._map.spec == self.grid.spec:
                self.grid.costs[...] = self.costs_of(self._map.occupancy)
            self._mark_all_changed()

    def is_current(self, now_s: float) -> bool:
        """Tell whether there is a map with a place, and the master grid has it."""
        return super().is_current(now_s) and self._map is not None and self._is_placed

    def update_bounds(self, robot: Pose2D, now_s: float, bounds: Bounds) -> Bounds:
        """Add the changed part of the map, or all of it in a rolling window."""
        has_changed = self._has_changed or self._cleared != NOWHERE
        bounds = super().update_bounds(robot, now_s, bounds)
        if self._map is None or not (self._rolling_window or has_changed):
            return bounds
        area, self._changed, self._has_changed = self._changed, NO_CELLS, False
        if not self.params.draw_all_map_updates:
            area = self._last_area
        elif self._rolling_window:
            area = self._everything()
        elif area.is_empty:
            return bounds
        return bounds.including(self._corners(area)) if self._is_placed else bounds

    def _corners(self, area: Window) -> NDArray[np.float64]:
        """Return the corners of an area in the costmap's frame, float64[4, 2].

        As upstream they are the centres of its first cell and of the cell behind its last one.
        """
        spec = self.grid.spec
        corners = np.array(
            [spec.centre_of(x, y) for x in (area.x0, area.xn) for y in (area.y0, area.yn)]
        )
        if not self._rolling_window or not self.params.transform_map_bounds:
            return corners
        assert self.map_from_global is not None
        corners = np.column_stack((corners, np.zeros(len(corners))))
        return self.map_from_global.inverse().transform_points(corners)[:, :2]

    def update_costs(self, master: CostGrid, window: Window) -> None:
        """Copy the map into the window."""
        if self._map is None:
            return
        if self._rolling_window:
            self._copy_by_position(master, window)
        elif self.params.use_maximum:
            merge_maximum(master.costs[window.slices], self.grid.costs[window.slices])
        else:
            master.costs[window.slices] = self.grid.costs[window.slices]

    def _copy_by_position(self, master: CostGrid, window: Window) -> None:
        """Copy to each master cell the map cell under its centre."""
        if self.map_from_global is None:
            return
        x, y = _planar(self.map_from_global, *_centres(master.spec, window))
        spec = self.grid.spec
        column = (x - spec.origin_x_m) / spec.resolution_m
        row = (y - spec.origin_y_m) / spec.resolution_m
        inside = (column >= 0) & (column < spec.size_x) & (row >= 0) & (row < spec.size_y)
        found = self.grid.costs[row[inside].astype(np.intp), column[inside].astype(np.intp)]
        below = master.costs[window.slices]
        below[inside] = np.maximum(found, below[inside]) if self.params.use_maximum else found

    @property
    def _is_placed(self) -> bool:
        """False if bounds need a transform that is not known."""
        needed = self._rolling_window and self.params.transform_map_bounds
        return self.map_from_global is not None or not needed

    def _own_map(self) -> StaticMap:
        """Return the map, copied before its first change: robots share the one that was set."""
        assert self._map is not None
        if not self._owns_map:
            self._map = replace(self._map, occupancy=self._map.occupancy.copy())
            self._owns_map = True
        return self._map

    def _everything(self) -> Window:
        return Window(0, self.grid.spec.size_x, 0, self.grid.spec.size_y)

    def _mark_all_changed(self) -> None:
        self._last_area = self._changed = self._everything()
        self._has_changed = True


def _centres(spec: GridSpec, window: Window) -> Tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return world x, float64[1, n], and y, float64[m, 1], of a window's cell centres."""
    columns = np.arange(window.x0, window.xn, dtype=np.float64)
    rows = np.arange(window.y0, window.yn, dtype=np.float64)
    x = spec.origin_x_m + (columns + 0.5) * spec.resolution_m
    y = spec.origin_y_m + (rows + 0.5) * spec.resolution_m
    return x[None, :], y[:, None]


def _planar(
    a_from_b: Pose3D, x: NDArray[np.float64], y: NDArray[np.float64]
) -> Tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Transform points at z = 0, x float64[1, n] and y float64[m, 1], to the last bit as tf2."""
    qx, qy, qz, qw = a_from_b.quaternion
    scale = 2.0 / (qx * qx + qy * qy + qz * qz + qw * qw)
    xx, xy, yy = qx * (qx * scale), qx * (qy * scale), qy * (qy * scale)
    wz, zz = qw * (qz * scale), qz * (qz * scale)
    return (
        (1.0 - (yy + zz)) * x + (xy - wz) * y + a_from_b.x_m,
        (xy + wz) * x + (1.0 - (xx + zz)) * y + a_from_b.y_m,
    )
