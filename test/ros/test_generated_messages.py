#!/usr/bin/env python3
"""No generated message on any topic ends a node, and good messages count again afterwards.

The nodes run in this process without their threads. QUAD_MESSAGES is the number of messages for
each topic; 100000 take an hour.
"""

import os
import shutil
import tempfile
import unittest
from functools import partial
from pathlib import Path

import rostest
from hostile_messages import feed
from hostile_navigators import Navigators
from hostile_nodes import SequencerNode, Simulator
from hostile_vehicles import FleetUnderTest, VehicleUnderTest

COUNT = int(os.environ.get("QUAD_MESSAGES", "200"))


class GeneratedMessages(unittest.TestCase):
    def check(self, node, make):
        report = feed(node, make, COUNT)
        print(f"{node}: {report}", flush=True)
        self.assertFalse(report.faults, f"{report}")
        self.assertGreater(len(report.counts), 2)

    def test_move_base(self):
        self.check("/move_base0", partial(Navigators, robots=1))

    def test_fleet(self):
        self.check("/fleet", partial(Navigators, robots=2))

    def test_simulator(self):
        self.check("/simulator", Simulator)

    def test_sequencer(self):
        folder = Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, folder)
        self.check("/sequencer", partial(SequencerNode, folder=folder))

    def test_vehicle(self):
        self.check("/vehicle0", VehicleUnderTest)

    def test_vehicles(self):
        self.check("/vehicles", FleetUnderTest)


if __name__ == "__main__":
    rostest.rosrun("quad", "generated_messages", GeneratedMessages)
