#!/usr/bin/env python3
"""An invalid launch is refused before any node starts, with all its faults."""

import json
import os
import subprocess
import tempfile
import unittest

import rospkg
import rostest

QUAD = rospkg.RosPack().get_path("quad")
COLLECT = {**os.environ, "QUAD_COLLECT_FAULTS": "1"}
ARGUMENTS = ["--dump-params", "quad", "two_quads.launch", "rviz:=false"]


def preflight(*arguments):
    """Exit status and error output for a launch with these arguments."""
    dump = subprocess.run(
        ["roslaunch", *ARGUMENTS, *arguments], stdout=subprocess.PIPE, env=COLLECT, check=True
    )
    check = subprocess.run(
        ["python3", "-m", "quad_nav.ros.common.preflight"],
        input=dump.stdout,
        stderr=subprocess.PIPE,
        check=False,
    )
    return check.returncode, check.stderr.decode()


class Preflight(unittest.TestCase):
    def test_the_tutorial_can_be_flown(self):
        self.assertEqual(preflight("config:=tutorial")[0], 0)

    def test_unknown_scene(self):
        status, errors = preflight("scene:=/nowhere.yaml")
        self.assertEqual(status, 2)
        self.assertEqual(errors.count("/nowhere.yaml: cannot be read"), 1)

    def test_faults_of_all_kinds_are_listed_together(self):
        with tempfile.TemporaryDirectory() as folder:
            result = os.path.join(folder, "result.json")
            status, errors = preflight(f"goals:={folder}", "rate:=-1", f"result:={result}")
            with open(result, encoding="utf-8") as file:
                written = json.load(file)
        self.assertEqual(status, 2)
        self.assertIn("has no quad0_goals.json, quad1_goals.json", errors)
        self.assertIn("simulator: rate: is -1; expected a number above 0", errors)
        self.assertEqual(written["exit_status"], 2)
        self.assertEqual(len(written["problems"]), 2)

    def test_goals_off_the_global_costmap_are_refused(self):
        with tempfile.TemporaryDirectory() as folder:
            own = os.path.join(folder, "own.yaml")
            with open(own, "w", encoding="utf-8") as file:
                file.write("global_costmap: {height: 3.0}\n")
            for nav in ("quad", "move_base"):
                status, errors = preflight(f"override0:={own}", f"nav:={nav}")
                self.assertEqual(status, 2)
                self.assertIn("quad0_goals.json: goals[0] (goal 1)", errors)
                self.assertIn("is off the global costmap, x 0 to 12 m, y 0 to 3 m", errors)
                size = "{width: 12, height: 12, origin_x: 0, origin_y: 0}\n"
                self.assertTrue(errors.endswith(f"robot0.yaml global_costmap: {size}"), errors)
                with open(own, "w", encoding="utf-8") as file:
                    file.write(f"global_costmap: {size}")
                self.assertEqual(preflight(f"override0:={own}", f"nav:={nav}")[0], 0)
                with open(own, "w", encoding="utf-8") as file:
                    file.write("global_costmap: {height: 3.0}\n")

    def test_unreadable_parameters_are_listed_with_the_other_faults(self):
        with tempfile.TemporaryDirectory() as folder:
            status, errors = preflight(f"config:={folder}", "goals:=/nowhere")
        self.assertEqual(status, 2)
        self.assertEqual(errors.count(f"{folder}: no move_base parameters found"), 1)
        self.assertIn("goals: folder /nowhere does not exist", errors)
        self.assertNotIn("costmap, x", errors)

    def test_roslaunch_ends_with_the_faults_of_the_parameters(self):
        launch = subprocess.run(
            ["roslaunch", *ARGUMENTS, "config:=/nowhere"], capture_output=True, check=False
        )
        self.assertEqual(launch.stdout, b"")  # --dump-params ends with 0
        errors = launch.stderr.decode()
        self.assertIn(
            "quad0: invalid configuration:\n  config: /nowhere: expected a folder", errors
        )


if __name__ == "__main__":
    rostest.rosrun("quad", "preflight", Preflight)
