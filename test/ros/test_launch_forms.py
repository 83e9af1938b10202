#!/usr/bin/env python3
"""Navigators know their robots and find their peers, whatever form their launch file has."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import rospy
import rostest
from actionlib_msgs.msg import GoalID
from flight_case import FlightCase, Latest, Record, goal_pose, pid_of
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Log

NODE = Path(__file__).resolve().parents[2] / "nodes" / "move_base"


class LaunchForms(FlightCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("test_launch_forms")
        cls.log = Record("/rosout", Log)
        cls.odometry = [Latest(f"/odom{i}", Odometry) for i in range(4)]

    def lines(self, node):
        return [line.msg for line in self.log.messages if line.name == node]

    def wait_for_line(self, node, line, times=1):
        self.wait(lambda: self.lines(node).count(line) == times, f"{node}: {line}")

    def start_navigator(self, name):
        node = subprocess.Popen([sys.executable, NODE, f"__name:={name}"])
        self.addCleanup(node.wait)
        self.addCleanup(node.terminate)

    def test_1_numbers_from_namespace_name_and_topics(self):
        for i, node in enumerate(("/robot0/move_base", "/mb_1", "/planner")):
            self.wait_for_line(node, f"quad{i}: ready")
            for j in {0, 1, 2, 3} - {i}:
                self.wait_for_line(node, f"quad{i}: found quad{j}, avoiding it")
            self.assertFalse([line for line in self.lines(node) if "NUMBER" in line])

    def test_2_a_goal_is_cancelled_by_the_number_of_the_robot(self):
        goal = rospy.Publisher("/move_base_simple/goal0", PoseStamped, queue_size=1)
        cancel = rospy.Publisher("/move_base0/cancel", GoalID, queue_size=1)
        for topic in (goal, cancel):
            self.wait(lambda t=topic: t.get_num_connections() > 0, f"a listener on {topic.name}")
        self.odometry[0].wait()
        x, y = self.position(0)
        goal.publish(goal_pose(x + 3.0, y))
        self.wait(lambda: self.distance(0, x, y) > 0.2, "flight to the goal")
        cancel.publish(GoalID())
        self.wait(lambda: self.speed(0) < 0.02, "the stop")
        self.assertLess(self.distance(0, x, y), 2.0)

    def test_3_one_that_is_restarted(self):
        os.kill(pid_of("/mb_1"), signal.SIGKILL)
        self.wait_for_line("/mb_1", "quad1: ready", times=2)
        self.wait_for_line("/mb_1", "quad1: found quad0, avoiding it", times=2)

    def test_4_one_that_comes_later_with_parameters_that_contradict_its_name(self):
        for name, value in (("robot", 3), ("robots", 4)):
            rospy.set_param(f"/move_base7/{name}", value)
        self.start_navigator("move_base7")
        self.wait_for_line("/move_base7", "quad3: ready")
        self.assertFalse([line for line in self.lines("/move_base7") if "NUMBER" in line])

    def test_5_two_of_the_same_number(self):
        self.start_navigator("other_2")
        self.wait(
            lambda: any("quad2: /other_2 flies quad2 too" in one for one in self.lines("/planner")),
            "the warning of the first",
        )


if __name__ == "__main__":
    rostest.rosrun("quad", "launch_forms", LaunchForms)
