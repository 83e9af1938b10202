#!/usr/bin/env python3
"""An invalid launch is refused before any node starts, with all its faults."""

import json
import os
import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

import rostest
from roslaunch.config import load_config_default

ROOT = Path(__file__).resolve().parents[2]
CONFIG = ROOT / "config" / "default"
COLLECT = {**os.environ, "QUAD_COLLECT_FAULTS": "1"}


def dump(*arguments):
    """Print the parameters that roslaunch would set."""
    command = ["roslaunch", "--dump-params", "quad", *arguments, "rviz:=false"]
    return subprocess.run(command, capture_output=True, env=COLLECT, check=False)


def preflight(*arguments):
    """Exit status and error output for a launch with these arguments."""
    check = subprocess.run(
        ["python3", "-m", "quad_nav.ros.common.preflight"],
        input=dump(*arguments).stdout,
        stderr=subprocess.PIPE,
        check=False,
    )
    return check.returncode, check.stderr.decode()


class Preflight(unittest.TestCase):
    def setUp(self):
        self.folder = Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)

    def test_the_tutorial_can_be_flown(self):
        self.assertEqual(preflight("two_quads.launch", "config:=tutorial"), (0, ""))

    def test_faults_of_all_kinds_are_listed_together(self):
        result = self.folder / "result.json"
        status, errors = preflight(
            "two_quads.launch",
            f"config:={self.folder}",
            "goals:=/nowhere",
            "rate:=-1",
            f"result:={result}",
        )
        self.assertEqual(status, 2)
        self.assertEqual(errors.count(f"{self.folder}: no move_base parameters found"), 1)
        self.assertIn("goals: folder /nowhere does not exist", errors)
        self.assertIn("simulator: rate: is -1; expected a number above 0", errors)
        self.assertNotIn("costmap, x", errors)
        written = json.loads(result.read_text())
        self.assertEqual((written["exit_status"], len(written["problems"])), (2, 3))

    def test_navigators_of_another_package_are_nodes_also_if_composed(self):
        file = str(ROOT / "launch" / "two_quads.launch")
        arguments = ["nav:=move_base", "composed:=true", "rviz:=false"]
        nodes = load_config_default([(file, arguments)], None, verbose=False).nodes
        found = [node.name for node in nodes if node.package == "move_base"]
        self.assertEqual(found, ["move_base0", "move_base1"])

    def test_goals_off_the_global_costmap_are_refused(self):
        own = self.folder / "own.yaml"
        own.write_text("global_costmap: {height: 3.0}\n")
        status, errors = preflight("two_quads.launch", f"override0:={own}", "nav:=move_base")
        self.assertEqual(status, 2)
        self.assertIn("is off the global costmap, x 0 to 12 m, y 0 to 3 m", errors)
        size = "{width: 12, height: 12, origin_x: 0, origin_y: 0}\n"
        self.assertTrue(errors.endswith(f"robot0.yaml global_costmap: {size}"), errors)
        own.write_text(f"global_costmap: {size}")
        self.assertEqual(preflight("two_quads.launch", f"override0:={own}"), (0, ""))

    def test_roslaunch_ends_with_the_faults_of_the_parameters(self):
        launch = subprocess.run(
            ["roslaunch", "--dump-params", "quad", "two_quads.launch", "config:=/nowhere"],
            capture_output=True,
            check=False,
        )
        self.assertEqual(launch.stdout, b"")  # --dump-params ends with 0
        self.assertIn(
            b"quad0: invalid configuration:\n  config: /nowhere: expected a folder", launch.stderr
        )

    def test_a_hundred_can_be_flown(self):
        self.assertEqual(preflight("fleet.launch", "robots:=100", "hosts:=4"), (0, ""))

    def test_files_of_a_fleet_are_named_with_the_line(self):
        shutil.copytree(CONFIG, self.folder / "own")
        for robot, text in enumerate(
            (
                "controller_frequency: often\n",
                "base_local_planner: dwa_local_planner/DWAPlannerROS\n",
                "\nlocal_costmap:\n  resolution: -1.0\n",
                "controller_frequency: of a robot that does not fly\n",
            )
        ):
            (self.folder / "own" / f"robot{robot}.yaml").write_text(text)
        status, errors = preflight("fleet.launch", "robots:=3", f"config:={self.folder}/own")
        self.assertEqual(status, 2)
        self.assertEqual(errors.count("robot0.yaml:1"), 1)
        self.assertEqual(errors.count("robot2.yaml:3"), 1)
        self.assertNotIn("robot1.yaml", errors)
        self.assertNotIn("robot3.yaml", errors)


if __name__ == "__main__":
    rostest.rosrun("quad", "preflight", Preflight)
