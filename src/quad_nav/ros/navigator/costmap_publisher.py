"""Publish a costmap: the full grid, its updates, the footprint and the voxels.

The rules are those of costmap_2d: publish only for subscribers; follow the schedule of
`CostmapSchedule`; send each new subscriber one full grid, also with a publish frequency of 0.
"""

from __future__ import annotations

import threading
from typing import Any, Callable, Optional

import rospy
from geometry_msgs.msg import PolygonStamped
from map_msgs.msg import OccupancyGridUpdate
from nav_msgs.msg import OccupancyGrid

from quad_nav.costmap.cost_grid import Window
from quad_nav.costmap.layered import LayeredCostmap
from quad_nav.costmap.voxel import VoxelLayer
from quad_nav.footprint import oriented
from quad_nav.geometry import Pose2D
from quad_nav.ros.common.conversions import time_message
from quad_nav.ros.common.nav_messages import grid_message, polygon_message, update_message
from quad_nav.ros.navigator.voxel_topics import VoxelTopics
from quad_nav.topics.publishing import CostmapSchedule, Names, topic_below

Publish = Callable[[Any], None]
"""Sends a message to one subscriber or to all."""


class NewSubscriber(rospy.SubscribeListener):
    """Call a function with the `publish` of each new subscriber."""

    def __init__(self, send: Callable[[Publish], None]) -> None:
        super().__init__()
        self._send = send

    def peer_subscribe(
        self, topic_name: str, topic_publish: Publish, peer_publish: Publish
    ) -> None:
        """Handle a new subscriber; rospy calls this in a thread of its own."""
        self._send(peer_publish)


class CostmapPublisher:
    """Publish one costmap below `~<name>/`."""

    def __init__(
        self, name: str, costmap: LayeredCostmap, lock: threading.RLock, names: Names
    ) -> None:
        """Advertise the topics of costmap ``name``; ``lock`` guards it."""
        self._costmap = costmap
        self._lock = lock
        self._schedule = CostmapSchedule(costmap)
        namespace = names(f"~{name}")
        topic = topic_below(namespace, costmap.params.published_footprint_topic)
        self._footprint = rospy.Publisher(topic, PolygonStamped, queue_size=1)
        self._updates = rospy.Publisher(
            f"{namespace}/costmap_updates", OccupancyGridUpdate, queue_size=10
        )
        self._grid = rospy.Publisher(
            f"{namespace}/costmap",
            OccupancyGrid,
            queue_size=1,
            subscriber_listener=NewSubscriber(self._send_full),
        )
        self._voxels = [
            VoxelTopics(f"{namespace}/{layer_name}", layer, costmap.params.global_frame)
            for layer_name, layer in costmap.layers.items()
            if isinstance(layer, VoxelLayer)
        ]

    def restart(self, now_s: float) -> None:
        """Restart the schedule after a clock jump."""
        self._schedule.restart(now_s)

    def publish(self, now_s: float, pose: Optional[Pose2D], window: Optional[Window]) -> None:
        """Publish what is due at the time of an update of the costmap.

        Args:
            now_s: Time of the update.
            pose: Robot pose in the costmap's global frame, None if unknown.
            window: Window that the update changed, None if it was not made.
        """
        stamp = time_message(now_s)
        if window is not None and pose is not None:
            self._publish_update(pose, stamp)
        if self._schedule.add(now_s, window):
            self._publish_grid(stamp)

    def _publish_update(self, pose: Pose2D, stamp: rospy.Time) -> None:
        costmap, frame = self._costmap, self._costmap.params.global_frame
        if self._footprint.get_num_connections() > 0:
            points = oriented(costmap.footprint, pose)
            self._footprint.publish(polygon_message(points, frame, stamp))
        for voxels in self._voxels:
            voxels.publish(stamp)

    def _publish_grid(self, stamp: rospy.Time) -> None:
        if self._grid.get_num_connections() == 0:
            return  # what changes meanwhile is in the first update
        costmap, changed = self._costmap, self._schedule.pop()
        if self._schedule.pop_full_grid():
            self._grid.publish(self._full(stamp))
        elif not changed.is_empty:
            part = costmap.costs[changed.slices]
            self._updates.publish(
                update_message(part, changed.x0, changed.y0, costmap.params.global_frame, stamp)
            )

    def _full(self, stamp: rospy.Time) -> OccupancyGrid:
        costmap = self._costmap
        return grid_message(costmap.spec, costmap.costs, costmap.params.global_frame, stamp)

    def _send_full(self, send: Publish) -> None:
        with self._lock:
            message = self._full(rospy.Time.now())
            # The first subscriber has the full grid by this; others may miss one that has moved.
            if self._grid.get_num_connections() <= 1 or not self._costmap.params.publish_on_time:
                self._schedule.pop_full_grid()
        send(message)
