#!/usr/bin/env python3
"""The processes of a composed fleet end together, with the exit status of the simulator."""

import os
import signal
import subprocess
import sys
import unittest
from pathlib import Path

import rosnode
import rospy
import rostest
from flight_case import PATIENCE_S, Latest, pid_of, wait
from processes import descendants, runs
from rosgraph_msgs.msg import Clock

ROOT = Path(__file__).resolve().parents[2]
NODE, CONFIG = str(ROOT / "nodes" / "simulator"), str(ROOT / "config" / "default")


class ComposedProcesses(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("test_composed_processes")

    def start(self, **parameters):
        """The simulator's process."""
        rospy.set_param("/use_sim_time", True)
        given = {"robots": 2, "scene": "random", "config": CONFIG, "composed": True, "hosts": 2}
        rospy.set_param("/simulator", {**given, **parameters})
        self.addCleanup(rospy.set_param, "/simulator", {})
        simulator = subprocess.Popen(
            [sys.executable, NODE], stderr=subprocess.PIPE, start_new_session=True
        )
        self.addCleanup(simulator.stderr.close)
        self.addCleanup(simulator.wait)
        self.addCleanup(lambda: runs(simulator.pid) and os.killpg(simulator.pid, signal.SIGKILL))
        return simulator

    def test_no_worker_outlives_the_simulator(self):
        for number, status in ((signal.SIGKILL, -signal.SIGKILL), (signal.SIGINT, 0)):
            simulator = self.start()
            wait(lambda: pid_of("/fleet1") is not None, "/fleet1")
            rospy.wait_for_service("/simulation/start", PATIENCE_S)
            workers = descendants(simulator.pid)
            self.assertIn(pid_of("/fleet1"), workers)
            simulator.send_signal(number)
            self.assertEqual(simulator.wait(PATIENCE_S), status)
            wait(lambda w=workers: not any(map(runs, w)), "the end of the workers")

    def test_a_simulator_that_ros_shuts_down_ends_in_order(self):
        simulator = self.start(rate=1000.0, start_paused=False)
        clock = Latest("/clock", Clock)
        wait(lambda: clock.count > 100, "a running simulation")
        workers = descendants(simulator.pid)
        rosnode.kill_nodes(["/simulator"])
        self.assertEqual(simulator.wait(PATIENCE_S), 0)
        self.assertNotIn(b"Traceback", simulator.stderr.read())
        wait(lambda: not any(map(runs, workers)), "the end of the workers")

    def test_faults_are_listed_and_end_the_simulator(self):
        simulator = self.start(hosts=3)
        self.assertEqual(simulator.wait(PATIENCE_S), 2)
        self.assertIn(b"expected a robot for each host", simulator.stderr.read())


if __name__ == "__main__":
    rostest.rosrun("quad", "composed_processes", ComposedProcesses)
