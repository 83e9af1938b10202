#!/usr/bin/env python3
"""Start, pause and reset; invalid commands; the watchdog."""

import math
import time

import rospy
import rostest
from flight_case import FlightCase, Latest, trigger
from geometry_msgs.msg import Twist
from std_msgs.msg import Time


class Simulation(FlightCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.commands = rospy.Publisher("/cmd_vel0", Twist, queue_size=1)
        cls.start()

    def fly(self, vx, condition, what):
        command = Twist()
        command.linear.x = vx

        def commanded():
            self.commands.publish(command)
            return condition()

        self.wait(commanded, what)

    def test_pause_stops_the_clock_and_start_resumes_it(self):
        trigger("/simulation/start")
        trigger("/simulation/pause")
        self.wait(lambda: self.clock_is_stopped(), "a stopped clock")
        paused_s = rospy.get_time()
        trigger("/simulation/start")
        self.wait(lambda: rospy.get_time() > paused_s + 0.5, "a running clock")

    @staticmethod
    def clock_is_stopped():
        before = rospy.get_time()
        time.sleep(0.2)  # checks that nothing happens meanwhile
        return rospy.get_time() == before

    def test_reset_takes_the_quadcopters_back(self):
        resets = Latest("/simulation/last_reset", Time)
        self.reset(resets)
        trigger("/simulation/start")
        x, y = self.position(0)
        self.fly(0.3, lambda: self.distance(0, x, y) > 0.3, "robot 0 away from its start")
        self.reset(resets)
        self.assertLess(self.distance(0, x, y), 0.05)

    def reset(self, resets):
        """Reset, and wait until its time is told and the odometry is no older."""
        trigger("/simulation/start")
        before = rospy.Time.now()
        trigger("/simulation/reset")
        self.wait(lambda: resets.message and resets.message.data >= before, "the time of the reset")
        self.wait(
            lambda: self.odometry[0].message.header.stamp >= resets.message.data,
            "odometry of then",
        )

    def test_watchdog_hovers_when_commands_stop(self):
        trigger("/simulation/start")
        self.fly(0.3, lambda: self.speed(0) > 0.2, "robot 0 flying")
        self.wait(lambda: self.speed(0) < 0.02, "robot 0 hovering without commands")

    def test_not_a_number_is_dropped(self):
        trigger("/simulation/start")
        command = Twist()
        command.linear.x = math.nan
        command.angular.z = math.inf
        for _ in range(20):
            self.commands.publish(command)
            self.simulated_seconds(0.05)
        self.assertLess(self.speed(0), 0.05)
        self.assertTrue(all(map(math.isfinite, self.position(0))))
        self.fly(0.3, lambda: self.speed(0) > 0.2, "robot 0 flying on a good command")


if __name__ == "__main__":
    rostest.rosrun("quad", "simulation", Simulation)
