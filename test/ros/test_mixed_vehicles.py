#!/usr/bin/env python3
"""A real vehicle (a stand-in) and a simulated one see each other, and touch."""

import math
import subprocess
import sys
import time
import unittest
from pathlib import Path

import numpy as np
import rospy
import rostest
from flight_case import trigger
from geometry_msgs.msg import Twist, Vector3
from nav_msgs.msg import Odometry
from own_messages import state_of
from quad.msg import Contact, VehicleState
from sensor_msgs.msg import LaserScan

VEHICLES = Path(__file__).resolve().parents[1] / "vehicles" / "udp_vehicles.py"
PATIENCE_S = 60.0
APART_M, RADIUS_M = 4.0, 0.30


class MixedVehicles(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("test_mixed_vehicles", disable_signals=True)
        cls.process = subprocess.Popen([sys.executable, str(VEHICLES), "ardupilot:14661:3:-2:30"])
        cls.scans, cls.odometry, cls.contacts, cls.state = {}, {}, [], ""
        cls.subscribers = [
            rospy.Subscriber("/vehicle0/state", VehicleState, cls._on_state),
            rospy.Subscriber("/simulation/contacts", Contact, cls._on_contact),
        ]
        for i in range(2):
            cls.subscribers += [
                rospy.Subscriber(f"/scan{i}", LaserScan, cls._on_scan, i),
                rospy.Subscriber(f"/odom{i}", Odometry, cls._on_odometry, i),
            ]
        cls.publisher = rospy.Publisher("/cmd_vel1", Twist, queue_size=1)

    @classmethod
    def tearDownClass(cls):
        cls.process.terminate()
        cls.process.wait(10.0)

    @classmethod
    def _on_state(cls, message):
        cls.state = state_of(message)

    @classmethod
    def _on_contact(cls, message):
        cls.contacts.append(message)

    @classmethod
    def _on_scan(cls, message, number):
        cls.scans[number] = message

    @classmethod
    def _on_odometry(cls, message, number):
        cls.odometry[number] = message

    def wait(self, condition, what):
        end_s = time.monotonic() + PATIENCE_S
        while not condition():
            self.assertIsNone(self.process.poll(), "the vehicle has died")
            self.assertLess(time.monotonic(), end_s, f"no {what}: {self.state}")
            time.sleep(0.02)

    def range_m(self, number, bearing_rad):
        """Return the range of a robot's last scan in a direction."""
        scan = self.scans[number]
        beams = len(scan.ranges)
        offset = math.remainder(bearing_rad - scan.angle_min, math.tau) % math.tau
        return float(np.array(scan.ranges)[round(offset / scan.angle_increment) % beams])

    def test_a_flight(self):
        self.wait(lambda: self.state == "ready", "readiness")
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
        end_s = time.monotonic() + PATIENCE_S
        while not self.contacts:
            self.assertLess(time.monotonic(), end_s, f"no contact: {self.odometry[1].pose.pose}")
            self.publisher.publish(Twist(linear=Vector3(0.6, 0.0, 0.0)))
            time.sleep(0.05)
        self.publisher.publish(Twist())
        contact = self.contacts[0]
        self.assertEqual((contact.robot, contact.other), ("quad0", "quad1"))
        y_m = self.odometry[1].pose.pose.position.y
        self.assertAlmostEqual(y_m, 1.5 + 2 * RADIUS_M, delta=0.1)


if __name__ == "__main__":
    rostest.rosrun("quad", "mixed_vehicles", MixedVehicles)
