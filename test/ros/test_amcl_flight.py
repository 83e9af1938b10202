#!/usr/bin/env python3
"""The tutorial's mission without a perfect pose: `localization:=amcl`."""

import math

import rospy
import rostest
import tf2_ros
from flight_case import FlightCase, Record
from geometry_msgs.msg import PoseWithCovarianceStamped


class AmclFlight(FlightCase):
    def test_mission(self):
        buffer = tf2_ros.Buffer()
        self.listener = tf2_ros.TransformListener(buffer)
        poses = [Record(f"/amcl_pose{i}", PoseWithCovarianceStamped) for i in (0, 1)]
        result = self.read_result(rospy.get_param("~result"), patience_s=380.0)
        goals = [goal for robot in result["robots"] for goal in robot["goals"]]
        self.assertEqual([goal["reached"] for goal in goals], 6 * [True], goals)
        self.assertEqual(result["contacts"], [])
        for i in (0, 1):
            frame = buffer.lookup_transform("map", f"odom{i}", rospy.Time(0)).transform
            drift_m = math.hypot(frame.translation.x, frame.translation.y)
            self.assertGreater(drift_m, 0.1, "odometry has drifted, and somebody corrects it")
            self.assertGreater(len(poses[i].messages), 50)


if __name__ == "__main__":
    rostest.rosrun("quad", "amcl_flight", AmclFlight)
