#!/usr/bin/env python3
"""A LIDAR timeout stops its quadcopter and no other."""

import rospy
import rostest
from flight_case import FlightCase, Latest, goal_pose
from sensor_msgs.msg import LaserScan
from std_srvs.srv import SetBool


class LidarTimeout(FlightCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.start()

    def lidar(self, i, on):
        answer = rospy.ServiceProxy(f"/simulation/lidar{i}/enable", SetBool)(on)
        self.assertTrue(answer.success, answer.message)

    def test_it_stops_within_two_seconds_and_resumes_when_the_lidar_is_back(self):
        scan = Latest("/scan0", LaserScan)
        scan.wait()
        # One after the other: on a busy machine one could arrive before the other sets off.
        for i, y in ((0, 6.5), (1, 8.0)):
            self.goal_topics[i].publish(goal_pose(self.position(i)[0], y))
            self.wait(lambda i=i: self.speed(i) > 0.1, f"robot {i} under way")
        self.lidar(0, False)
        self.wait(lambda: self.speed(0) < 0.03, "robot 0 standing")
        # By stamps: on a busy machine messages and this node's clock are late.
        stood, last_scan = self.odometry[0].message.header, scan.message.header
        self.assertLess((stood.stamp - last_scan.stamp).to_sec(), 3.0)
        self.wait(lambda: self.speed(1) > 0.1, "robot 1 still under way")
        self.lidar(0, True)
        self.wait(lambda: self.speed(0) > 0.1, "robot 0 under way again")


if __name__ == "__main__":
    rostest.rosrun("quad", "lidar_timeout", LidarTimeout)
