#!/usr/bin/env python3
"""Two Crazyflies take off when the mission starts, fly, and land when all shall land."""

import math
import subprocess
import sys
import time
import unittest
from pathlib import Path

import rospy
import rostest
from nav_msgs.msg import Odometry
from own_messages import state_of
from quad.msg import VehicleState
from std_msgs.msg import Empty

ROOT = Path(__file__).resolve().parents[2]
SERVER = ROOT / "test" / "vehicles" / "crazyflie_server.py"
PATIENCE_S = 90.0


class Crazyflies(unittest.TestCase):
    def setUp(self):
        rospy.init_node("test_crazyflies", disable_signals=True)
        scene = ["--scene", str(ROOT / "scenes" / "arena.yaml")]
        self.process = subprocess.Popen(
            [sys.executable, str(SERVER), *scene, "14661", "14662"], stdout=subprocess.PIPE
        )
        self.addCleanup(self.end)
        self.values, self.odometry = {}, {}
        self.subscribers = [
            rospy.Subscriber(name, kind, callback, i)
            for i in range(2)
            for name, kind, callback in (
                (f"/vehicle{i}/state", VehicleState, self.on_state),
                (f"/odom{i}", Odometry, self.on_odometry),
            )
        ]

    def end(self):
        self.process.terminate()
        self.process.communicate(timeout=10.0)

    def on_state(self, message, number):
        self.values[number] = message

    def on_odometry(self, message, number):
        self.odometry[number] = message

    def states(self):
        return [state_of(one) for one in self.values.values()]

    def speed(self, number):
        twist = self.odometry[number].twist.twist.linear
        return math.hypot(twist.x, twist.y)

    def height_errors(self):
        return [abs(one.pose.pose.position.z - 1.0) for one in self.odometry.values()]

    def wait(self, condition, what):
        end_s = time.monotonic() + PATIENCE_S
        while not condition():
            self.assertIsNone(self.process.poll(), "the vehicles have died")
            self.assertLess(time.monotonic(), end_s, f"no {what}: {self.values}")
            time.sleep(0.02)

    def test_a_flight(self):
        self.wait(lambda: self.states() == ["flying"] * 2, "flight of both")
        self.wait(lambda: min(self.speed(0), self.speed(1)) > 0.2, "motion of both")
        self.wait(lambda: max(self.height_errors()) < 0.05, "altitude of both")
        publisher = rospy.Publisher("/vehicles/land_all", Empty, queue_size=1)
        self.wait(lambda: publisher.get_num_connections() == 2, "subscribers")
        publisher.publish(Empty())
        self.wait(lambda: set(self.states()) == {"landing"}, "landing of both")
        self.wait(lambda: set(self.states()) == {"landed"}, "both on the ground")
        self.assertEqual({one.armed for one in self.values.values()}, {False})
        self.assertLess(max(one.height for one in self.values.values()), 0.06)


if __name__ == "__main__":
    rostest.rosrun("quad", "crazyflies", Crazyflies)
