"""A costmap's topics: the full grid, its updates and the footprint.

The rules are the original's: nothing is published without a listener; what ``CostmapNews``
says; one full grid for every new listener; with a publish frequency of 0 that is all.
"""

from __future__ import annotations

import rospy
from geometry_msgs.msg import PolygonStamped
from map_msgs.msg import OccupancyGridUpdate
from nav_msgs.msg import OccupancyGrid

from quad_nav.costmap.cost_grid import Window
from quad_nav.costmap.layered import LayeredCostmap
from quad_nav.footprint import oriented
from quad_nav.geometry import Pose2D
from quad_nav.ros.common.names import Names, own_node
from quad_nav.ros.common.nav_messages import grid_message, polygon_message, update_message
from quad_nav.ros.navigator.voxel_publisher import voxel_publishers
from quad_nav.topics.costmap_updates import CostmapNews


class _NewListener(rospy.SubscribeListener):
    def __init__(self, send):
        self._send = send

    def peer_subscribe(self, topic_name, topic_publish, peer_publish):
        self._send(peer_publish)


class CostmapPublisher:
    """Publishes one costmap below ``~<name>/``. ``lock`` guards the costmap."""

    def __init__(self, name: str, costmap: LayeredCostmap, lock, names: Names = own_node):
        self._costmap = costmap
        self._lock = lock
        self._news = CostmapNews(costmap)
        self._footprint = rospy.Publisher(names(f"~{name}/footprint"), PolygonStamped, queue_size=1)
        self._updates = rospy.Publisher(
            names(f"~{name}/costmap_updates"), OccupancyGridUpdate, queue_size=10
        )
        self._grid = rospy.Publisher(
            names(f"~{name}/costmap"),
            OccupancyGrid,
            queue_size=1,
            subscriber_listener=_NewListener(self._send_full),
        )
        self._voxels = voxel_publishers(names(f"~{name}"), costmap)

    def restart(self, now_s: float) -> None:
        """For a clock that has jumped back."""
        self._news.restart(now_s)

    def updated(self, now_s: float, pose: Pose2D, window: Window) -> None:
        """To be called after each update of the costmap, with the window it changed."""
        params, stamp = self._costmap.params, rospy.Time.from_sec(now_s)
        if self._footprint.get_num_connections() > 0:
            self._footprint.publish(
                polygon_message(oriented(self._costmap.footprint, pose), params.global_frame, stamp)
            )
        for voxels in self._voxels:
            voxels.publish(params.global_frame, stamp)
        if self._news.note(now_s, window):
            self._publish(stamp)

    def _publish(self, stamp: rospy.Time) -> None:
        costmap, changed = self._costmap, self._news.take()
        if self._grid.get_num_connections() == 0 and self._updates.get_num_connections() == 0:
            return
        if self._news.wants_full_grid():
            self._grid.publish(self._full(stamp))
        elif not changed.is_empty:
            part = costmap.costs[changed.slices]
            self._updates.publish(
                update_message(part, changed.x0, changed.y0, costmap.params.global_frame, stamp)
            )

    def _full(self, stamp: rospy.Time) -> OccupancyGrid:
        costmap = self._costmap
        return grid_message(costmap.spec, costmap.costs, costmap.params.global_frame, stamp)

    def _send_full(self, send) -> None:
        with self._lock:
            message = self._full(rospy.Time.now())
        send(message)
