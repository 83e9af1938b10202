#!/usr/bin/env python3
"""A node started by roslaunch finds ROS, the virtual environment and the package."""

from __future__ import annotations

import importlib
import os
import sys
import unittest

import rosgraph
import rospy
import rostest
from std_msgs.msg import String


class Environment(unittest.TestCase):
    def test_interpreter_is_the_virtual_environments(self):
        self.assertNotEqual(sys.prefix, sys.base_prefix)

    def test_packages_come_from_the_virtual_environment(self):
        for name in ("numba", "pybullet"):
            place = importlib.import_module(name).__file__
            self.assertTrue(place.startswith(sys.prefix + os.sep), f"{name} is in {place}")

    def test_numpy_is_one_that_ros_messages_work_with(self):
        import numpy

        self.assertLess(int(numpy.__version__.split(".")[0]), 2)

    def test_the_package_is_found(self):
        import quad_nav.ros

        self.assertTrue(quad_nav.ros.__file__)

    def test_this_machine_is_reached_by_a_name_that_resolves(self):
        self.assertTrue({"ROS_HOSTNAME", "ROS_IP"} & set(os.environ))

    def test_messages_pass(self):
        rospy.init_node("environment")
        self.assertTrue(rosgraph.is_master_online())
        publisher = rospy.Publisher("~echo", String, queue_size=1, latch=True)
        publisher.publish("here")
        self.assertEqual(rospy.wait_for_message("~echo", String, timeout=10).data, "here")


if __name__ == "__main__":
    rostest.rosrun("quad", "environment", Environment)
