"""Which robot a node `move_base` flies whose launch file has no parameter of ours."""

from __future__ import annotations

import pytest

rospy = pytest.importorskip("rospy")

from ros.fake_ros import FakeRos  # noqa: E402

from quad_nav import config  # noqa: E402
from quad_nav.ros.navigator.robot_identity import identified, number_in  # noqa: E402

LINES = '<param name="robot" value="{}" />\n  <param name="robots" value="{}" />'


@pytest.mark.parametrize(
    ("name", "number"),
    [
        ("/move_base1", 1),
        ("/mb_1", 1),
        ("/robot1/move_base", 1),
        ("/lab2/robot_03/move_base", 3),
        ("/robot1/move_base2", 2),
        ("robot_12/base_link", 12),
        ("base_link0", 0),
        ("/move_base", None),
        ("/drone3d/move_base_2d", None),
        ("/move_base_lab_4711_1699999999999", None),  # anonymous
        ("/robot5/move_base_4711_1699999999999", 5),
        ("", None),
    ],
)
def test_number_at_the_end_of_a_name_or_of_its_namespace(name, number):
    assert number_in(name) == number


def flown(node, frame="base_link", scan="scan", **given):
    """Return the robot's number, that of all robots and what the node says about it."""
    costmap = {
        "robot_base_frame": frame,
        "observation_sources": "laser",
        "laser": {"topic": scan, "data_type": "LaserScan"},
    }
    tree = {"global_costmap": costmap, "local_costmap": dict(costmap), **given}
    with FakeRos(node) as ros:
        found = identified(config.load(tree), given)
        return found.robot, found.robots, ros.log.lines


@pytest.mark.parametrize(
    ("names", "number"),
    [
        (("/move_base1", "base_link1", "scan1"), 1),
        (("/robot2/move_base",), 2),
        (("/mb_1", "base_link", "/robot1/scan"), 1),
        (("/move_base", "base_link1", "scan"), 1),
        (("/move_base", "robot_1/base_link", "scan1"), 1),
        (("/move_base", "base_link", "scan3"), 3),
    ],
)
def test_the_names_have_the_number(names, number):
    assert flown(*names) == (number, 0, [])


def test_parameters_win():
    assert flown("/move_base1", "base_link1", robot=0) == (0, 0, [])
    assert flown("/move_base1", "base_link1", robot=0, robots=1) == (0, 1, [])
    assert flown("/move_base1", "base_link1", robots=3) == (1, 3, [])
    assert flown("/planner", robot=2, robots=3) == (2, 3, [])


@pytest.mark.parametrize(
    ("names", "number", "words"),
    [
        (("/planner",), 0, ["UNKNOWN", "/planner", "(base_link)", "/scan", "NOT AVOID"]),
        (("/mb2", "base_link1"), 2, ["CONTRADICTORY", "2 in its node's name", "1 in its frames"]),
    ],
)
def test_a_number_that_is_open_is_warned_about_with_the_lines_to_add(names, number, words):
    robot, _, (line,) = flown(*names)
    assert robot == number
    for word in (*words, LINES.format(number, max(number + 1, 2))):
        assert word in line


def test_numbers_that_start_at_1():
    robot, robots, (line,) = flown("/move_base2", "base_link2", robots=2)
    assert (robot, robots) == (2, 0)
    assert "ROBOT 2 OF 2" in line
    assert LINES.format(2, 3) in line
