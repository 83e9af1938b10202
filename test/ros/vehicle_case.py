"""Base of the tests with vehicles: a process of stand-ins, and what the bridges say of them."""

import math
import subprocess
import sys
import unittest
from pathlib import Path

import rospy
from flight_case import wait
from nav_msgs.msg import Odometry
from own_messages import state_of
from quad.msg import VehicleState

FOLDER = Path(__file__).resolve().parents[1] / "vehicles"


class VehicleCase(unittest.TestCase):
    """Vehicles that ``COMMAND`` starts: a script of ``test/vehicles`` with its arguments.

    Attributes:
        values, states, odometry: The last of each vehicle.
    """

    COMMAND = ()

    @classmethod
    def setUpClass(cls):
        rospy.init_node("test_vehicles", disable_signals=True)
        script, *arguments = cls.COMMAND
        cls.process = subprocess.Popen([sys.executable, str(FOLDER / script), *arguments])
        cls.values, cls.states, cls.odometry, cls.subscribers = {}, {}, {}, []
        for i in range(2):
            cls.subscribers += [
                rospy.Subscriber(f"/vehicle{i}/state", VehicleState, cls._on_state, i),
                rospy.Subscriber(f"/odom{i}", Odometry, cls._on_odometry, i),
            ]

    @classmethod
    def tearDownClass(cls):
        cls.process.terminate()
        cls.process.wait(10.0)

    @classmethod
    def _on_state(cls, message, number):
        cls.values[number], cls.states[number] = message, state_of(message)

    @classmethod
    def _on_odometry(cls, message, number):
        cls.odometry[number] = message

    def wait(self, condition, what):
        """Until the condition holds; the vehicles must be alive."""

        def holds():
            self.assertIsNone(self.process.poll(), "the vehicles have died")
            return condition()

        wait(holds, lambda: f"{what}: {self.values}")

    def speed(self, number):
        twist = self.odometry[number].twist.twist.linear
        return math.hypot(twist.x, twist.y)
