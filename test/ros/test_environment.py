#!/usr/bin/env python3
"""Nodes find ROS, the virtual environment and the package; the user's shell stays as it is."""

from __future__ import annotations

import importlib
import io
import os
import subprocess
import sys
import unittest
from pathlib import Path

import numpy as np
import rosgraph
import rospy
import rostest
from sensor_msgs.msg import LaserScan
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

    def test_scans_serialise_with_the_numpy_of_the_virtual_environment(self):
        from quad_nav.geometry import Scan
        from quad_nav.ros.common.conversions import scan_message

        ranges = np.array([1.5, np.inf], np.float32)
        sent, packed = scan_message(Scan(1.0, 0.0, 0.1, 0.02, 60.0, ranges), "Lidar0"), io.BytesIO()
        sent.serialize(packed)
        self.assertEqual(LaserScan().deserialize(packed.getvalue()).ranges, (1.5, np.inf))

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
