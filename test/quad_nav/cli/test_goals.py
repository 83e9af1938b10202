"""``quad goals convert``, and flights of what it reads."""

from __future__ import annotations

import json
import math

import pytest
from click.testing import CliRunner

from quad_nav.cli.goals import goals as command
from quad_nav.mission.goal_file import load_goals
from quad_nav.scenario.flight_setup import FlightOptions, read_setup
from quad_nav.scenario.preview import MissionPreview

CSV = "x,y,yaw\n3.0,6.5,0.1\n9.0,5.5,-1.57\n"
FLEET = """robot_0: {goals: [[3.0, 6.5], [9.0, 5.5]]}
robot_1: {goals: [{x: 4.0, y: 3.5, wait_s: 2.0}]}
"""


def convert(*words):
    result = CliRunner().invoke(command, ["convert", *map(str, words)])
    return result.exit_code, result.output.splitlines()


@pytest.fixture
def listed(tmp_path):
    """A function that writes a file."""

    def write(name, text):
        (tmp_path / name).write_text(text)
        return tmp_path / name

    return write


def test_a_converted_file_flies_the_same(listed, tmp_path):
    source = listed("waypoints.csv", CSV)
    folder = tmp_path / "made"
    assert convert(source, "-o", folder / "quad0_goals.json") == (
        0,
        [
            f"{source}: read as a table with the columns x, y, yaw (named in line 1): 2 goals",
            f"goals: {folder / 'quad0_goals.json'}",
        ],
    )
    first, second = (read_setup(FlightOptions(None, goals)) for goals in (source, folder))
    assert first.robots[0].sequence.goals == second.robots[0].sequence.goals
    assert first.robots[0].sequence.settings == second.robots[0].sequence.settings
    assert len(first.robots) == len(second.robots) == 1
    assert [line for line in first.warnings if "read as" in line] and not [
        line for line in second.warnings if "read as" in line
    ]


def test_a_fleet_becomes_a_folder_and_flies(listed, tmp_path):
    source = listed("fleet.yaml", FLEET)
    code, lines = convert(source, "-o", tmp_path / "made")
    assert code == 0 and "1 goal of robot_1, one of 2 robots" in lines[2]
    for options in (FlightOptions(None, source), FlightOptions(None, tmp_path / "made")):
        setup = read_setup(options)
        assert [one.name for one in setup.robots] == ["quad0", "quad1"]
        assert [len(one.sequence.goals) for one in setup.robots] == [2, 1]
        assert setup.robots[1].sequence.goals[0].wait_s == 2.0


def test_degrees_and_a_datum(listed, tmp_path):
    source = listed("goals.yaml", "goals:\n- {x: 1, y: 2, yaw: 90}\n")
    made = tmp_path / "made.json"
    code, lines = convert(source, "-o", made)
    assert code == 2 and "line 2 (goal 1): yaw is 90; expected radians" in lines[0]
    assert not made.exists()
    assert convert(source, "-o", made, "--degrees")[0] == 0
    assert load_goals(made).goals[0].yaw_rad == pytest.approx(math.pi / 2)
    source = listed("places.csv", "lat,lon\n47.0,8.0\n")
    code, lines = convert(source, "-o", made, "--datum", "46.9991", "8.0")
    assert code == 0 and "(0, 0) is --datum, lat 46.9991000" in lines[0]
    assert load_goals(made).goals[0].y_m == pytest.approx(100.05, abs=0.01)


def test_a_goal_file_is_not_converted(listed, tmp_path):
    source = listed("quad0_goals.json", '{"goals": [[1, 2]], "retries": 3}')
    code, lines = convert(source, "-o", tmp_path / "made.json")
    assert (code, lines) == (
        2,
        [f"{source}: is a goal file already; expected a list of waypoints"],
    )


def test_a_folder_of_lists(listed, tmp_path):
    for name, x in (("route_10.csv", 4.0), ("route_2.csv", 3.0)):
        listed(name, f"{x}, 6.5\n")
    listed("map.yaml", "image: map.pgm\nresolution: 0.05\norigin: [0, 0, 0]\n")
    setup = read_setup(FlightOptions(None, tmp_path))
    assert [one.sequence.goals[0].x_m for one in setup.robots] == [3.0, 4.0]
    preview = MissionPreview(FlightOptions(None, tmp_path, robots=3))
    assert f"{tmp_path}: has goals of 2 robots; expected 3, --robots" in preview.problems


def test_faults_of_positions_have_their_lines(listed):
    source = listed("waypoints.csv", "x,y\n3.0,6.5\n99,5\n")
    preview = MissionPreview(FlightOptions(None, source))
    (problem,) = preview.problems
    assert problem.startswith(f"{source}: line 3 (goal 2): (99, 5) is outside the arena")
    assert [bool(fault) for fault in preview.robot(0).faults] == [False, True]


def test_a_fault_in_json_of_ours_stays_a_fault_of_a_goal_file(listed, tmp_path):
    text = json.dumps({"goals": [{"x": 1, "y": 2, "z": 3}]})
    code, lines = convert(listed("quad0_goals.json", text), "-o", tmp_path / "made.json")
    assert code == 2 and "goals[0] (goal 1): z cannot be set for a goal" in lines[0]
