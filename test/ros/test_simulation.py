#!/usr/bin/env python3
"""Start, pause and reset; invalid commands; the watchdog."""

import math
import time

import rospy
import rostest
from flight_case import FlightCase, Latest
from geometry_msgs.msg import Twist
from std_msgs.msg import Time
from std_srvs.srv import Trigger


class Simulation(FlightCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.commands = rospy.Publisher("/cmd_vel0", Twist, queue_size=1)
        cls.start()

    def call(self, name):
        answer = rospy.ServiceProxy(f"/simulation/{name}", Trigger)()
        self.assertTrue(answer.success, answer.message)

    def fly(self, vx, condition, what):
        command = Twist()
        command.linear.x = vx

        def commanded():
            self.commands.publish(command)
            return condition()

        self.wait(commanded, what)

    def test_pause_stops_the_clock_and_start_resumes_it(self):
        self.call("start")
        self.call("pause")
        self.wait(lambda: self.clock_is_stopped(), "a stopped clock")
        paused_s = rospy.get_time()
        self.call("start")
        self.wait(lambda: rospy.get_time() > paused_s + 0.5, "a running clock")

    @staticmethod
    def clock_is_stopped():
        before = rospy.get_time()
        time.sleep(0.2)  # checks that nothing happens meanwhile
        return rospy.get_time() == before

    def test_reset_takes_the_quadcopters_back(self):
        self.call("start")
        self.call("reset")
        self.call("start")
        x, y = self.position(0)
        self.fly(0.3, lambda: self.distance(0, x, y) > 0.3, "robot 0 away from its start")
        resets, before_s = Latest("/simulation/last_reset", Time), rospy.get_time()
        self.call("reset")
        self.wait(lambda: self.distance(0, x, y) < 0.05, "robot 0 back at its start")
        self.wait(
            lambda: resets.message is not None and resets.message.data.to_sec() >= before_s,
            "the time of this reset",
        )

    def test_watchdog_hovers_when_commands_stop(self):
        self.call("start")
        self.fly(0.3, lambda: self.speed(0) > 0.2, "robot 0 flying")
        self.wait(lambda: self.speed(0) < 0.02, "robot 0 hovering without commands")

    def test_not_a_number_is_dropped(self):
        self.call("start")
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
