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

from quad_nav.topics.robot_topics import ROBOT_TOPICS

TYPES = {
    "/cmd_vel{i}": "geometry_msgs/Twist",
    "/odom{i}": "nav_msgs/Odometry",
    "/scan{i}": "sensor_msgs/LaserScan",
    "/move_base{i}/goal": "move_base_msgs/MoveBaseActionGoal",
    "/move_base{i}/feedback": "move_base_msgs/MoveBaseActionFeedback",
    "/move_base{i}/result": "move_base_msgs/MoveBaseActionResult",
    "/move_base{i}/status": "actionlib_msgs/GoalStatusArray",
    "/move_base{i}/recovery_status": "move_base_msgs/RecoveryStatus",
    "/move_base{i}/current_goal": "geometry_msgs/PoseStamped",
    "/move_base{i}/NavfnROS/plan": "nav_msgs/Path",
    "/move_base{i}/TrajectoryPlannerROS/cost_cloud": "sensor_msgs/PointCloud2",
    "/move_base{i}/TrajectoryPlannerROS/global_plan": "nav_msgs/Path",
    "/move_base{i}/TrajectoryPlannerROS/local_plan": "nav_msgs/Path",
    "/move_base{i}/global_costmap/costmap": "nav_msgs/OccupancyGrid",
    "/move_base{i}/global_costmap/costmap_updates": "map_msgs/OccupancyGridUpdate",
    "/move_base{i}/global_costmap/footprint": "geometry_msgs/PolygonStamped",
    "/move_base{i}/local_costmap/costmap": "nav_msgs/OccupancyGrid",
    "/move_base{i}/local_costmap/costmap_updates": "map_msgs/OccupancyGridUpdate",
    "/move_base{i}/local_costmap/footprint": "geometry_msgs/PolygonStamped",
    **{f"/move_base{{i}}/{topic.name}": topic.kind for topic in ROBOT_TOPICS},
    "/quad/flight": "quad/FlightInfo",
    "/simulation/contacts": "quad/Contact",
    "/move_base{i}/parameter_descriptions": "dynamic_reconfigure/ConfigDescription",
    "/move_base{i}/parameter_updates": "dynamic_reconfigure/Config",
}
SERVICES = {
    "/move_base{i}/make_plan": "nav_msgs/GetPlan",
    "/move_base{i}/NavfnROS/make_plan": "nav_msgs/GetPlan",
    "/move_base{i}/clear_costmaps": "std_srvs/Empty",
    "/move_base{i}/set_parameters": "dynamic_reconfigure/Reconfigure",
    "/move_base{i}/TrajectoryPlannerROS/set_parameters": "dynamic_reconfigure/Reconfigure",
    "/move_base{i}/global_costmap/set_parameters": "dynamic_reconfigure/Reconfigure",
    "/move_base{i}/global_costmap/obstacle_layer/set_parameters": "dynamic_reconfigure/Reconfigure",
    "/move_base{i}/local_costmap/inflation_layer/set_parameters": "dynamic_reconfigure/Reconfigure",
}
SUBSCRIBED = {
    "/move_base{i}/cancel": "actionlib_msgs/GoalID",
    "/move_base_simple/goal{i}": "geometry_msgs/PoseStamped",
}


def names_of(table, i):
    return {name.format(i=i): kind for name, kind in table.items()}


def absent(robots):
    """Topics and services of these robots that are missing or have another type."""
    _, subscriptions, services = rosgraph.Master("/test").getSystemState()
    published = dict(rospy.get_published_topics())
    heard, served = dict(subscriptions), dict(services)
    names = []
    for i in robots:
        names += [name for name, kind in names_of(TYPES, i).items() if published.get(name) != kind]
        names += [name for name in names_of(SUBSCRIBED, i) if name not in heard]
        names += [name for name in names_of(SERVICES, i) if name not in served]
    return names


class RosTopics(FlightCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.start()

    def test_every_topic_and_service_has_its_type(self):
        self.wait(lambda: not absent((0, 1)), lambda: f"{absent((0, 1))} with their types")
        for i in (0, 1):
            for name, kind in names_of(SERVICES, i).items():
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
        self.simulated_seconds(5.0)
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
