#!/usr/bin/env python3
"""An invalid launch is refused before any node starts, with all its faults."""

import json
import os
import shutil
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
            config = os.path.join(folder, "config")
            shutil.copytree(os.path.join(QUAD, "config", "default"), config)
            path = os.path.join(config, "global_costmap_params.yaml")
            with open(path, encoding="utf-8") as file:
                text = file.read()
            with open(path, "w", encoding="utf-8") as file:
                file.write(text.replace("height: 12.0", "height: 3.0"))
            for nav in ("quad", "move_base"):
                status, errors = preflight(f"config:={config}", f"nav:={nav}")
                self.assertEqual(status, 2)
                self.assertIn("quad0_goals.json: goals[0] (goal 1)", errors)
                self.assertIn("is off the global costmap, x 0 to 12 m, y 0 to 3 m", errors)

    def test_unreadable_parameters_are_listed_with_the_other_faults(self):
        with tempfile.TemporaryDirectory() as folder:
            status, errors = preflight(f"config:={folder}", "goals:=/nowhere")
        self.assertEqual(status, 2)
        self.assertIn(f"{folder}: missing local_costmap_params.yaml or ", errors)
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
