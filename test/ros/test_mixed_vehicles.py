#!/usr/bin/env python3
"""A real vehicle (a stand-in) and a simulated one see each other, and touch."""

import math

import numpy as np
import rospy
import rostest
from flight_case import trigger
from geometry_msgs.msg import Twist, Vector3
from quad.msg import Contact
from sensor_msgs.msg import LaserScan
from vehicle_case import VehicleCase

APART_M, RADIUS_M = 4.0, 0.30


class MixedVehicles(VehicleCase):
    COMMAND = ("udp_vehicles.py", "ardupilot:14661:3:-2:30")

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.scans, cls.contacts = {}, []
        cls.subscribers += [
            rospy.Subscriber("/simulation/contacts", Contact, cls._on_contact),
            *(rospy.Subscriber(f"/scan{i}", LaserScan, cls._on_scan, i) for i in range(2)),
        ]
        cls.publisher = rospy.Publisher("/cmd_vel1", Twist, queue_size=1)

    @classmethod
    def _on_contact(cls, message):
        cls.contacts.append(message)

    @classmethod
    def _on_scan(cls, message, number):
        cls.scans[number] = message

    def range_m(self, number, bearing_rad):
        """Return the range of a robot's last scan in a direction."""
        scan = self.scans[number]
        beams = len(scan.ranges)
        offset = math.remainder(bearing_rad - scan.angle_min, math.tau) % math.tau
        return float(np.array(scan.ranges)[round(offset / scan.angle_increment) % beams])

    def test_a_flight(self):
        self.wait(lambda: self.states.get(0) == "ready", "readiness")
        self.wait(lambda: set(self.scans) == set(self.odometry) == {0, 1}, "scans and odometry")
        # Before the take-off the simulated one looks over the real one, to the wall behind.
        self.assertAlmostEqual(self.range_m(1, 0.0), 5.5, delta=0.1)
        trigger("/vehicles/take_off")
        self.they_see_each_other()
        self.the_simulated_one_touches_the_real_one()
        trigger("/vehicles/land")

    def they_see_each_other(self):
        near_m = APART_M - RADIUS_M
        self.wait(lambda: abs(self.range_m(1, 0.0) - near_m) < 0.1, "real vehicle in /scan1")
        # The real one heads along x; the simulated one is to its left.
        self.wait(lambda: abs(self.range_m(0, math.pi / 2) - near_m) < 0.1, "other in /scan0")
        self.assertEqual(self.contacts, [])

    def the_simulated_one_touches_the_real_one(self):
        ahead = Twist(linear=Vector3(0.6, 0.0, 0.0))
        self.wait(lambda: self.publisher.publish(ahead) or self.contacts, "contact")
        self.publisher.publish(Twist())
        contact = self.contacts[0]
        self.assertEqual((contact.robot, contact.other), ("quad0", "quad1"))
        y_m = self.odometry[1].pose.pose.position.y
        self.assertAlmostEqual(y_m, 1.5 + 2 * RADIUS_M, delta=0.1)


if __name__ == "__main__":
    rostest.rosrun("quad", "mixed_vehicles", MixedVehicles)
