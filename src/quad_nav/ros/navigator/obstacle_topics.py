"""Publish the tracked moving obstacles of a robot: markers for RViz, a point cloud for programs."""

from __future__ import annotations

import rospy
from sensor_msgs.msg import PointCloud2, PointField
from visualization_msgs.msg import MarkerArray

from quad_nav.costmap.scan_filter import ScanFilters
from quad_nav.costmap.tracks import Tracks
from quad_nav.ros.common.conversions import replacing_markers, time_message
from quad_nav.topics.publishing import Names, own_node
from quad_nav.topics.tracked_obstacles import (
    CLOUD_FIELDS,
    CLOUD_TOPIC,
    MARKERS_TOPIC,
    TrackSchedule,
    cloud_rows,
    track_markers,
)


class ObstacleTopics:
    """Publishes the tracks of a robot's scan filters where someone listens."""

    def __init__(self, filters: ScanFilters, frame: str, names: Names = own_node) -> None:
        """Advertise the topics; ``frame`` is that of the tracks."""
        self._filters, self._frame, self._schedule = filters, frame, TrackSchedule()
        self._markers = rospy.Publisher(names(f"~{MARKERS_TOPIC}"), MarkerArray, queue_size=1)
        self._cloud = rospy.Publisher(names(f"~{CLOUD_TOPIC}"), PointCloud2, queue_size=1)

    def restart(self, now_s: float) -> None:
        """Restart the schedule after a clock jump."""
        self._schedule.restart(now_s)

    def publish(self, now_s: float) -> None:
        """Publish the tracks if they are due."""
        tracks = self._schedule.pop(now_s, self._filters.tracks(now_s))
        if tracks is None:
            return
        frame = self._frame
        if self._markers.get_num_connections() > 0:
            shown = track_markers(tracks, frame)
            self._markers.publish(replacing_markers(shown))
        if self._cloud.get_num_connections() > 0:
            stamp = time_message(tracks.time_s if len(tracks) else now_s)
            self._cloud.publish(cloud_message(tracks, frame, stamp))


def cloud_message(tracks: Tracks, frame: str, stamp: rospy.Time) -> PointCloud2:
    """Convert tracks to a cloud with a point for each of them."""
    rows, size = cloud_rows(tracks), 4 * len(CLOUD_FIELDS)
    message = PointCloud2(
        height=1, width=len(rows), point_step=size, row_step=size * len(rows), is_dense=True
    )
    message.header.frame_id, message.header.stamp = frame, stamp
    message.fields = [
        PointField(name, 4 * k, PointField.FLOAT32, 1) for k, name in enumerate(CLOUD_FIELDS)
    ]
    message.data = rows.tobytes()
    return message
