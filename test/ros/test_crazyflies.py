#!/usr/bin/env python3
"""Two Crazyflies take off when the mission starts, fly, and land when all shall land."""

import rospy
import rostest
from std_msgs.msg import Empty
from vehicle_case import FOLDER, VehicleCase

SCENE = str(FOLDER.parents[1] / "scenes" / "arena.yaml")


class Crazyflies(VehicleCase):
    COMMAND = ("crazyflie_server.py", "--scene", SCENE, "14661", "14662")

    def height_errors(self):
        return [abs(one.pose.pose.position.z - 1.0) for one in self.odometry.values()]

    def test_a_flight(self):
        self.wait(lambda: list(self.states.values()) == ["flying"] * 2, "flight of both")
        self.wait(lambda: min(self.speed(0), self.speed(1)) > 0.2, "motion of both")
        self.wait(lambda: max(self.height_errors()) < 0.05, "altitude of both")
        publisher = rospy.Publisher("/vehicles/land_all", Empty, queue_size=1)
        self.wait(lambda: publisher.get_num_connections() == 2, "subscribers")
        publisher.publish(Empty())
        self.wait(lambda: set(self.states.values()) == {"landing"}, "landing of both")
        self.wait(lambda: set(self.states.values()) == {"landed"}, "both on the ground")
        self.assertEqual({one.armed for one in self.values.values()}, {False})
        self.assertLess(max(one.height for one in self.values.values()), 0.06)


if __name__ == "__main__":
    rostest.rosrun("quad", "crazyflies", Crazyflies)
