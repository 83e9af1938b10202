#!/usr/bin/env python3
"""The tutorial's launch file: both quadcopters fly, have their names, and do not touch."""

import os
import signal
import subprocess
from pathlib import Path

import rospy
import rostest
from flight_case import FlightCase, Latest, Record, trigger
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Log


class TutorialLaunch(FlightCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("test_tutorial_launch")
        cls.log = Record("/rosout", Log)
        path = Path(__file__).resolve().with_name("tutorial") / "quad_multi.launch"
        without_rviz = {**os.environ, "DISPLAY": ""}
        cls.launch = subprocess.Popen(["roslaunch", str(path)], env=without_rviz)
        cls.odometry = [Latest(f"/odom{i}", Odometry) for i in (0, 1)]
        cls.command = [Latest(f"/cmd_vel{i}", Twist) for i in (0, 1)]

    @classmethod
    def tearDownClass(cls):
        cls.launch.send_signal(signal.SIGINT)
        cls.launch.wait()

    def lines(self, node):
        return [line.msg for line in self.log.messages if line.name == node]

    def test_1_each_navigator_knows_which_robot_it_flies_and_finds_the_other(self):
        for node, line in (
            ("/move_base0", "quad0: ready"),
            ("/move_base1", "quad1: ready"),
            ("/move_base0", "quad0: found quad1, avoiding it"),
            ("/move_base1", "quad1: found quad0, avoiding it"),
        ):
            self.wait(lambda n=node, one=line: one in self.lines(n), line)

    def test_2_a_stopped_mission_stops_both(self):
        for i in (0, 1):
            self.wait(
                lambda i=i: self.odometry[i].message and self.speed(i) > 0.2, f"quad{i} flies"
            )
        trigger("/mission/stop")
        for i in (0, 1):
            self.wait(lambda i=i: self.speed(i) < 0.02, f"quad{i} stops")
            before, self.command[i].message = self.position(i), None
            self.simulated_seconds(5.0)  # of five control cycles
            self.assertLess(self.distance(i, *before), 0.05)
        trigger("/mission/resume")

    def test_3_the_mission_succeeds_without_a_contact(self):
        result = self.read_result(rospy.get_param("~result"), patience_s=380.0)
        self.assertEqual(result["contacts"], [])
        for robot in result["robots"]:
            self.assertEqual([goal["reached"] for goal in robot["goals"]], [True] * 3, robot)


if __name__ == "__main__":
    rostest.rosrun("quad", "tutorial_launch", TutorialLaunch)
