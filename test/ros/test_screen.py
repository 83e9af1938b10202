#!/usr/bin/env python3
"""Terminal of a flight by `make fly` and roslaunch: start, end, Ctrl-C, a dead simulator."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import tempfile
import time
import unittest
from pathlib import Path

import rostest
from processes import descendants, words

ROOT = Path(__file__).resolve().parents[2]
FLY = [str(ROOT / "scripts" / "fly")]
ROSLAUNCH = ["roslaunch", "--no-summary", "quad", "two_quads.launch", "exit_when_done:=true"]
SHORT = f"goals:={ROOT / 'test' / 'ros' / 'short_goals'}"
PATIENCE_S = 90.0
SCREEN = 25  # lines before the first goal
RED = "\x1b[31m"


class Screen(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.result = Path(folder.name) / "result.json"
        self.printed = Path(folder.name) / "printed"

    def fly(self, command):
        with self.printed.open("w") as printed:
            flight = subprocess.Popen(
                [*command, "rviz:=false", "rate:=4", f"result:={self.result}"],
                stdout=printed,
                stderr=subprocess.STDOUT,
            )
        self.addCleanup(flight.wait, PATIENCE_S)
        self.addCleanup(flight.send_signal, signal.SIGINT)
        return flight

    def wait_for(self, text, flight):
        end = time.monotonic() + PATIENCE_S
        while text not in self.printed.read_text():
            self.assertIsNone(flight.poll(), self.printed.read_text())
            self.assertLess(time.monotonic(), end, self.printed.read_text())
            time.sleep(0.1)

    def test_start_is_a_screen_and_the_end_a_table(self):
        self.assertEqual(self.fly([*FLY, SHORT]).wait(PATIENCE_S), 0)
        text = self.printed.read_text()
        lines = text.splitlines()
        first = next(i for i, line in enumerate(lines) if "goal 1 of" in line)
        self.assertLess(first, SCREEN, text)
        self.assertIn("quad0: ready", text)
        self.assertNotIn("Inbound TCP/IP connection failed", text)
        self.assertNotIn("move_base", text)
        self.assertNotIn("pybullet", text)
        self.assertNotIn("killing on exit", text)
        self.assertNotIn(RED, text)
        self.assertIn("Mission succeeded", text)
        last = [line for line in lines if line and not line.startswith("[")][-1]
        self.assertRegex(last, "^Summary written to .*/result.json$")

    def test_roslaunch_ends_without_red_lines(self):
        flight = self.fly([*ROSLAUNCH, SHORT])
        self.assertEqual(flight.wait(PATIENCE_S), 0)
        text = self.printed.read_text()
        self.assertIn("Mission succeeded", text)
        self.assertNotIn("has died", text)
        self.assertNotIn("finished cleanly", text)
        self.assertNotIn(RED, text)

    def test_ctrl_c_is_an_interruption(self):
        flight = self.fly(FLY)
        self.wait_for("goal 1 of", flight)
        flight.send_signal(signal.SIGINT)
        self.assertEqual(flight.wait(PATIENCE_S), 130)
        text = self.printed.read_text()
        self.assertIn("The mission ended early: interrupted.", text)
        self.assertNotIn("Traceback", text)
        self.assertNotIn("simulator has", text)
        written = json.loads(self.result.read_text())
        self.assertEqual((written["reason"], written["exit_status"]), ("interrupted", 130))

    def test_a_dead_simulator_ends_the_flight_with_the_reason(self):
        flight = self.fly(FLY)
        self.wait_for("goal 1 of", flight)
        simulator = next(
            pid
            for pid in descendants(flight.pid)
            if any(word.endswith("/simulator") for word in words(pid))
        )
        os.kill(simulator, signal.SIGKILL)
        self.assertEqual(flight.wait(PATIENCE_S), 1)
        text = self.printed.read_text()
        self.assertIn("REQUIRED process [simulator-2] has died!", text)
        self.assertIn("The mission ended early: the simulator has died.", text)
        self.assertEqual(json.loads(self.result.read_text())["exit_status"], 1)


if __name__ == "__main__":
    rostest.rosrun("quad", "screen", Screen)
