"""Subscribe to map topics, and update and place the static layers of costmaps."""

from __future__ import annotations

import threading
from typing import Dict, List, Optional, Sequence

import numpy as np
import rospy
from map_msgs.msg import OccupancyGridUpdate
from nav_msgs.msg import OccupancyGrid

from quad_nav.costmap.layered import MESSAGE_BYTES_PER_CELL, LayeredCostmap
from quad_nav.costmap.static import UPDATE_BYTES_PER_CELL, StaticLayer, StaticMap
from quad_nav.errors import excerpt
from quad_nav.geometry import Pose3D
from quad_nav.grid import GridSpec
from quad_nav.ros.common.diagnostics import ThrottledWarnings
from quad_nav.ros.common.transforms import Transforms, TransformUnavailable
from quad_nav.topics.publishing import Names
from quad_nav.topics.validation import grid_problem

_SAME_TURN = 1e-6


class MapListener:
    """Map topic of one static layer."""

    def __init__(
        self,
        costmap: LayeredCostmap,
        name: str,
        layer: StaticLayer,
        lock: threading.RLock,
        names: Names,
    ) -> None:
        """Subscribe to the map of layer ``name``; ``lock`` guards the costmap."""
        self._costmap = costmap
        self._name = name
        self._layer = layer
        self._lock = lock
        self._warnings = ThrottledWarnings()
        topic = names(layer.params.map_topic)
        self._grid = rospy.Subscriber(topic, OccupancyGrid, self._on_map, queue_size=1)
        if layer.params.subscribe_to_updates:
            self._updates = rospy.Subscriber(
                topic + "_updates", OccupancyGridUpdate, self._on_update, queue_size=10
            )

    def _on_map(self, message: OccupancyGrid) -> None:
        info, origin = message.info, message.info.origin.position
        problem = grid_problem(
            info.width,
            info.height,
            info.resolution,
            len(message.data),
            (origin.x, origin.y),
            self._costmap.params.bytes_per_map_cell,
        )
        if problem:
            self._warnings.warn(f"{self._grid.resolved_name}: map dropped: {problem}")
            return
        spec = GridSpec(info.width, info.height, info.resolution, origin.x, origin.y)
        frame, wanted = message.header.frame_id, self._costmap.params.global_frame
        if frame.lstrip("/") != wanted.lstrip("/") and not self._costmap.params.rolling_window:
            self._warnings.warn(
                f"{self._grid.resolved_name}: map is in frame '{excerpt(frame)}', expected"
                f" '{wanted}'; using it without a transform"
            )
        turn = info.origin.orientation
        if abs(turn.x) + abs(turn.y) + abs(turn.z) > _SAME_TURN:
            self._warnings.warn(
                f"{self._grid.resolved_name}: map's origin is rotated, which costmaps ignore, as"
                " costmap_2d does: its obstacles are elsewhere; expected an origin without yaw"
            )
        occupancy = np.array(message.data, dtype=np.int8).reshape(spec.shape)
        with self._lock:
            self._costmap.set_map(StaticMap(occupancy, spec, frame), self._name)
        if self._layer.params.first_map_only:
            self._grid.unregister()

    def _on_update(self, message: OccupancyGridUpdate) -> None:
        problem = grid_problem(
            message.width,
            message.height,
            1.0,
            len(message.data),
            bytes_per_cell=MESSAGE_BYTES_PER_CELL + UPDATE_BYTES_PER_CELL,
        )
        if problem:
            self._warnings.warn(f"{self._updates.resolved_name}: map update dropped: {problem}")
            return
        part = np.array(message.data, dtype=np.int8).reshape(message.height, message.width)
        with self._lock:
            self._layer.update_map(part, message.x, message.y)


def connect(
    costmaps: Sequence[LayeredCostmap], lock: threading.RLock, names: Names
) -> List[MapListener]:
    """Subscribe to the map topic of every static layer."""
    return [
        MapListener(costmap, name, layer, lock, names)
        for costmap in costmaps
        for name, layer in costmap.layers.items()
        if isinstance(layer, StaticLayer)
    ]


def map_poses(
    robot: str, costmap: LayeredCostmap, transforms: Transforms, warnings: ThrottledWarnings
) -> Dict[str, Optional[Pose3D]]:
    """Return the latest poses of a costmap's frame in those of its maps; warn of missing ones.

    Args:
        robot: Name with which the warning begins.
        costmap: The costmap; one that needs no transform gets none.
        transforms: Transform tree.
        warnings: Takes the warning.
    """
    poses: Dict[str, Optional[Pose3D]] = {}
    wanted = costmap.params.global_frame
    for frame in costmap.map_frames:
        try:
            poses[frame] = transforms.lookup(frame, wanted)
        except TransformUnavailable as error:
            poses[frame] = None
            warnings.warn(
                f"{robot}: static map in frame '{excerpt(frame)}' left out of the costmap in"
                f" '{wanted}' until tf connects the frames: {error}"
            )
    return poses
