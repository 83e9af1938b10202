"""The world of a transcript: a robot that obeys, boxes, a LIDAR, and the topics of all that."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, List, Sequence, Tuple

import numpy as np
import rospy
import tf2_ros
from geometry_msgs.msg import Point, Pose, Quaternion, TransformStamped, Twist
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import LaserScan, PointCloud2
from sensor_msgs.point_cloud2 import create_cloud_xyz32
from std_msgs.msg import Header

Placement = Tuple[float, float, float]


@dataclass
class World:
    """A robot among boxes.

    Attributes:
        start: Pose of the robot in the map: x, y in m, yaw in rad.
        map_from_odom: Pose of the odometry's frame in the map.
        boxes: Each [x0, y0, x1, y1] in the map, in metres. The LIDAR sees them.
        marks: Points of obstacles on the topic marks@, every 0.05 m on lines [x0, y0, x1, y1].
        beams: Of the LIDAR, which looks all around.
        range_m: Of the LIDAR.
        acceleration: Of the body, m/s2 and rad/s2; 0: it takes over a command at once.
        now_s: Simulated time.
    """

    start: Sequence[float] = (2.0, 2.0, 0.0)
    map_from_odom: Sequence[float] = (0.0, 0.0, 0.0)
    boxes: List[Sequence[float]] = field(default_factory=list)
    marks: List[Sequence[float]] = field(default_factory=list)
    beams: int = 360
    range_m: float = 10.0
    acceleration: float = 0.0
    now_s: float = 1.0

    def __post_init__(self) -> None:
        self.pose = np.array(self.start, dtype=np.float64)
        self.velocity, self.command = np.zeros(3), np.zeros(3)

    def step(self, dt_s: float) -> None:
        """Let time pass."""
        change = self.command - self.velocity
        if self.acceleration:
            most = self.acceleration * dt_s
            change = np.clip(change, -most, most)
        self.velocity = self.velocity + change
        vx, vy, turn = self.velocity
        cos, sin = math.cos(self.pose[2]), math.sin(self.pose[2])
        self.pose += np.array([cos * vx - sin * vy, sin * vx + cos * vy, turn]) * dt_s
        self.now_s = round(self.now_s + dt_s, 6)

    def in_odom(self) -> Placement:
        """The robot's pose in the odometry's frame."""
        x, y, yaw = self.map_from_odom
        dx, dy = self.pose[0] - x, self.pose[1] - y
        cos, sin = math.cos(yaw), math.sin(yaw)
        return cos * dx + sin * dy, cos * dy - sin * dx, self.pose[2] - yaw

    def ranges(self) -> np.ndarray:
        """float32[beams], inf without a return; the first beam looks backwards."""
        angles = self.pose[2] - math.pi + np.arange(self.beams) * (2.0 * math.pi / self.beams)
        ways = np.stack([np.cos(angles), np.sin(angles)], axis=1)
        nearest = np.full(self.beams, np.inf)
        with np.errstate(divide="ignore", invalid="ignore"):
            for box in np.asarray(self.boxes, dtype=np.float64).reshape(-1, 2, 2):
                hits = (box[:, np.newaxis] - self.pose[:2]) / ways
                enter, leave = hits.min(axis=0).max(axis=1), hits.max(axis=0).min(axis=1)
                seen = (enter <= leave) & (enter > 0.0)
                nearest = np.where(seen, np.minimum(nearest, enter), nearest)
        nearest[nearest > self.range_m] = np.inf
        return nearest.astype(np.float32)

    def marked_points(self) -> List[Tuple[float, float, float]]:
        """Points (x, y, z) of the marks in the map."""
        points = []
        for line in np.reshape(self.marks, (-1, 2, 2)):
            steps = max(1, round(float(np.abs(line[1] - line[0]).max()) / 0.05))
            points += [(x, y, 0.5) for x, y in np.linspace(*line, steps + 1).tolist()]
        return points


def pose_from_yaw(x: float, y: float, turn: Any) -> Pose:
    """A pose with a yaw or, if it is a list, a quaternion."""
    parts = turn if isinstance(turn, list) else (0.0, 0.0, math.sin(turn / 2), math.cos(turn / 2))
    return Pose(Point(x, y, 0.0), Quaternion(*parts))


class WorldTopics:
    """Clock, transforms, odometry and scans of a world; commands to it."""

    _PERIOD_STEPS = 5  # of odometry, transforms and scans: 20 Hz

    def __init__(self, world: World, robot: str) -> None:
        """Advertise the topics."""
        self._world, self._robot, self._steps = world, robot, 0
        self._clock = rospy.Publisher("/clock", Clock, queue_size=10)
        self._odom = rospy.Publisher(f"/odom{robot}", Odometry, queue_size=10)
        self._scan = rospy.Publisher(f"/scan{robot}", LaserScan, queue_size=10)
        self._marks = rospy.Publisher(f"/marks{robot}", PointCloud2, queue_size=10)
        self._tf = tf2_ros.TransformBroadcaster()
        rospy.Subscriber(f"/cmd_vel{robot}", Twist, self._obey)

    def _obey(self, message: Twist) -> None:
        self._world.command = np.array([message.linear.x, message.linear.y, message.angular.z])

    def publish(self) -> None:
        """Publish what is due at the world's time."""
        now = rospy.Time.from_sec(self._world.now_s)
        if self._steps % self._PERIOD_STEPS == 0:
            self._publish_state(now)
        self._clock.publish(Clock(now))
        self._steps += 1

    def _publish_state(self, now: rospy.Time) -> None:
        robot, world = self._robot, self._world
        odom, base, lidar = f"odom{robot}", f"base_link{robot}", f"Lidar{robot}"
        here = world.in_odom()
        self._tf.sendTransform(
            [
                transform("map", odom, now, world.map_from_odom),
                transform(odom, base, now, here),
                transform(base, lidar, now, (0.0, 0.0, 0.0)),
            ]
        )
        odometry = Odometry(child_frame_id=base)
        odometry.header.stamp, odometry.header.frame_id = now, odom
        odometry.pose.pose = pose_from_yaw(*here)
        twist = odometry.twist.twist
        twist.linear.x, twist.linear.y, twist.angular.z = world.velocity
        self._odom.publish(odometry)
        scan = LaserScan(angle_min=-math.pi, angle_max=math.pi, range_min=0.02)
        scan.header.stamp, scan.header.frame_id = now, lidar
        scan.angle_increment = 2.0 * math.pi / world.beams
        scan.range_max, scan.ranges = world.range_m, world.ranges().tolist()
        self._scan.publish(scan)
        header = Header(0, now, "map")
        self._marks.publish(create_cloud_xyz32(header, world.marked_points()))


def transform(parent: str, child: str, now: rospy.Time, place: Sequence[float]) -> TransformStamped:
    """The pose of a frame in its parent, as a message."""
    message, pose = TransformStamped(child_frame_id=child), pose_from_yaw(*place)
    message.header.stamp, message.header.frame_id = now, parent
    message.transform.translation, message.transform.rotation = pose.position, pose.orientation
    return message
