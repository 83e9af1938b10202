#!/usr/bin/env python3
"""The worlds and goals of the README and of docs/scenes.md fly under ROS as the pages have them."""

from __future__ import annotations

import json
import os
import re
import shlex
import subprocess
import tempfile
import unittest

import rospkg
import rostest

QUAD = os.path.realpath(rospkg.RosPack().get_path("quad"))
PAGES = ("README.md", os.path.join("docs", "scenes.md"))


def commands(page):
    """Return the arguments of the page's `make fly` with goals of goals/examples."""
    with open(os.path.join(QUAD, page), encoding="utf-8") as file:
        return re.findall(r'^make fly ARGS="(.*goals/examples.*)"$', file.read(), re.M)


COMMANDS = list(dict.fromkeys(found for page in PAGES for found in commands(page)))


def fly(arguments):
    """Run what `make fly` runs, in a hurry; return its status, its log and the summary."""
    with tempfile.TemporaryDirectory() as folder:
        result = os.path.join(folder, "result.json")
        flight = subprocess.run(
            [
                "scripts/fly",
                *shlex.split(arguments),
                "rate:=100",
                "rviz:=false",
                f"result:={result}",
            ],
            cwd=QUAD,
            env={**os.environ, "PWD": QUAD},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            check=False,
        )
        log = flight.stdout.decode()
        if not os.path.exists(result):
            return flight.returncode, log, None
        with open(result, encoding="utf-8") as file:
            return flight.returncode, log, json.load(file)


class ReadmeWorlds(unittest.TestCase):
    def test_a_scene_a_world_a_map_and_goals_fly(self):
        kinds = [re.search(r"scene:=\S+\.(\w+)", command) for command in COMMANDS]
        self.assertEqual([k.group(1) if k else "" for k in kinds], ["yaml", "world", "yaml"])
        for command in COMMANDS:  # each has goals of its own
            with self.subTest(command):
                status, log, summary = fly(command)
                self.assertEqual(status, 0, log)
                self.assertEqual([len(robot["goals"]) for robot in summary["robots"]], [2, 2])
                notes = log.count("quad0, quad1: global_costmap covers the scene, x ")
                self.assertEqual(notes, "scene:=" in command, log)


if __name__ == "__main__":
    rostest.rosrun("quad", "readme_worlds", ReadmeWorlds)
