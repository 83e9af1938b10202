#!/usr/bin/env python3
"""amcl as other nodes see it: topics, transform, services, parameters."""

import math
import threading
import time
import unittest

import numpy as np
import rospy
import rostest
import tf2_ros
from diagnostic_msgs.msg import DiagnosticArray
from dynamic_reconfigure.client import Client
from flight_case import wait
from geometry_msgs.msg import PoseArray, PoseWithCovarianceStamped
from nav_msgs.msg import MapMetaData, OccupancyGrid, Odometry
from nav_msgs.srv import GetMap, GetMapResponse, SetMap
from sensor_msgs.msg import LaserScan
from std_srvs.srv import Empty
from tf2_msgs.msg import TFMessage

from quad_localization.occupancy_map import OccupancyMap, ray_range
from quad_nav.geometry import Pose2D, Pose3D, Scan
from quad_nav.ros.common.conversions import (
    odometry_message,
    pose_from_message,
    pose_from_transform,
    pose_message,
    scan_message,
    transform_message,
)

RESOLUTION_M, BEAMS, RATE_HZ = 0.05, 72, 10.0
NEAR_M = 0.15
TOLERANCE_S = 0.1
MAP_FROM_ODOM = Pose2D(0.4, -0.3, 0.5)  # what amcl has to find
PEER_RADIUS_M = 0.3


def room():
    """Return the cells of a room of 6 m by 4 m with two boxes."""
    cells = np.zeros((81, 121), np.int8)
    cells[0], cells[-1], cells[:, 0], cells[:, -1] = 100, 100, 100, 100
    cells[60:80, 20:30] = cells[10:16, 80:100] = 100
    return cells


def map_message():
    info = MapMetaData(resolution=RESOLUTION_M, width=121, height=81)
    info.origin.orientation.w = 1.0
    message = OccupancyGrid(info=info, data=room().ravel().tolist())
    message.header.frame_id = "map"
    return message


def given(pose, frame="map", variance=0.01):
    message = PoseWithCovarianceStamped()
    message.header.frame_id = frame
    message.pose.pose = pose_message(pose.to_3d())
    message.pose.covariance = (variance * np.eye(6)).ravel().tolist()
    return message


class World:
    """A robot in the room: tf, odometry of a peer beside it, and scans in which that peer is."""

    def __init__(self):
        self.grid = OccupancyMap.from_occupancy(room(), RESOLUTION_M, 0.0, 0.0)
        self.pose, self.moves, self.has_peer = Pose2D(1.5, 2.0, 0.3), True, False
        self._tf = rospy.Publisher("/tf", TFMessage, queue_size=10)
        self._scan = rospy.Publisher("/scan0", LaserScan, queue_size=10)
        self._peer = rospy.Publisher("/odom1", Odometry, queue_size=10)
        threading.Thread(target=self._run, daemon=True).start()

    def peer(self):
        return Pose2D(*self.pose.transform(1.0, 0.0))

    def _run(self):
        phase_rad = 0.0
        while not rospy.is_shutdown():
            if self.moves:
                phase_rad += 0.1
                x_m, y_m = 2.0 - 0.5 * math.cos(phase_rad), 2.0 + 0.5 * math.sin(phase_rad)
                self.pose = Pose2D(x_m, y_m, 0.3 + 0.2 * math.sin(phase_rad))
            self._publish(rospy.Time.now())
            time.sleep(1.0 / RATE_HZ)

    def _publish(self, stamp):
        odom_from_base = self.pose.relative_to(MAP_FROM_ODOM).to_3d()
        mount = Pose3D(0.0, 0.0, 0.1)
        transforms = [
            transform_message(odom_from_base, "odom0", "base_link0", stamp),
            transform_message(mount, "base_link0", "Lidar0", stamp),
            transform_message(Pose3D(0.0, 0.0, 0.0), "map", "odom1", stamp),
        ]
        self._tf.publish(TFMessage(transforms))
        self._scan.publish(scan_message(self._seen(stamp.to_sec()), "Lidar0"))
        if self.has_peer:
            zero = (0.0, 0.0, 0.0)
            frames = ("odom1", "base_link1")
            self._peer.publish(odometry_message(self.peer().to_3d(), zero, zero, frames, stamp))

    def _seen(self, stamp_s):
        step_rad = 2 * math.pi / BEAMS
        bearings_rad = -math.pi + step_rad * np.arange(BEAMS)
        angles_rad = self.pose.yaw_rad + bearings_rad
        frame, states, pose = self.grid.frame, self.grid.states, self.pose
        ranges_m = np.array(
            [ray_range(states, frame, pose.x_m, pose.y_m, one, 60.0) for one in angles_rad]
        )
        if self.has_peer:
            is_hidden = np.abs(bearings_rad) < math.asin(PEER_RADIUS_M)
            ranges_m[is_hidden] = np.minimum(ranges_m[is_hidden], 1.0 - PEER_RADIUS_M)
        return Scan(stamp_s, -math.pi, step_rad, 0.02, 60.0, ranges_m.astype(np.float32))


class AmclCase(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.world = World()
        cls.buffer = tf2_ros.Buffer()
        cls.listener = tf2_ros.TransformListener(cls.buffer)
        cls.poses = cls.record_of("/amcl_pose0", PoseWithCovarianceStamped)
        cls.clouds = cls.record_of("/particlecloud0", PoseArray)
        cls.health = cls.record_of("/diagnostics", DiagnosticArray)
        rospy.Service("static_map", GetMap, lambda _: GetMapResponse(map_message()))
        cls.initial = rospy.Publisher("/initialpose0", PoseWithCovarianceStamped, queue_size=1)

    @classmethod
    def record_of(cls, topic, kind):
        messages = []
        rospy.Subscriber(topic, kind, messages.append)
        return messages

    def error_m(self):
        """Return how far amcl's transform puts the robot from where it was."""
        try:
            transform = self.buffer.lookup_transform("map", "odom0", rospy.Time())
        except tf2_ros.TransformException:
            return math.inf
        found = pose_from_transform(transform).to_2d()
        inside = self.world.pose.relative_to(MAP_FROM_ODOM)
        return found.compose(inside).distance_to(MAP_FROM_ODOM.compose(inside))

    def wait_localised(self, what):
        wait(lambda: self.error_m() < NEAR_M, lambda: f"{what}: {self.error_m():.2f} m off")

    def check_stays_localised(self):
        """The next ten poses are right, by their median: a single one may be a random pose's."""
        errors_m = []
        while len(errors_m) < 10:
            count = len(self.poses)
            wait(lambda count=count: len(self.poses) > count, "a pose")
            errors_m.append(self.error_m())
        self.assertLess(np.median(errors_m), NEAR_M)

    def give(self, pose):
        wait(lambda: self.initial.get_num_connections() > 0, "a subscriber of initialpose0")
        self.initial.publish(given(pose))

    def spread_m(self, first):
        """Return the largest spread of a cloud since a first one."""
        places = [[(p.position.x, p.position.y) for p in one.poses] for one in self.clouds[first:]]
        return max((float(np.std(one, axis=0).max()) for one in places), default=0.0)

    def test_1_localises_from_the_parameters(self):
        self.wait_localised("from the parameters")
        wait(lambda: self.poses and self.clouds, "a pose and its particles")
        pose, cloud = self.poses[-1], self.clouds[-1]
        self.assertEqual((pose.header.frame_id, cloud.header.frame_id), ("map", "map"))
        self.assertGreater(pose.pose.covariance[0], 0.0)
        self.assertGreater(pose.pose.covariance[35], 0.0)
        wait(lambda: self.status() in ("OK", "Too large"), self.status)

    def status(self):
        found = [one for array in self.health[-3:] for one in array.status]
        return {one.name: one.message for one in found}.get("amcl0: Standard deviation", "")

    def test_2_transform_is_stamped_into_the_future(self):
        transforms = self.record_of("/tf", TFMessage)
        scans = self.record_of("/scan0", LaserScan)

        def sent_s():
            sent = (one for message in transforms for one in message.transforms)
            return {one.header.stamp.to_sec() for one in sent if one.child_frame_id == "odom0"}

        def expected_s():
            return [one.header.stamp.to_sec() + TOLERANCE_S for one in list(scans)]

        def is_sent(stamp_s):
            return any(abs(stamp_s - one) < 1e-6 for one in sent_s())

        wait(lambda: sum(map(is_sent, expected_s())) > 3, "transforms stamped as expected")

    def test_3_takes_poses_in_its_own_frame_alone(self):
        for pose, more in (
            (Pose2D(5.0, 1.0), {"frame": "odom0"}),
            (Pose2D(math.nan, 1.0), {}),
            (Pose2D(5.0, 1.0), {"variance": -1.0}),
        ):
            response = rospy.ServiceProxy("/set_map", SetMap)(map_message(), given(pose, **more))
            self.assertFalse(response.success)
        self.check_stays_localised()
        count = len(self.poses)
        self.give(Pose2D(4.5, 1.5))
        wait(lambda: self.most_off_m(count) > 1.0, "the pose that was given")
        self.wait_localised("from a wrong pose")

    def most_off_m(self, first):
        """Return how far poses since a first one are from the robot, at most."""
        places = [pose_from_message(one.pose.pose).to_2d() for one in self.poses[first:]]
        return max((one.distance_to(self.world.pose) for one in places), default=0.0)

    def test_4_services(self):
        count = len(self.clouds)
        rospy.ServiceProxy("/global_localization", Empty)()
        wait(lambda: self.spread_m(count) > 0.8, lambda: f"spread {self.spread_m(count):.2f} m")
        set_map = rospy.ServiceProxy("/set_map", SetMap)
        self.assertTrue(set_map(map_message(), given(self.world.pose)).success)
        self.wait_localised("from set_map")
        self.world.moves = False
        self.settle()
        count = len(self.clouds)
        rospy.ServiceProxy("/request_nomotion_update", Empty)()
        wait(lambda: len(self.clouds) > count, "a cloud without motion")
        self.world.moves = True

    def settle(self):
        """Wait until a robot that stands has no update any more: as many scans without a cloud."""
        scans = self.record_of("/scan0", LaserScan)
        count, seen = -1, 0
        end_s = time.monotonic() + 60.0
        while time.monotonic() < end_s:
            if len(self.clouds) != count:
                count, seen = len(self.clouds), len(scans)
            if len(scans) > seen + 10:
                return
            time.sleep(0.05)
        self.fail("amcl updates without motion")

    def test_5_reconfiguration_keeps_the_pose(self):
        client = Client("amcl0", timeout=30.0)
        answer = client.update_configuration({"max_particles": 20000, "laser_max_beams": 60})
        self.assertEqual(answer["max_particles"], 10000)
        self.assertEqual(answer["recovery_alpha_fast"], 0.1)
        answer = client.update_configuration({"max_particles": 800})
        self.check_stays_localised()
        self.assertEqual(rospy.get_param("/amcl0/max_particles"), 800)

    def test_6_saves_the_pose(self):
        def saved(name):
            return rospy.get_param(f"/amcl0/initial_{name}")

        def saved_m():
            return Pose2D(*(saved(f"pose_{one}") for one in "xya")).distance_to(Pose2D(2.0, 2.0))

        wait(lambda: abs(saved_m() - 0.5) < NEAR_M, lambda: f"saved {saved_m():.2f} m away")
        wait(lambda: saved("cov_xx") in (o.pose.covariance[0] for o in self.poses), "a pose's own")

    def test_7_stays_localised_face_to_face(self):
        self.world.has_peer = True
        self.check_stays_localised()
        last = pose_from_message(self.poses[-1].pose.pose).to_2d()
        self.assertLess(last.distance_to(Pose2D(2.0, 2.0)), 1.0)


if __name__ == "__main__":
    rospy.init_node("test_amcl")
    rostest.rosrun("quad", "amcl", AmclCase)
