"""Voxel layer: an obstacle layer with heights.

Space is cut into voxels, each of them free, marked or unknown. Sensors mark the voxel of
each point and clear those along the ray to it, in three dimensions: a beam that passes
above a table does not clear it, as it would in the obstacle layer. Whenever a voxel
changes, its column becomes one cost:

* lethal with more than ``mark_threshold`` marked voxels;
* else, when it was cleared, unknown with more than ``unknown_threshold`` unknown voxels,
  and free otherwise.

The robot's footprint and the clearing recoveries clear costs only, as in costmap_2d: the voxels
stay, and count again when a sensor sees something in their column.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Iterator, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.costmap.cost_grid import shift
from quad_nav.costmap.observation import ObservationBuffer
from quad_nav.costmap.obstacle import ObstacleLayer, ObstacleLayerParams, combination_choice
from quad_nav.costmap.voxel_kernel import (
    RayLimits,
    VoxelGrid,
    clear_voxel_rays,
    is_inside,
    mark_voxels,
    ray_ends,
)
from quad_nav.geometry import Pose2D
from quad_nav.grid import FREE, LETHAL, UNKNOWN, GridSpec
from quad_nav.parameter import POSITIVE, deviation, fixed_flag, positive, signed, whole


@dataclass(frozen=True)
class VoxelLayerParams(ObstacleLayerParams):
    """Parameters of ``costmap_2d::VoxelLayer``.

    Attributes:
        clip_voxel_rays: Cut rays at all borders of the voxels, so that they clear up to there,
            and draw the cells around the sensor; False restores upstream behaviour, where rays
            whose end is above the voxels, or by rounding below them, clear nothing.
        redraw_emptied_voxels: Draw the layer again after a reconfiguration that changes values
            and empties it; it is not current until then. False restores upstream behaviour,
            where every reconfiguration empties the layer, and old obstacles stay drawn.
    """

    origin_z_m: float = signed("origin_z", 0.0, "metres", 0, None, "Lower border of the voxels.")
    z_resolution_m: float = positive("z_resolution", 0.2, "metres", 0, 50, "Height of a voxel.")
    z_voxels: int = whole("z_voxels", 10, "", 0, 16, "Voxels in a column.", domain=POSITIVE)
    unknown_threshold: int = whole(
        "unknown_threshold", 15, "", 0, 16, "Most unknown voxels of a column that is known."
    )
    mark_threshold: int = whole(
        "mark_threshold", 0, "", 0, 16, "Most marked voxels of a column that is free."
    )
    combination_method: int = combination_choice()

    publish_voxel_map: bool = fixed_flag(
        "publish_voxel_map", False, "Publish the voxels, and the marked ones as markers."
    )
    clip_voxel_rays: bool = deviation()
    redraw_emptied_voxels: bool = deviation()

    @property
    def bytes_per_cell(self) -> int:
        """Memory of costs and voxels, and of the voxels' copy when a rolling window moves."""
        return 1 + 2 * self.z_voxels

    def make_layer(self, spec: GridSpec, rolling_window: bool, default_cost: int) -> VoxelLayer:
        """Make a voxel layer."""
        return VoxelLayer(self, spec, rolling_window, self.cost_of_unseen(default_cost))


class VoxelLayer(ObstacleLayer):
    """Obstacle layer with voxels; ``grid`` has the costs of the columns.

    Attributes:
        voxels: uint8[H, W, Z], FREE, LETHAL or UNKNOWN.
    """

    params: VoxelLayerParams
    _clears_when_overdue = True

    def __init__(
        self, params: VoxelLayerParams, spec: GridSpec, rolling_window: bool, default_cost: int
    ) -> None:
        super().__init__(params, spec, rolling_window, default_cost)
        self._make_voxels()

    def reconfigure(self, params: VoxelLayerParams) -> None:
        """Take other parameters and empty the layer, as in costmap_2d.

        With ``redraw_emptied_voxels`` equal parameters empty nothing.
        """
        old = self.params
        super().reconfigure(params)
        switched = replace(
            old,
            clip_voxel_rays=params.clip_voxel_rays,
            redraw_emptied_voxels=params.redraw_emptied_voxels,
            notice_silence_at_once=params.notice_silence_at_once,
        )
        if switched == params and (switched != old or params.redraw_emptied_voxels):
            return
        self.grid.reset()
        self._make_voxels()
        if params.redraw_emptied_voxels:
            self._pass_on(self._whole_map())

    def resize(self, spec: GridSpec) -> None:
        """Follow the master grid, and forget all voxels."""
        super().resize(spec)
        self._make_voxels()

    def reset(self, now_s: float) -> None:
        """Forget costs and voxels; an overdue layer is current from the next update on."""
        was_current = self._was_current
        super().reset(now_s)
        self.voxels[...] = UNKNOWN
        self._was_current = was_current
        self._awaits_update = not was_current

    def forget_points(self, points: NDArray[np.float64]) -> None:
        """Free the columns of points; see ``ObstacleLayer.forget_points``."""
        rows, columns = self._cells_of(points)
        super().forget_points(points)
        freed = self.voxels[rows, columns]
        self.voxels[rows, columns] = np.where(freed == LETHAL, FREE, freed)

    @property
    def is_empty(self) -> bool:
        """True if every voxel is unknown."""
        return bool((self.voxels == UNKNOWN).all())

    def marked_voxels(self) -> NDArray[np.float64]:
        """Return the centres of the marked voxels, float64[n, 3] in the global frame."""
        y, x, z = np.nonzero(self.voxels == LETHAL)
        return self._origin + (np.column_stack((x, y, z)) + 0.5) * self._voxel_size

    def packed_voxels(self) -> NDArray[np.uint32]:
        """Return the columns as costmap_2d keeps them, uint32[H, W].

        Bit k is set unless the voxel k is free, bit 16 + k if it is marked. Without such a voxel
        bit k is set, too.
        """
        count = self.params.z_voxels
        bits = np.left_shift(1, np.arange(count))
        occupied = (self.voxels != FREE) @ bits + (0x10000 - (1 << count))
        packed: NDArray[np.uint32] = (((self.voxels == LETHAL) @ bits << 16) + occupied).astype(
            np.uint32
        )
        return packed

    def clearing_ends(self) -> Iterator[Tuple[float, NDArray[np.float32]]]:
        """Yield (stamp, float32[n, 3]): the ends of the rays of each observation that clears.

        They are those of the last update, in the global frame.
        """
        grid = self._voxel_grid()
        for buffer in self.buffers.values():
            for seen in buffer.observations if buffer.params.clearing else ():
                if len(seen.points) and is_inside(grid, *seen.sensor.tolist()):
                    ends = ray_ends(grid, seen.sensor, seen.points, self._limits(buffer))
                    yield seen.stamp_s, ends

    def _make_voxels(self) -> None:
        self.voxels = np.full(
            (*self.grid.spec.shape, self.params.z_voxels), UNKNOWN, dtype=np.uint8
        )

    @property
    def _origin(self) -> NDArray[np.float64]:
        spec = self.grid.spec
        return np.array([spec.origin_x_m, spec.origin_y_m, self.params.origin_z_m])

    @property
    def _voxel_size(self) -> NDArray[np.float64]:
        resolution_m = self.grid.spec.resolution_m
        return np.array([resolution_m, resolution_m, self.params.z_resolution_m])

    def _centre_on(self, robot: Pose2D) -> None:
        move_x, move_y = self.grid.centre_on(robot.x_m, robot.y_m)
        if move_x or move_y:
            shift(self.voxels, move_x, move_y, UNKNOWN)

    def _clear(self, buffer: ObservationBuffer, touched: NDArray[np.float64]) -> None:
        grid, limits = self._voxel_grid(), self._limits(buffer)
        for seen in buffer.observations:
            clear_voxel_rays(grid, seen.sensor, seen.points, limits, touched)

    def _mark(self, buffer: ObservationBuffer, touched: NDArray[np.float64]) -> None:
        grid, ranges = self._voxel_grid(), self._ranges(buffer.params)
        for seen in buffer.observations:
            mark_voxels(grid, seen.sensor, seen.marks, ranges.mark_m, ranges.max_height_m, touched)

    def _limits(self, buffer: ObservationBuffer) -> RayLimits:
        ranges = self._ranges(buffer.params)
        return RayLimits(ranges.clear_m, ranges.max_height_m, self.params.clip_voxel_rays)

    def _voxel_grid(self) -> VoxelGrid:
        return VoxelGrid(
            self.voxels,
            self.grid.costs,
            self._origin,
            self._voxel_size,
            self.params.unknown_threshold,
            self.params.mark_threshold,
        )
