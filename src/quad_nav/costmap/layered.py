"""Layered costmap: layers write into one master grid, in order.

    scans -> layers' own grids -> master grid -> planners

An update moves a rolling window along with the robot, asks each layer where it writes, resets the
smallest window that holds all of that, and lets the layers write into it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Dict, Iterable, List, Mapping, Optional, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav import footprint as footprints
from quad_nav.costmap.collision import footprint_cost
from quad_nav.costmap.cost_grid import NO_CELLS, NOWHERE, CostGrid, Square, Window
from quad_nav.costmap.inflation import InflationLayerParams
from quad_nav.costmap.layer import Layer, LayerParams, Redraw
from quad_nav.costmap.map_params import MapParams
from quad_nav.costmap.obstacle import ObstacleLayer, ObstacleLayerParams
from quad_nav.costmap.static import StaticLayer, StaticMap
from quad_nav.costmap.voxel import VoxelLayer
from quad_nav.geometry import Pose2D, Pose3D
from quad_nav.grid import FREE, UNKNOWN, GridSpec

WORKING_BYTES_PER_CELL = 36
"""Memory of the master grid, its copies, and the largest working arrays, measured.

Inflation takes up to 30 bytes for each cell, DWAPlannerROS 28, GlobalPlanner 14, NavfnROS 11;
inflation and planners do not run at the same time.
"""
MESSAGE_BYTES_PER_CELL = 9
"""Memory of a map's message for each cell: Python keeps a pointer for each value."""

NamedLayers = Tuple[Tuple[str, LayerParams], ...]


@dataclass(frozen=True)
class CostmapParams(MapParams):
    """Parameters of ``global_costmap`` or ``local_costmap``, as in costmap_2d.

    Attributes:
        layers: (name, parameters) of the layers in the order of updates.
    """

    layers: NamedLayers = (
        ("obstacle_layer", ObstacleLayerParams()),
        ("inflation_layer", InflationLayerParams()),
    )

    @property
    def spec(self) -> GridSpec:
        """Grid of these parameters."""
        return GridSpec(
            int(self.width_m / self.resolution_m),
            int(self.height_m / self.resolution_m),
            self.resolution_m,
            self.origin_x_m,
            self.origin_y_m,
        )

    @property
    def bytes_per_cell(self) -> int:
        """Most memory for each cell, of layers, inflation and planner together."""
        layers = (getattr(params, "bytes_per_cell", 1) for _, params in self.layers)
        return WORKING_BYTES_PER_CELL + sum(layers)

    @property
    def bytes_per_map_cell(self) -> int:
        """Most memory for each cell of a map: a costmap that does not roll takes its size."""
        if self.rolling_window:
            return MESSAGE_BYTES_PER_CELL + 3
        return MESSAGE_BYTES_PER_CELL + self.bytes_per_cell

    @property
    def unpadded_footprint(self) -> NDArray[np.float64]:
        """Footprint without padding, float64[n, 2] in the robot's frame."""
        if self.footprint is None:
            return footprints.circle(self.robot_radius_m)
        return np.array(self.footprint, dtype=np.float64)


class LayeredCostmap:
    """Costs around one robot.

    Attributes:
        params: Parameters.
        layers: Layers by name, in the order of updates.
        footprint: Padded footprint, float64[n, 2] in the robot's frame.
        inscribed_radius_m: Inscribed radius of the padded footprint.
        circumscribed_radius_m: Circumscribed radius of the padded footprint.
    """

    def __init__(self, params: CostmapParams, static_map: Optional[StaticMap] = None) -> None:
        self.params = params
        default_cost = UNKNOWN if params.track_unknown_space else FREE
        self._master = CostGrid(params.spec, default_cost)
        self._size_locked = False
        self._map_poses: Mapping[str, Optional[Pose3D]] = {}
        self.layers: Dict[str, Layer] = {
            name: layer_params.make_layer(params.spec, params.rolling_window, default_cost)
            for name, layer_params in params.layers
        }
        layers = self.layers.values()
        self._static_layers = [layer for layer in layers if isinstance(layer, StaticLayer)]
        self.set_footprint(params.unpadded_footprint)
        if static_map is not None:
            self.set_map(static_map)

    @property
    def spec(self) -> GridSpec:
        """Grid of the costs."""
        return self._master.spec

    @property
    def costs(self) -> NDArray[np.uint8]:
        """Master grid, uint8[H, W]; copy what has to outlive an update."""
        return self._master.costs

    def footprint_cost(self, pose: Pose2D) -> float:
        """Return the highest cost under the footprint's outline; see ``collision``."""
        at = float(pose.x_m), float(pose.y_m), float(pose.yaw_rad)
        return footprint_cost(self._master.view, self.footprint, at)

    def update(self, now_s: float, robot: Pose2D) -> Window:
        """Update the master grid for a robot at a pose in the global frame.

        Returns:
            Cells that may have changed. Inflation can change costs up to two inflation radii
            outside of them, as in costmap_2d.
        """
        if self.params.rolling_window:
            self._master.centre_on(robot.x_m, robot.y_m)
        layers = self._enabled_layers()
        bounds = NOWHERE
        for layer in layers:
            bounds = layer.update_bounds(robot, now_s, bounds)
        window = self._master.window_of(bounds)
        # As in costmap_2d an empty window counts unless its end is below its begin: inflation
        # can change costs outside of it.
        if not layers or window.xn < window.x0 or window.yn < window.y0:
            return NO_CELLS
        self._master.reset(window)
        for layer in layers:
            layer.update_costs(self._master, window)
        return window

    def is_current(self, now_s: float) -> bool:
        """Tell whether every enabled layer is recent enough to drive by."""
        return all(layer.is_current(now_s) for layer in self._enabled_layers())

    def stale_sources(self, now_s: float) -> List[Tuple[str, float]]:
        """Return (layer/sensor, seconds since its last message) of each silent sensor."""
        return [
            (f"{name}/{source}", age_s)
            for name, layer in self.layers.items()
            if layer.params.enabled
            for source, age_s in layer.stale_sources(now_s)
        ]

    def reset_layers(self, now_s: float) -> None:
        """Forget all costs, as the service ``clear_costmaps`` does."""
        self._master.reset()
        for layer in self.layers.values():
            layer.reset(now_s)

    def clear_area(
        self,
        layer_names: Iterable[str],
        square: Square,
        keep_inside: bool,
        redraw: Redraw = Redraw.BEFORE_MOVING,
    ) -> None:
        """Forget costs of the named layers outside (``keep_inside``) or inside of a square.

        ``redraw`` says when the master grid follows. Unknown names are ignored.
        """
        for name in [name for name in self.layers if name in set(layer_names)]:
            self.layers[name].clear_area(square, keep_inside, redraw)

    def free_layers(
        self, layer_names: Iterable[str], square: Square, redraw: Redraw = Redraw.BEFORE_MOVING
    ) -> bool:
        """Free a square of the named layers; return False if none did: it leaves the map."""
        named = [self.layers[name] for name in self.layers if name in set(layer_names)]
        return any([layer.free_square(square, redraw) for layer in named])

    def free_square(self, square: Square) -> None:
        """Make the master grid free in a square.

        Layers with other knowledge overwrite it at the next update. A square that leaves the
        map is ignored.
        """
        self._master.fill_polygon(square.corners, FREE)

    @property
    def obstacle_layers(self) -> List[str]:
        """Names of the layers that sensors write to."""
        return [name for name, layer in self.layers.items() if isinstance(layer, ObstacleLayer)]

    def set_footprint(self, footprint: footprints.Footprint) -> None:
        """Take an unpadded footprint, float64[n, 2] in the robot's frame."""
        self._unpadded_footprint = np.asarray(footprint, dtype=np.float64)
        self.footprint = footprints.pad(footprint, self.params.footprint_padding_m)
        self.inscribed_radius_m, self.circumscribed_radius_m = footprints.radii(self.footprint)
        for layer in self.layers.values():
            layer.set_footprint(self.footprint, self.inscribed_radius_m)

    def set_map(self, static_map: StaticMap, layer_name: Optional[str] = None) -> None:
        """Set the map of the static layers, or of the one named.

        A costmap that is no rolling window takes the map's size and position and keeps them.
        """
        for name, layer in self.layers.items():
            if isinstance(layer, StaticLayer) and layer_name in (None, name):
                if not self.params.rolling_window and layer.accepts_maps:
                    self._resize(static_map.spec)
                    self._size_locked = True
                layer.set_map(static_map)
        self.set_map_poses(self._map_poses)

    @property
    def map_frames(self) -> Tuple[str, ...]:
        """Frames of the maps that need a transform: those of a rolling window in another frame."""
        if not self.params.rolling_window or not self._static_layers:
            return ()
        frames = {layer.map_frame for layer in self._static_layers}
        return tuple(sorted(frames - {"", self.params.global_frame}))

    def set_map_poses(self, map_from_global: Mapping[str, Optional[Pose3D]]) -> None:
        """Set the latest transforms to the frames of maps, for the following updates.

        A map whose frame, of ``map_frames``, has no pose of the global frame is not drawn. A
        costmap that is no rolling window ignores the frames of its maps.
        """
        self._map_poses = {**map_from_global, self.params.global_frame: Pose3D(0.0, 0.0, 0.0)}
        for layer in self._static_layers:
            layer.map_from_global = self._map_poses.get(layer.map_frame)

    def reconfigure(self, params: CostmapParams) -> None:
        """Take other parameters with the same list of layers and sources.

        Another size, resolution or origin empties the costmap, unless a map fixed them.
        """
        old, self.params = self.params, params
        if params.spec != old.spec and not self._size_locked:
            self._resize(params.spec)
        if (params.footprint, params.robot_radius_m) != (old.footprint, old.robot_radius_m):
            self.set_footprint(params.unpadded_footprint)
        elif params.footprint_padding_m != old.footprint_padding_m:
            self.set_footprint(self._unpadded_footprint)
        for name, layer_params in params.layers:
            if layer_params != self.layers[name].params:
                self.reconfigure_layer(name, layer_params)

    def reconfigure_layer(self, name: str, params: LayerParams) -> None:
        """Take other parameters of one layer, also equal ones, as its dynamic_reconfigure does."""
        layer = self.layers[name]
        layer.reconfigure(params)
        if isinstance(layer, VoxelLayer) and layer.is_empty:
            layer.resize(self.spec)  # a rolling window has moved on while the layer was disabled

    def _resize(self, spec: GridSpec) -> None:
        if spec != self.spec:
            self._master.resize(spec)
            for layer in self.layers.values():
                layer.resize(spec)

    def _enabled_layers(self) -> List[Layer]:
        return [layer for layer in self.layers.values() if layer.params.enabled]
