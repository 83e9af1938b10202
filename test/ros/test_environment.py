#!/usr/bin/env python3
"""Nodes find ROS, the virtual environment and the package; the user's shell stays as it is."""

from __future__ import annotations

import importlib
import os
import subprocess
import sys
import unittest
from pathlib import Path

import rosgraph
import rospy
import rostest
from std_msgs.msg import String

ROOT = Path(__file__).resolve().parents[2]
PATH = "/usr/bin:/bin"


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

    def test_sourcing_the_workspace_leaves_the_users_shell_alone(self):
        script = 'source .ws/devel/setup.bash; command -v python3; echo "$ROS_HOSTNAME$ROS_IP$PATH"'
        shell = subprocess.run(
            ["bash", "-c", script], cwd=ROOT, env={"PATH": PATH}, stdout=subprocess.PIPE, check=True
        )
        python, rest = shell.stdout.decode().splitlines()
        self.assertEqual(python, "/usr/bin/python3")
        self.assertTrue(rest.endswith(PATH), rest)
        self.assertNotIn(".venv", rest)

    def test_nodes_have_the_virtual_environment_whatever_the_path(self):
        script = "source .ws/devel/setup.bash; .ws/devel/lib/quad/run_module site"
        shell = subprocess.run(
            ["bash", "-c", script], cwd=ROOT, env={"PATH": PATH}, stdout=subprocess.PIPE, check=True
        )
        self.assertIn(f"{ROOT}/.venv/lib", shell.stdout.decode())

    def test_messages_pass(self):
        rospy.init_node("environment")
        self.assertTrue(rosgraph.is_master_online())
        publisher = rospy.Publisher("~echo", String, queue_size=1, latch=True)
        publisher.publish("here")
        self.assertEqual(rospy.wait_for_message("~echo", String, timeout=10).data, "here")


if __name__ == "__main__":
    rostest.rosrun("quad", "environment", Environment)
