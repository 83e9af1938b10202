"""What the simulator would publish of a scene, for real vehicles: markers, and simulated scans.

With `lidar_for: vehicles` the LIDARs are cast from the vehicles' estimated poses in the scene. So
an autopilot in software, or a vehicle in an empty hall, flies as if the scene were there.
"""

from __future__ import annotations

import re
import threading
from types import MappingProxyType
from typing import Dict, List, Mapping, Optional, Sequence, Tuple

import numpy as np
import rospy
from nav_msgs.msg import OccupancyGrid
from quad.msg import FlightInfo as FlightInfoMessage
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray

from quad_nav.geometry import Pose2D, Pose3D
from quad_nav.ros.common.conversions import (
    ScanMessage,
    pose_from_transform,
    scan_message,
)
from quad_nav.ros.common.marker_messages import marker_array
from quad_nav.ros.common.nav_messages import map_message
from quad_nav.ros.common.own_messages import flight_info_message
from quad_nav.scenario.scene_map import scene_map
from quad_nav.sim.casters import kernel_lidars
from quad_nav.sim.flight import BodyState
from quad_nav.sim.lidar import LidarParams
from quad_nav.sim.scene import Scene
from quad_nav.sim.scene_writer import scene_document
from quad_nav.topics.flight_info import FLIGHT_TOPIC, FlightInfo
from quad_nav.topics.markers import number_markers, quadcopter_markers, scene_markers
from quad_nav.topics.validation import pose_problem
from quad_nav.versions import versions
from quad_vehicles.ros.topics import frame_at

_FRAME = re.compile(r"(odom|base_link)(\d{1,4})")
_ABSENT_M = -1000.0  # height of a body whose pose is not known yet
_BODY_VALUES = 13


class SceneTopics:
    """Latched topics of a scene."""

    def __init__(self, scene: Scene, robots: int, map_resolution_m: float = 0.0) -> None:
        """Publish markers, the facts for recordings, and a map if it has a resolution."""
        self._scene = rospy.Publisher("/simulation/scene", MarkerArray, queue_size=1, latch=True)
        self._scene.publish(marker_array(scene_markers(scene)))
        self._robots = rospy.Publisher(
            "/simulation/quadcopters", MarkerArray, queue_size=1, latch=True
        )
        self._robots.publish(
            marker_array(quadcopter_markers(robots) + number_markers(robots, scene))
        )
        self._flight = rospy.Publisher(FLIGHT_TOPIC, FlightInfoMessage, queue_size=1, latch=True)
        info = FlightInfo(scene=scene_document(scene), versions=versions())
        self._flight.publish(flight_info_message(info))
        if map_resolution_m > 0.0:
            self._map = rospy.Publisher("/map", OccupancyGrid, queue_size=1, latch=True)
            self._map.publish(map_message(scene_map(scene, map_resolution_m), rospy.Time.now()))


class PoseListener:
    """Last pose of each robot in `map`, from tf."""

    def __init__(self, robots: int, starts: Mapping[int, Pose2D] = MappingProxyType({})) -> None:
        """Subscribe to `/tf`.

        Args:
            robots: Number of robots.
            starts: Where robots stand at first that are where their odometry says, whatever a
                localization says: it reads the scans that are made from these poses.
        """
        self.robots, self._starts = robots, starts
        self._lock = threading.Lock()
        self._odom: Dict[int, Pose3D] = {}
        self._base: Dict[int, Tuple[Pose3D, rospy.Time]] = {}
        self._subscriber = rospy.Subscriber("/tf", TFMessage, self._take, queue_size=100)

    def _take(self, message: TFMessage) -> None:
        for one in message.transforms:
            found = _FRAME.fullmatch(one.child_frame_id)
            if found is None or int(found[2]) >= self.robots:
                continue
            pose, robot = pose_from_transform(one), int(found[2])
            if pose_problem(pose):
                continue
            with self._lock:
                if found[1] == "odom" and one.header.frame_id == "map":
                    if robot not in self._starts:
                        self._odom[robot] = pose
                elif found[1] == "base_link":
                    if robot in self._starts and robot not in self._base:
                        start = self._starts[robot]
                        self._odom[robot] = frame_at(start, pose.to_2d(), pose.z_m)
                    self._base[robot] = pose, one.header.stamp

    def pose(self, robot: int) -> Optional[Tuple[Pose3D, rospy.Time]]:
        """Return the pose in `map` and its stamp; None if it is not known yet."""
        with self._lock:
            base, map_from_odom = self._base.get(robot), self._odom.get(robot)
        if base is None or map_from_odom is None:
            return None
        return map_from_odom.compose(base[0]), base[1]


class SceneLidars:
    """Publish the scans that LIDARs on the vehicles would see in a scene."""

    def __init__(
        self, scene: Scene, poses: PoseListener, scanned: Sequence[int], params: LidarParams
    ) -> None:
        """Advertise the scans.

        Args:
            scene: The scene.
            poses: Poses of all robots; all are seen.
            scanned: Robots whose scans are published.
            params: Beam pattern and noise.
        """
        self._poses, robots = poses, poses.robots
        self._lidars = kernel_lidars(params, scene, robots, seed=0)
        self._robots = robots
        self._publishers = {
            i: rospy.Publisher(f"/scan{i}", ScanMessage, queue_size=2) for i in scanned
        }
        self._stamps: Dict[int, rospy.Time] = {}

    def publish(self) -> None:
        """Publish a scan of each vehicle whose pose is new, with the pose's stamp."""
        rows = np.zeros((self._robots, _BODY_VALUES))
        rows[:, 2], rows[:, 6] = _ABSENT_M, 1.0
        due: List[int] = []
        for robot in range(self._robots):
            found = self._poses.pose(robot)
            if found is None:
                continue
            pose, stamp = found
            rows[robot, :7] = (pose.x_m, pose.y_m, pose.z_m, *pose.quaternion)
            if robot in self._publishers and self._stamps.get(robot) != stamp:
                self._stamps[robot] = stamp
                due.append(robot)
        if not due:
            return
        bodies = BodyState(rows)
        for robot, scan in zip(due, self._lidars.scan(bodies, due, 0.0)):
            message = scan_message(scan, f"Lidar{robot}")
            message.header.stamp = self._stamps[robot]
            self._publishers[robot].publish(message)
