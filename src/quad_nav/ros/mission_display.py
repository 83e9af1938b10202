"""The mission for RViz: numbered goal spheres and the paths flown."""
from __future__ import annotations

import collections
import math
from typing import Deque, List, Sequence

import rospy
from geometry_msgs.msg import PoseStamped, Vector3
from nav_msgs.msg import Path
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from quad_nav.geometry import Pose3D
from quad_nav.mission.sequencer import Sequencer
from quad_nav.ros.nav_messages import planar_pose, pose_stamped
from quad_nav.sim.colours import robot_rgba

DIAMETER_M, CURRENT_DIAMETER_M, TEXT_HEIGHT_M = 0.30, 0.45, 0.35
FLOWN_ALPHA, WAITING_ALPHA = 0.2, 0.75
PATH_PERIOD_S = 0.5
PATH_SPACING_M = 0.05
PATH_POSES = 5000


def goal_markers(sequencers: Sequence[Sequencer], altitude_m: float) -> MarkerArray:
    """All robots' goals: flown ones dimmed, the one in flight larger and opaque."""
    markers = [Marker(action=Marker.DELETEALL)]
    for robot, sequencer in enumerate(sequencers):
        for index in range(len(sequencer.sequence.goals)):
            markers += _goal_markers(robot, index, sequencer, altitude_m)
    for marker in markers:
        marker.header.frame_id = "map"
    return MarkerArray(markers)


def _goal_markers(robot: int, index: int, sequencer: Sequencer, altitude_m: float) -> List[Marker]:
    goal = sequencer.sequence.goals[index]
    is_current = sequencer.flight is not None and index == sequencer.index
    alpha = 1.0 if is_current else FLOWN_ALPHA if index < sequencer.index else WAITING_ALPHA
    diameter_m = CURRENT_DIAMETER_M if is_current else DIAMETER_M
    sphere = Marker(ns=f"goal{robot}", id=index, type=Marker.SPHERE, action=Marker.ADD,
                    color=_colour(robot, alpha), scale=Vector3(diameter_m, diameter_m, diameter_m))
    number = Marker(ns=f"goal{robot}_number", id=index, type=Marker.TEXT_VIEW_FACING,
                    action=Marker.ADD, text=str(index + 1),
                    color=ColorRGBA(0.1, 0.1, 0.1, max(alpha, 0.4)),
                    scale=Vector3(0.0, 0.0, TEXT_HEIGHT_M))
    for marker, above_m in ((sphere, 0.0), (number, diameter_m / 2 + TEXT_HEIGHT_M / 2)):
        marker.pose.position.x, marker.pose.position.y = goal.x_m, goal.y_m
        marker.pose.position.z = altitude_m + above_m
        marker.pose.orientation.w = 1.0
    return [sphere, number]


def _colour(robot: int, alpha: float) -> ColorRGBA:
    return ColorRGBA(*robot_rgba(robot, alpha))


class FlownPath:
    """Publishes where a quadcopter has been, twice a second while it moves."""

    def __init__(self, topic: str):
        self._publisher = rospy.Publisher(topic, Path, queue_size=1, latch=True)
        self._poses: Deque[PoseStamped] = collections.deque(maxlen=PATH_POSES)
        self._is_news = False
        self._next_s = 0.0

    def clear(self) -> None:
        self._poses.clear()
        self._next_s = 0.0

    def add(self, stamp_s: float, pose: Pose3D) -> None:
        """Take a pose in ``map``; publish when it is time."""
        stamp = rospy.Time.from_sec(stamp_s)
        if not self._poses or _apart_m(pose, self._poses[-1]) >= PATH_SPACING_M:
            self._poses.append(pose_stamped(planar_pose(pose.to_2d(), pose.z_m), "map", stamp))
            self._is_news = True
        if self._is_news and stamp_s >= self._next_s:
            self._is_news = False
            self._next_s = stamp_s + PATH_PERIOD_S
            path = Path(poses=list(self._poses))
            path.header.frame_id, path.header.stamp = "map", stamp
            self._publisher.publish(path)


def _apart_m(pose: Pose3D, message: PoseStamped) -> float:
    there = message.pose.position
    return math.hypot(pose.x_m - there.x, pose.y_m - there.y)
