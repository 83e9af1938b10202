"""Obstacle layer: ray tracing clears, then points mark.

At every update all kept observations are ray traced first, then all are marked. A point that a
newer scan cleared therefore comes back until its own scan expires, as in costmap_2d.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, Dict, List, Optional, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.costmap.cost_grid import Bounds, CostGrid, Window, merge_known, merge_maximum
from quad_nav.costmap.cost_grid_kernel import place_polygon
from quad_nav.costmap.layer import GridLayer, LayerParams, Redraw
from quad_nav.costmap.observation import Observation, ObservationBuffer, SourceParams
from quad_nav.costmap.observation_kernel import Ranges
from quad_nav.costmap.projection import outside_circles, scan_points, transform_points
from quad_nav.costmap.raytrace import clear_all_rays, mark_all_points
from quad_nav.geometry import Pose2D, Pose3D, Scan
from quad_nav.grid import FREE, LETHAL, UNKNOWN, GridSpec
from quad_nav.parameter import (
    Choice,
    choice,
    deviation,
    fixed_flag,
    fixed_number,
    fixed_text,
    flag,
    signed,
)

COMBINE_OVERWRITE = 0
COMBINE_MAXIMUM = 1
_COMBINATIONS = (
    Choice("Overwrite", COMBINE_OVERWRITE, "Overwrite values"),
    Choice("Maximum", COMBINE_MAXIMUM, "Take the maximum of the values"),
    Choice("Nothing", 99, "Do nothing"),
)


def combination_choice() -> Any:
    """Declare ``combination_method``, the last reconfigurable parameter of a layer's class."""
    return choice(
        "combination_method",
        COMBINE_MAXIMUM,
        _COMBINATIONS,
        "Method for combining two layers",
        choices_description="Method for combining layers enum",
    )


@dataclass(frozen=True)
class ObstacleLayerParams(LayerParams):
    """Parameters of ``costmap_2d::ObstacleLayer``.

    Attributes:
        combination_method: 0 overwrites known cells of the master grid, 1 takes the maximum, any
            other value leaves the master grid alone.
        track_unknown_space: None for the costmap's.
        observation_sources: Names of the ``sources``.
        notice_silence_at_once: The layer is not current as soon as a source is overdue; False
            restores upstream behaviour, where an update of the costmap finds out.
    """

    footprint_clearing_enabled: bool = flag(
        "footprint_clearing_enabled", True, "Clear the robot's footprint of obstacles."
    )
    max_obstacle_height_m: float = signed(
        "max_obstacle_height", 2.0, "metres", 0, 50, "Points above this height are ignored."
    )
    combination_method: int = combination_choice()

    obstacle_range_m: float = fixed_number(
        "obstacle_range", 2.5, "metres", "Range of marking, for sources that set none."
    )
    raytrace_range_m: float = fixed_number(
        "raytrace_range", 3.0, "metres", "Range of clearing, for sources that set none."
    )
    track_unknown_space: Optional[bool] = fixed_flag(
        "track_unknown_space", None, "Cells are unknown until seen; the costmap's if unset."
    )
    observation_sources: str = fixed_text(
        "observation_sources", "", "names separated by blanks", "Each has a namespace of its name."
    )
    sources: Tuple[SourceParams, ...] = ()
    notice_silence_at_once: bool = deviation()

    def make_layer(self, spec: GridSpec, rolling_window: bool, default_cost: int) -> ObstacleLayer:
        """Make an obstacle layer."""
        return ObstacleLayer(self, spec, rolling_window, self.cost_of_unseen(default_cost))

    def cost_of_unseen(self, default_cost: int) -> int:
        """Return the cost of cells that no sensor has seen, in a costmap with this default."""
        if self.track_unknown_space is None:
            return default_cost
        return UNKNOWN if self.track_unknown_space else FREE


class ObstacleLayer(GridLayer):
    """Layer of what sensors see; ``add_scan`` and ``add_cloud`` write to it.

    The sources are fixed at construction, but for the periods within which they are expected.

    Attributes:
        buffers: Observations by source.
        excluded_circles: float64[n, 3], rows x, y, radius in the global frame. Points within them
            are ignored, because another layer knows what is there.
    """

    params: ObstacleLayerParams
    # costmap_2d does not clear while a source that marks is overdue, but in its voxel layer.
    _clears_when_overdue = False

    def __init__(
        self, params: ObstacleLayerParams, spec: GridSpec, rolling_window: bool, default_cost: int
    ) -> None:
        super().__init__(params, spec, default_cost)
        self.buffers: Dict[str, ObservationBuffer] = {
            source.name: ObservationBuffer(source) for source in params.sources
        }
        self._rolling_window = rolling_window
        self._was_current = True  # at the last update
        self._footprint = np.empty((0, 2))
        self._footprint_now = np.empty((0, 2))
        self.excluded_circles = np.empty((0, 3))

    def add_scan(
        self,
        source_name: str,
        scan: Scan,
        global_from_sensor: Pose3D,
        now_s: float,
        global_from_origin: Optional[Pose3D] = None,
    ) -> None:
        """Take a scan that arrived at ``now_s``; the other arguments as ``observe_scan``."""
        observation = self.observe_scan(source_name, scan, global_from_sensor, global_from_origin)
        self.buffers[source_name].add(observation, now_s)

    def add_cloud(
        self,
        source_name: str,
        points: NDArray[np.float32],
        global_from_sensor: Pose3D,
        stamp_s: float,
        now_s: float,
        global_from_origin: Optional[Pose3D] = None,
    ) -> None:
        """Take points that arrived at ``now_s``; the other arguments as ``observe_cloud``."""
        observation = self.observe_cloud(
            source_name, points, global_from_sensor, stamp_s, global_from_origin
        )
        self.buffers[source_name].add(observation, now_s)

    def observe_scan(
        self,
        source_name: str,
        scan: Scan,
        global_from_sensor: Pose3D,
        global_from_origin: Optional[Pose3D] = None,
        unmarked_beams: Optional[NDArray[np.bool_]] = None,
    ) -> Observation:
        """Project a scan into the global frame.

        Args:
            source_name: Name of the observation source.
            scan: The scan.
            global_from_sensor: Pose of the scan's frame at its stamp.
            global_from_origin: Pose where rays start, if the source names a ``sensor_frame``
                other than the scan's.
            unmarked_beams: bool[n], beams that clear and do not mark, None for none.

        Returns:
            The points within the source's heights, for marking and for clearing; projected
            when they are first needed.
        """
        inf_is_valid, low_m, high_m = self.projection_key(source_name)
        circles = self.excluded_circles

        def project() -> NDArray[np.float32]:
            return scan_points(scan, inf_is_valid, global_from_sensor, (low_m, high_m), circles)

        origin = (global_from_origin or global_from_sensor).translation
        if unmarked_beams is None:
            return Observation(scan.stamp_s, origin, project)
        ranges_m = np.where(unmarked_beams, np.float32(np.nan), scan.ranges_m)
        marking = replace(scan, ranges_m=ranges_m)

        def project_marks() -> NDArray[np.float32]:
            return scan_points(marking, inf_is_valid, global_from_sensor, (low_m, high_m), circles)

        return Observation(scan.stamp_s, origin, project, project_marks)

    def observe_cloud(
        self,
        source_name: str,
        points: NDArray[np.float32],
        global_from_sensor: Pose3D,
        stamp_s: float,
        global_from_origin: Optional[Pose3D] = None,
    ) -> Observation:
        """Transform points, float32[n, 3] in the sensor's frame; see ``observe_scan``."""
        _, low_m, high_m = self.projection_key(source_name)
        points = transform_points(points, global_from_sensor, low_m, high_m)
        if len(self.excluded_circles):
            points = outside_circles(points, self.excluded_circles)
        origin = global_from_origin or global_from_sensor
        return Observation(stamp_s, origin.translation, lambda: points)

    def projection_key(self, source_name: str) -> Tuple[bool, float, float]:
        """Return what decides a projection besides poses and circles left out.

        Layers and sources with equal keys, poses and circles make equal observations.
        """
        source = self.buffers[source_name].params
        return (source.inf_is_valid, source.min_obstacle_height_m, source.max_obstacle_height_m)

    def forget_points(self, points: NDArray[np.float64]) -> None:
        """Free the cells of points, float64[n, 3] in the global frame, which something has left."""
        rows, columns = self._cells_of(points)
        if not len(rows):
            return
        self.grid.costs[rows, columns] = FREE
        low, high = points[:, :2].min(axis=0), points[:, :2].max(axis=0)
        self._pass_on(Bounds(*low.tolist(), *high.tolist()), Redraw.NEXT_UPDATE)

    def _cells_of(self, points: NDArray[np.float64]) -> Tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return rows and columns of the obstacles at points, float64[n, 3]."""
        spec, costs = self.grid.spec, self.grid.costs
        columns = np.floor((points[:, 0] - spec.origin_x_m) / spec.resolution_m).astype(np.int64)
        rows = np.floor((points[:, 1] - spec.origin_y_m) / spec.resolution_m).astype(np.int64)
        inside = (columns >= 0) & (columns < spec.size_x) & (rows >= 0) & (rows < spec.size_y)
        rows, columns = rows[inside], columns[inside]
        marked = costs[rows, columns] == LETHAL
        return rows[marked], columns[marked]

    def reconfigure(self, params: Any) -> None:
        """Take other parameters; of the sources only the expected periods change."""
        super().reconfigure(params)
        for source in params.sources:
            self.buffers[source.name].expect_within(source.expected_update_period_s)

    def set_footprint(self, footprint: NDArray[np.float64], inscribed_radius_m: float) -> None:
        """Take another footprint, under which the layer clears."""
        self._footprint = footprint

    def reset(self, now_s: float) -> None:
        """Forget the grid; the next update uses the kept observations again."""
        self.grid.reset()
        self._awaits_update = False
        self._was_current = True
        for buffer in self.buffers.values():
            buffer.restart_clock(now_s)

    def is_current(self, now_s: float) -> bool:
        """Tell whether no source is stale and the master grid is up to date."""
        if not self.params.notice_silence_at_once:
            return super().is_current(now_s) and self._was_current
        return super().is_current(now_s) and not self.stale_sources(now_s)

    def stale_sources(self, now_s: float) -> List[Tuple[str, float]]:
        """Return (name, seconds since its last message) of each silent source."""
        return [
            (name, buffer.silence_s(now_s))
            for name, buffer in self.buffers.items()
            if (buffer.params.marking or buffer.params.clearing) and not buffer.is_current(now_s)
        ]

    def update_bounds(self, robot: Pose2D, now_s: float, bounds: Bounds) -> Bounds:
        """Clear and mark with the kept observations."""
        if self._rolling_window:
            self._centre_on(robot)
        bounds = super().update_bounds(robot, now_s, bounds)
        for buffer in self.buffers.values():
            buffer.start_clock(now_s)
        self._was_current = not self.stale_sources(now_s)
        marking = [b for b in self.buffers.values() if b.params.marking]
        clearing = [b for b in self.buffers.values() if b.params.clearing]
        if not self._clears_when_overdue and not all(b.is_current(now_s) for b in marking):
            clearing = []
        touched = np.array([bounds.min_x_m, bounds.min_y_m, bounds.max_x_m, bounds.max_y_m])
        for buffer in clearing:
            self._clear(buffer, touched)
        for buffer in marking:
            self._mark(buffer, touched)
        if self.params.footprint_clearing_enabled:
            cos, sin = math.cos(robot.yaw_rad), math.sin(robot.yaw_rad)
            self._footprint_now = place_polygon(
                self._footprint, robot.x_m, robot.y_m, cos, sin, touched
            )
        return Bounds(*touched.tolist())

    def update_costs(self, master: CostGrid, window: Window) -> None:
        """Free the cells under the footprint and combine with the master grid."""
        if self.params.footprint_clearing_enabled:
            self.grid.fill_polygon(self._footprint_now, FREE)
        cells = window.slices
        below, above = master.costs[cells], self.grid.costs[cells]
        if self.params.combination_method == COMBINE_OVERWRITE:
            merge_known(below, above)
        elif self.params.combination_method == COMBINE_MAXIMUM:
            merge_maximum(below, above)

    def _centre_on(self, robot: Pose2D) -> None:
        self.grid.centre_on(robot.x_m, robot.y_m)

    def _clear(self, buffer: ObservationBuffer, touched: NDArray[np.float64]) -> None:
        ranges = self._ranges(buffer.params)
        clear_all_rays(self.grid.view, *buffer.stack(ranges), ranges.clear_m, touched)

    def _mark(self, buffer: ObservationBuffer, touched: NDArray[np.float64]) -> None:
        mark_all_points(self.grid.view, *buffer.stack(self._ranges(buffer.params)), touched)

    def _ranges(self, source: SourceParams) -> Ranges:
        """Return a source's ranges; the layer's where it sets none."""
        params = self.params
        clear_m, mark_m = source.raytrace_range_m, source.obstacle_range_m
        return Ranges(
            params.raytrace_range_m if clear_m is None else clear_m,
            params.obstacle_range_m if mark_m is None else mark_m,
            params.max_obstacle_height_m,
        )
