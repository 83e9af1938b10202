#!/usr/bin/env python3
"""Terminal of a flight by `make fly` and roslaunch: start, end, Ctrl-C, a dead simulator."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import tempfile
import unittest
from pathlib import Path

import rostest
from flight_case import wait
from processes import descendants, words

ROOT = Path(__file__).resolve().parents[2]
FLY = [str(ROOT / "scripts" / "fly")]
ROSLAUNCH = ["roslaunch", "--no-summary", "quad", "two_quads.launch", "exit_when_done:=true"]
WORLD = ["scene:=scenes/examples/depot.world", "goals:=goals/examples/depot"]
GOALS = ([(3.0, 6.5), (9.0, 5.5), (1.5, 9.0)], [(4.0, 3.5), (2.0, 9.0), (8.5, 5.0)])
PATIENCE_S = 200.0
SCREEN = 25  # lines before the first goal
RED = "\x1b[31m"


class Screen(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.result = Path(folder.name) / "result.json"
        self.printed = Path(folder.name) / "printed"

    def fly(self, command, rate=10):
        with self.printed.open("w") as printed:
            flight = subprocess.Popen(
                [*command, "rviz:=false", f"rate:={rate}", f"result:={self.result}"],
                cwd=ROOT,
                env={**os.environ, "PWD": str(ROOT)},
                stdout=printed,
                stderr=subprocess.STDOUT,
            )
        self.addCleanup(flight.wait, PATIENCE_S)
        self.addCleanup(flight.send_signal, signal.SIGINT)
        return flight

    def wait_for(self, text, flight):
        def printed():
            self.assertIsNone(flight.poll(), self.printed.read_text())
            return text in self.printed.read_text()

        wait(printed, lambda: self.printed.read_text())

    def test_the_tutorials_mission_has_a_screen_at_the_start_and_a_table_at_the_end(self):
        self.assertEqual(self.fly(FLY).wait(PATIENCE_S), 0)
        text = self.printed.read_text()
        lines = text.splitlines()
        first = next(i for i, line in enumerate(lines) if "goal 1 of" in line)
        self.assertLess(first, SCREEN, text)
        self.assertIn("quad0: ready", text)
        for unwanted in ("Inbound TCP/IP", "move_base", "pybullet", "killing on exit", RED):
            self.assertNotIn(unwanted, text)
        self.assertIn("Mission succeeded", text)
        last = [line for line in lines if line and not line.startswith("[")][-1]
        self.assertRegex(last, "^Summary written to .*/result.json$")
        for robot, goals in zip(json.loads(self.result.read_text())["robots"], GOALS):
            self.assertEqual([(one["x_m"], one["y_m"]) for one in robot["goals"]], goals)
            self.assertGreater(robot["min_clearance_m"], 0.0)
            self.assertGreater(robot["path_length_m"], 0.9 * robot["straight_length_m"] - 1.2)

    def test_roslaunch_flies_a_world_of_the_readme_and_ends_without_red_lines(self):
        flight = self.fly([*ROSLAUNCH, *WORLD])
        self.assertEqual(flight.wait(PATIENCE_S), 0)
        text = self.printed.read_text()
        self.assertIn("Mission succeeded", text)
        self.assertIn("quad0, quad1: global_costmap covers the scene, x ", text)
        for unwanted in ("has died", "finished cleanly", RED):
            self.assertNotIn(unwanted, text)

    def test_a_sequencer_with_bad_goals_names_every_fault_and_nothing_flies(self):
        flight = self.fly([*ROSLAUNCH, f"goals:={ROOT / 'test' / 'ros' / 'bad_goals'}"])
        flight.wait(PATIENCE_S)
        written = json.loads(self.result.read_text())
        self.assertEqual(written["exit_status"], 2)
        for fault in (
            "quad0_goals.json: goals[1] (goal 2): (2.2, 4) is inside an obstacle",
            "quad1_goals.json: gaols: is not a key of goal files; expected goals",
        ):
            self.assertIn(fault, "\n".join(written["problems"]))
        self.assertNotIn("goal 1 of", self.printed.read_text())

    def test_ctrl_c_is_an_interruption(self):
        flight = self.fly(FLY, rate=1)
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
        flight = self.fly(FLY, rate=1)
        self.wait_for("goal 1 of", flight)
        simulator = next(
            pid
            for pid in descendants(flight.pid)
            if any(word.endswith("/simulator") for word in words(pid))
        )
        os.kill(simulator, signal.SIGKILL)
        self.assertEqual(flight.wait(PATIENCE_S), 1)
        text = self.printed.read_text()
        self.assertRegex(text, r"REQUIRED process \[simulator-\d+\] has died!")
        self.assertIn("The mission ended early: the simulator has died.", text)
        self.assertEqual(json.loads(self.result.read_text())["exit_status"], 1)


if __name__ == "__main__":
    rostest.rosrun("quad", "screen", Screen)
