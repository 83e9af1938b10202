#!/usr/bin/env python3
"""An invalid fleet is refused before any node starts, with all its faults."""

import os
import shutil
import subprocess
import tempfile
import unittest

import rospkg
import rostest

CONFIG = os.path.join(rospkg.RosPack().get_path("quad"), "config", "default")


def preflight(*arguments):
    """Exit status and error output for a launch with these arguments."""
    dump = subprocess.run(
        ["roslaunch", "--dump-params", "quad", "fleet.launch", "rviz:=false", *arguments],
        stdout=subprocess.PIPE,
        check=True,
    )
    check = subprocess.run(
        ["python3", "-m", "quad_nav.ros.common.preflight"],
        input=dump.stdout,
        stderr=subprocess.PIPE,
        check=False,
    )
    return check.returncode, check.stderr.decode()


class FleetPreflight(unittest.TestCase):
    def config(self, **overrides):
        """A folder of parameters with a file for some robots."""
        folder = tempfile.mkdtemp()
        self.addCleanup(shutil.rmtree, folder)
        for name in os.listdir(CONFIG):
            shutil.copy(os.path.join(CONFIG, name), folder)
        for robot, text in overrides.items():
            with open(os.path.join(folder, f"{robot}.yaml"), "w", encoding="utf-8") as file:
                file.write(text)
        return folder

    def test_a_hundred_can_be_flown(self):
        self.assertEqual(preflight("robots:=100", "hosts:=4")[0], 0)

    def test_mixed_fleets_can_be_flown(self):
        folder = self.config(
            robot1="controller_frequency: 5.0\n",
            robot2="base_local_planner: dwa_local_planner/DWAPlannerROS\n",
        )
        self.assertEqual(preflight("robots:=3", f"config:={folder}")[0], 0)

    def test_every_bad_override_is_named_with_its_line(self):
        folder = self.config(
            robot1="controller_frequency: often\n", robot3="\nlocal_costmap:\n  resolution: -1.0\n"
        )
        status, errors = preflight("robots:=4", f"config:={folder}")
        self.assertEqual(status, 2)
        self.assertEqual(errors.count(f"{folder}/robot1.yaml:1"), 1)
        self.assertEqual(errors.count(f"{folder}/robot3.yaml:3"), 1)

    def test_the_files_of_robots_that_do_not_fly_do_not_count(self):
        folder = self.config(robot4="controller_frequency: often\n")
        self.assertEqual(preflight("robots:=4", f"config:={folder}")[0], 0)

    def test_too_many_for_the_arena(self):
        status, errors = preflight("robots:=50", "size:=8.0")
        self.assertEqual(status, 2)
        self.assertEqual(errors.count("no room for"), 1)

    def test_hosts_without_robots(self):
        status, errors = preflight("robots:=2", "hosts:=3")
        self.assertEqual(status, 2)
        self.assertIn("expected a robot for each host", errors)

    def test_random_goals_belong_to_a_random_scene(self):
        scene = os.path.join(CONFIG, "..", "..", "scenes", "arena.yaml")
        status, errors = preflight("robots:=2", f"scene:={scene}")
        self.assertEqual(status, 2)
        self.assertIn("expected a folder of goal files", errors)


if __name__ == "__main__":
    rostest.rosrun("quad", "fleet_preflight", FleetPreflight)
