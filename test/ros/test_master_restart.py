#!/usr/bin/env python3
"""A ROS master that is started again in flight learns of the nodes that are there."""

import os
import signal
import socket
import subprocess
import sys
import unittest
from pathlib import Path

import rosgraph
import rostest
from flight_case import wait

NODE = str(Path(__file__).resolve().parents[2] / "nodes" / "simulator")


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class MasterRestart(unittest.TestCase):
    def setUp(self):
        self.port = free_port()
        self.uri = f"http://localhost:{self.port}"
        self.master = rosgraph.Master("/test", self.uri)

    def run_in_background(self, *command):
        environment = {**os.environ, "ROS_MASTER_URI": self.uri}
        process = subprocess.Popen(command, env=environment)
        self.addCleanup(process.wait)
        self.addCleanup(process.send_signal, signal.SIGINT)
        return process

    def start_master(self):
        process = self.run_in_background("roscore", "-p", str(self.port))
        wait(lambda: rosgraph.is_master_online(self.uri), "ROS master")
        return process

    def names(self):
        """Topics that the simulator publishes and subscribes to, and its services."""
        return [
            {name for name, nodes in kind if "/simulator" in nodes}
            for kind in self.master.getSystemState()
        ]

    def test_a_simulator_registers_again(self):
        first = self.start_master()
        self.master.setParam("/use_sim_time", True)
        self.master.setParam("/simulator", {"robots": 1, "scene": "random"})
        self.run_in_background(sys.executable, NODE)
        wait(lambda: "/simulation/start" in self.names()[2], "simulator")
        wait(lambda: "/cmd_vel0" in self.names()[1], "simulator")
        before = self.names()
        first.send_signal(signal.SIGINT)
        first.wait()
        self.start_master()
        wait(lambda: "/simulation/start" in self.names()[2], "service of the simulator")
        wait(lambda: self.names() == before, "topic of the simulator")


if __name__ == "__main__":
    rostest.rosrun("quad", "master_restart", MasterRestart)
