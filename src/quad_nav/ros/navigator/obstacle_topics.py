"""Publish the tracked moving obstacles of a robot: markers for RViz, numbers for programs."""

from __future__ import annotations

import rospy
from quad.msg import MovingObstacle, MovingObstacles
from visualization_msgs.msg import MarkerArray

from quad_nav.costmap.scan_filter import ScanFilters
from quad_nav.ros.common.marker_messages import replacing_markers
from quad_nav.ros.common.own_messages import stamped
from quad_nav.topics.publishing import Names
from quad_nav.topics.tracked_obstacles import (
    MARKERS_TOPIC,
    TRACKS_TOPIC,
    TrackSchedule,
    obstacle_fields,
    track_markers,
)


class ObstacleTopics:
    """Publishes the tracks of a robot's scan filters where someone listens."""

    def __init__(self, filters: ScanFilters, frame: str, names: Names) -> None:
        self._filters, self._frame, self._schedule = filters, frame, TrackSchedule()
        self._markers = rospy.Publisher(names(f"~{MARKERS_TOPIC}"), MarkerArray, queue_size=1)
        self._obstacles = rospy.Publisher(names(f"~{TRACKS_TOPIC}"), MovingObstacles, queue_size=1)

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
        if self._obstacles.get_num_connections() > 0:
            obstacles = {
                name: [MovingObstacle(**fields) for fields in each]
                for name, each in obstacle_fields(tracks).items()
            }
            stamp_s = tracks.time_s if len(tracks) else now_s
            self._obstacles.publish(stamped(MovingObstacles, obstacles, stamp_s, frame))
