"""The path that a quadcopter has flown, as a topic."""

from __future__ import annotations

import rospy
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Path

from quad_nav.geometry import Pose3D
from quad_nav.ros.common.nav_messages import planar_pose, pose_stamped
from quad_nav.topics.flown_path import FlownPath


class PathPublisher:
    """Publishes where a quadcopter has been, twice a second while it moves."""

    def __init__(self, topic: str):
        self._publisher = rospy.Publisher(topic, Path, queue_size=1, latch=True)
        self._path: FlownPath[PoseStamped] = FlownPath(_stamped)

    def clear(self) -> None:
        self._path.clear()

    def add(self, stamp_s: float, pose: Pose3D) -> None:
        """Take a pose in ``map``; publish when it is time."""
        if self._path.add(stamp_s, pose):
            path = Path(poses=list(self._path.poses))
            path.header.frame_id, path.header.stamp = "map", rospy.Time.from_sec(stamp_s)
            self._publisher.publish(path)


def _stamped(stamp_s: float, pose: Pose3D) -> PoseStamped:
    return pose_stamped(planar_pose(pose.to_2d(), pose.z_m), "map", rospy.Time.from_sec(stamp_s))
