#!/usr/bin/env python3
"""Faults of sensors, clock and commands in flight: hover while blind, resume, no contact."""

import math
import os
import time

import rospy
import rostest
from flight_case import FlightCase, Latest, goal_pose
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from quad.msg import Contact
from sensor_faults import SensorFaults

REPORT = os.environ.get("QUAD_FAULTS_REPORT", "")  # a file that the figures of all are added to
BLINDING = ["no scans", "frozen, old stamps", "NaN", "no tf", "old tf", "no odometry"]
if REPORT:
    BLINDING += ["frozen, new stamps", "half a second late", "zeros", "+inf", "half the beams"]
CONTROL_PERIOD_S, BLIND_S = 0.1, 0.5
TRANSPORT_S = 0.3  # delay of messages on a busy machine
LASTS_S = 3.0 if REPORT else 2.0
PLACES = [(1.0, 8.0), (1.0, 2.0)]


class Faults(FlightCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.sensor_faults = SensorFaults()
        cls.odometry = [Latest(f"/true/odom{i}", Odometry) for i in (0, 1)]
        cls.contacts = Latest("/simulation/contacts", Contact)
        cls.moving_s = 0.0
        cls.subscriber = rospy.Subscriber("/cmd_vel0", Twist, cls.store_command)
        cls.start()
        cls.place = 0

    @classmethod
    def store_command(cls, command):
        """Time of the last moving command of quadcopter 0."""
        if command.linear.x or command.linear.y or command.angular.z:
            cls.moving_s = rospy.get_time()

    def tearDown(self):
        self.sensor_faults.fault = ""
        self.assertEqual(self.contacts.count, 0, self.contacts.message)

    def fly(self, when="at first"):
        """Robot 0 under way between its two places."""

        def flies():
            x, y = PLACES[self.place]
            if self.distance(0, x, y) < 1.5:
                type(self).place = 1 - self.place
                x, y = PLACES[self.place]
            now = time.monotonic()
            if now - self.sent > 2.0:
                self.sent = now
                self.goal_topics[0].publish(goal_pose(x, y))
            return self.speed(0) > 0.2

        self.sent = 0.0
        self.wait(flies, f"robot 0 under way {when}")

    def test_1_the_mission_resumes_after_a_clock_jump(self):
        self.wait(lambda: self.speed(0) > 0.15, "robot 0 under way")
        self.simulated_seconds(4.0)
        before_s = rospy.get_time()
        self.sensor_faults.back_s += 5.0
        self.wait(lambda: rospy.get_time() < before_s, "a clock jump")
        result = self.read_result(rospy.get_param("~result"), patience_s=200.0)
        self.assertTrue(result["success"], result)
        for robot in result["robots"]:
            self.assertTrue(all(goal["attempts"] == 1 for goal in robot["goals"]), robot)
            self.assertGreater(robot["path_length_m"], 0.9 * robot["straight_length_m"])

    def test_2_it_hovers_while_blind_and_resumes(self):
        # One list, and no subTest(): rosunit counts a test whose parts have failed as passed.
        # Commands count when they come: a busy machine may delay them, and a fault has another try.
        self.assertEqual(self.late(self.late(BLINDING)), {})

    def late(self, faults):
        """The faults after which it flew on for too long, and how long."""
        late = {}
        for fault in faults:
            self.fly(f"before {fault}")
            begin_s = rospy.get_time()
            self.sensor_faults.fault = fault
            self.simulated_seconds(LASTS_S)
            hover_after_s = self.moving_s - begin_s
            self.sensor_faults.fault = ""
            end_s = rospy.get_time()
            self.fly(f"after {fault}")
            self.report(fault, hover_after_s, rospy.get_time() - end_s)
            if hover_after_s >= CONTROL_PERIOD_S + BLIND_S + TRANSPORT_S:
                late[fault] = hover_after_s
        return late

    def test_3_it_flies_on_when_odometry_jumps(self):
        self.fly()
        self.sensor_faults.fault = "odometry jumps"
        self.simulated_seconds(LASTS_S)
        self.sensor_faults.fault = ""
        self.fly("after the jump back")

    def test_4_commands_of_another_node_and_goals_at_a_kilohertz(self):
        """The commands are dropped, finite or not; of the goals the newest one counts."""
        self.fly()
        begin_s = rospy.get_time()
        flood = [Twist(), Twist()]
        flood[0].linear.x, flood[1].linear.x = -1.0, math.nan
        publisher = rospy.Publisher("/cmd_vel0", Twist, queue_size=1000)
        self.wait(lambda: publisher.get_num_connections() > 0, "the simulator listening")
        backwards = 0
        while rospy.get_time() < begin_s + LASTS_S:
            for command in flood:
                publisher.publish(command)
            self.goal_topics[0].publish(goal_pose(*PLACES[self.place]))
            time.sleep(0.001)
            backwards += self.odometry[0].message.twist.twist.linear.x < -0.15
        publisher.unregister()
        self.assertEqual(backwards, 0)
        self.fly("after the flood")

    def report(self, fault, hover_after_s, on_after_s):
        print(
            f"fault: {fault}: last moving command after {hover_after_s:.2f} s, "
            f"under way again after {on_after_s:.2f} s",
            flush=True,
        )
        if REPORT:
            with open(REPORT, "a", encoding="utf-8") as file:
                file.write(f"{fault}\t{hover_after_s:.3f}\t{on_after_s:.3f}\n")


if __name__ == "__main__":
    rostest.rosrun("quad", "faults", Faults)
