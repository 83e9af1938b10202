"""Node `slam`: localize all robots of a flight by their scans, and publish the map that they make.

Callbacks store; one loop hands the scans to ``Slam``, as soon as the odometry at their stamps is
known. Each scan gives a transform `map -> odom{i}`.
"""

from __future__ import annotations

import threading
from collections import deque
from typing import Deque, Dict, List, Optional

import numpy as np
import rospy
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import OccupancyGrid
from sensor_msgs.msg import LaserScan

from quad_localization.ros.amcl_robot import SILENT_S
from quad_localization.ros.given_pose import given_pose
from quad_localization.ros.reset_watch import ResetWatch
from quad_localization.ros.transform_topic import TransformTopic
from quad_localization.slam import Slam, SlamPose
from quad_localization.warm_up import warm_up_slam
from quad_nav.errors import excerpt
from quad_nav.files.kernel_cache import COMPILING, announced
from quad_nav.files.values import is_number, is_whole
from quad_nav.geometry import Pose2D
from quad_nav.ros.common.conversions import (
    ScanMessage,
    pose_estimate_message,
    scan_from_message,
    transform_message,
)
from quad_nav.ros.common.diagnostics import ThrottledWarnings, publish_health
from quad_nav.ros.common.nav_messages import map_message
from quad_nav.ros.common.readiness import init_node
from quad_nav.ros.common.transforms import Transforms, TransformUnavailable
from quad_nav.topics.health import Health, Level
from quad_nav.topics.validation import scan_problem, stamp_problem

EXIT_BAD_INPUT = 2
MAP_PERIOD_S = 1.0
TOLERANCE_S = 0.1
"""Transforms are stamped ahead by so much, as those of amcl: they hold until the next scan."""
_POLL_S = 0.01
_QUEUE = 10


class SlamRobot:
    """Topics and waiting scans of one robot."""

    def __init__(self, number: int) -> None:
        self.number, self.name = number, f"quad{number}"
        self.odom, self.base = f"odom{number}", f"base_link{number}"
        self.scans: Deque[LaserScan] = deque(maxlen=_QUEUE)
        self.taken_s = -1.0  # stamp of the last scan that was taken
        self.warnings = ThrottledWarnings()
        self.pose: Optional[Pose2D] = None  # that a person gave
        self.publisher = rospy.Publisher(
            f"/slam_pose{number}", PoseWithCovarianceStamped, queue_size=1
        )
        self._subscribers = [
            rospy.Subscriber(f"/scan{number}", ScanMessage, self._on_scan, queue_size=_QUEUE),
            rospy.Subscriber(
                f"/initialpose{number}", PoseWithCovarianceStamped, self._on_pose, queue_size=1
            ),
        ]

    def _on_scan(self, message: LaserScan) -> None:
        stamp_s = message.header.stamp.to_sec()
        if stamp_s == self.taken_s:
            return  # a simulation that is paused repeats its scans
        problem = stamp_problem(stamp_s, rospy.get_time())
        problem = problem or scan_problem(scan_from_message(message))
        if problem:
            self.warnings.warn(f"{self.name}: /scan{self.number}: message dropped: {problem}")
        else:
            self.scans.append(message)

    def _on_pose(self, message: PoseWithCovarianceStamped) -> None:
        try:
            self.pose = given_pose(message, "map")[0].to_2d()
        except ValueError as error:
            self.warnings.warn(f"{self.name}: initial pose dropped: {error}", "pose")


class SlamNode:
    """The node: robots, map and transforms."""

    def __init__(self, robots: int, starts: Dict[int, Pose2D]) -> None:
        """Advertise; without a start a robot's odometry frame is ``map``, roughly."""
        self._starts = starts
        self._lock = threading.Lock()  # the diagnostics have their own thread
        self._robots = [SlamRobot(number) for number in range(robots)]
        self._begin_map()
        self._transforms = Transforms()
        self._tf, self._resets = TransformTopic(), ResetWatch()
        self._map = rospy.Publisher("/map", OccupancyGrid, queue_size=1, latch=True)
        self._map_s, self._now_s = -MAP_PERIOD_S, 0.0
        publish_health(self._health)

    def _begin_map(self) -> None:
        self._frames = {one.number: Pose2D(0.0, 0.0) for one in self._robots}
        self._slam = Slam(self._frames)

    def spin(self) -> None:
        """Run until ROS shuts down."""
        while not rospy.is_shutdown():
            self.step()
            rospy.rostime.wallsleep(_POLL_S)

    def step(self) -> None:
        """Handle what has come: poses and scans whose odometry is known."""
        self._check_clock()
        for robot in self._robots:
            with self._lock:
                self._set_pose(robot)
                while robot.scans and self._take(robot, robot.scans[0]):
                    robot.scans.popleft()
        self._publish_map()

    def _check_clock(self) -> None:
        """Forget the scans of a time that comes again."""
        before_s, self._now_s = self._now_s, rospy.get_time()
        if self._now_s < before_s:
            for robot in self._robots:
                robot.scans.clear()
            self._map_s = self._now_s - MAP_PERIOD_S
        if self._resets.pop(self._now_s):
            self._reset()

    def _reset(self) -> None:
        """Begin a new map: the simulation is reset."""
        with self._lock:
            self._begin_map()
            self._tf.forget()
            for robot in self._robots:
                robot.scans.clear()
                robot.taken_s, robot.pose = -1.0, None

    def _take(self, robot: SlamRobot, message: LaserScan) -> bool:
        """Hand a scan to the map; return False while its odometry may still come."""
        stamp = message.header.stamp
        self._resets.begin(stamp.to_sec())
        try:
            odom_from_base = self._transforms.lookup(robot.odom, robot.base, stamp)
            odom_from_lidar = self._transforms.lookup(robot.odom, message.header.frame_id, stamp)
        except TransformUnavailable as error:
            reason = excerpt(str(error))
            latest = self._transforms.locate(robot.odom, robot.base, stamp.to_sec(), 0.0)
            if latest is None and (error.later or robot.taken_s < 0.0):
                if len(robot.scans) == _QUEUE:
                    robot.warnings.warn(f"{robot.name}: scans wait for tf: {reason}")
                return False
            robot.warnings.warn(f"{robot.name}: /scan{robot.number}: message dropped: {reason}")
            return True
        if stamp.to_sec() == robot.taken_s:
            return True
        scan, base = scan_from_message(message), odom_from_base.to_2d()
        if robot.taken_s < 0.0 and robot.number in self._starts:
            start = self._starts[robot.number]
            self._frames[robot.number] = start.compose(base.inverse())
        robot.taken_s = stamp.to_sec()
        place = self._slam.add_scan(robot.number, scan, base, odom_from_lidar)
        self._publish(robot, place, stamp)
        return True

    def _publish(self, robot: SlamRobot, place: SlamPose, stamp: rospy.Time) -> None:
        """Publish a robot's place; without it, the navigator of a robot that is lost stops."""
        if place.is_lost:
            return
        ahead = stamp + rospy.Duration(TOLERANCE_S)
        frame = transform_message(place.map_from_odom.to_3d(), "map", robot.odom, ahead)
        self._tf.send(frame)
        if place.odom_from_base is not None:
            here = place.map_from_odom.compose(place.odom_from_base)
            robot.publisher.publish(pose_estimate_message(here, place.covariance, "map", stamp))

    def _set_pose(self, robot: SlamRobot) -> None:
        """Take the pose that a person gave, when there was a scan."""
        if robot.pose is not None and robot.number in self._slam.poses:
            given, robot.pose = robot.pose, None
            self._slam.set_pose(robot.number, given)

    def _publish_map(self) -> None:
        if self._slam.map.is_empty or self._now_s - self._map_s < MAP_PERIOD_S:
            return
        self._map_s = self._now_s
        self._map.publish(map_message(self._slam.map.grid(), rospy.Time(self._now_s)))

    def _health(self) -> List[Health]:
        with self._lock:
            now_s, poses = rospy.get_time(), self._slam.poses
            return [
                _health_of(one.name, poses.get(one.number), now_s - one.taken_s)
                for one in self._robots
            ]


def _health_of(name: str, place: Optional[SlamPose], silent_s: float) -> Health:
    part = f"{name}: localization"
    if place is None:
        return Health(part, name, Level.WARN, "no scan with odometry yet")
    across_m = float(np.sqrt(place.covariance[:2, :2].trace()))
    values = {"fit": f"{place.fit:.2f}", "standard deviation": f"{across_m:.3f} m"}
    if place.is_lost:
        return Health(part, name, Level.ERROR, "lost: scans do not fit the map", values)
    if silent_s > SILENT_S:
        return Health(part, name, Level.WARN, "no scans with odometry", values)
    return Health(part, name, Level.OK, "localized", values)


def main() -> int:
    """Run the node; return 0, or 2 if a parameter is not valid."""
    init_node("slam")
    with announced(lambda: rospy.loginfo("%s", COMPILING)):
        warm_up_slam()
    robots = rospy.get_param("~robots", 2)
    if not is_whole(robots) or robots < 1:
        rospy.logfatal("slam: robots: %s; expected a whole number, at least 1", robots)
        return EXIT_BAD_INPUT
    starts = {}
    for number in range(robots):
        given = rospy.get_param(f"~start{number}", None)
        if given is None:
            continue
        if not isinstance(given, list) or len(given) != 3 or not all(map(is_number, given)):
            rospy.logfatal(
                "slam: start%d: %s; expected its first pose in map, [x, y, yaw]", number, given
            )
            return EXIT_BAD_INPUT
        starts[number] = Pose2D(*map(float, given))
    try:
        SlamNode(robots, starts).spin()
    except rospy.ROSException:
        if not rospy.core.is_shutdown_requested():  # at shutdown rospy closes the topics
            raise
    return 0
