#!/usr/bin/env python3
"""Topics, types, rates, frames and services that other tools depend on."""

import rosgraph
import rospy
import rosservice
import rostest
import tf2_ros
from actionlib_msgs.msg import GoalStatusArray
from flight_case import FlightCase, rate_hz
from geometry_msgs.msg import PolygonStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import LaserScan
from tf2_msgs.msg import TFMessage
from upstream_case import recorded_lines

from quad_nav.topics.robot_topics import ROBOT_TOPICS

OURS = {  # beside those of C++ move_base
    "/odom{i}": "nav_msgs/Odometry",
    "/scan{i}": "sensor_msgs/LaserScan",
    **{f"/move_base{{i}}/{topic.name}": topic.kind for topic in ROBOT_TOPICS},
    "/quad/flight": "quad/FlightInfo",
    "/simulation/contacts": "quad/Contact",
}
OF_A_NODE = ("/get_loggers", "/set_logger_level")


def services(i):
    """Services of a robot with their types, apart from those of a node."""
    recorded = dict(recorded_lines("services.txt", i))
    return {name: kind for name, kind in recorded.items() if not name.endswith(OF_A_NODE)}


def absent(robots):
    """Topics and services of these robots that are missing or have another type."""
    _, subscriptions, served = rosgraph.Master("/test").getSystemState()
    published, heard, served = dict(rospy.get_published_topics()), dict(subscriptions), dict(served)
    names = []
    for i in robots:
        types = {name: kind for name, kind, *_ in recorded_lines("publications.txt", i)}
        types.update({name.format(i=i): kind for name, kind in OURS.items()})
        names += [name for name, kind in types.items() if published.get(name) != kind]
        subscribed = (f"/move_base{i}/cancel", f"/move_base_simple/goal{i}")
        names += [name for name in subscribed if name not in heard]
        names += [name for name in services(i) if name not in served]
    return names


class RosTopics(FlightCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.start()

    def test_every_topic_and_service_has_its_type(self):
        self.wait(lambda: not absent((0, 1)), lambda: f"{absent((0, 1))} with their types")
        for i in (0, 1):
            for name, kind in services(i).items():
                self.assertEqual(rosservice.get_service_type(name), kind, name)

    def test_rates_in_simulated_time(self):
        topics = (
            ("/scan0", LaserScan, 20.0),
            ("/odom1", Odometry, 40.0),
            ("/move_base0/status", GoalStatusArray, 5.0),
            ("/move_base0/global_costmap/footprint", PolygonStamped, 5.0),
            ("/move_base1/local_costmap/footprint", PolygonStamped, 10.0),
        )
        records = [self.record(topic, kind) for topic, kind, _ in topics]
        tf = self.record("/tf", TFMessage)
        for record, (topic, _, hz) in zip(records, topics):
            self.wait(lambda r=record, n=5.0 * hz: len(r.messages) > n, f"5 s of {topic}")
        for record, (topic, _, hz) in zip(records, topics):
            self.assertAlmostEqual(record.rate_hz(), hz, delta=0.1 * hz, msg=topic)
        stamps_s = [message.transforms[0].header.stamp.to_sec() for message in tf.messages]
        self.assertAlmostEqual(rate_hz(stamps_s), 40.0, delta=4.0)

    def test_scan_has_the_tutorials_limits(self):
        scan = rospy.wait_for_message("/scan1", LaserScan, timeout=30)
        self.assertEqual(scan.header.frame_id, "Lidar1")
        self.assertEqual(len(scan.ranges), 512)
        self.assertAlmostEqual(scan.range_min, 0.02, places=6)
        self.assertAlmostEqual(scan.range_max, 60.0)
        self.assertAlmostEqual(
            scan.angle_max, scan.angle_min + 511 * scan.angle_increment, places=5
        )

    def test_tf_tree(self):
        buffer = tf2_ros.Buffer()
        listener = tf2_ros.TransformListener(buffer)
        for i in (0, 1):
            for parent, child in (
                ("map", f"odom{i}"),
                (f"odom{i}", f"base_link{i}"),
                (f"base_link{i}", f"Lidar{i}"),
            ):
                self.wait(
                    lambda p=parent, c=child: buffer.can_transform(p, c, rospy.Time(0)),
                    f"transform {parent} -> {child}",
                )
            mount = buffer.lookup_transform(f"base_link{i}", f"Lidar{i}", rospy.Time(0))
            self.assertAlmostEqual(mount.transform.translation.z, 0.06)
        listener.unregister()

    def test_odometry_is_in_its_frames(self):
        odometry = rospy.wait_for_message("/odom0", Odometry, timeout=30)
        self.assertEqual(odometry.header.frame_id, "odom0")
        self.assertEqual(odometry.child_frame_id, "base_link0")
        self.assertAlmostEqual(odometry.pose.pose.position.z, 1.0, delta=0.05)


if __name__ == "__main__":
    rostest.rosrun("quad", "ros_topics", RosTopics)
