"""Goal files: valid files, and the message of each fault."""

import json
import math
from pathlib import Path

import pytest

from quad_nav.errors import InputError
from quad_nav.mission.goal import GOAL_KEYS, Goal, goal_entry
from quad_nav.mission.goal_file import (
    KEYS,
    SETTINGS,
    GoalSequence,
    SequenceSettings,
    load_goals,
    parse_goals,
    read_settings,
)
from quad_nav.mission.place_check import clearance_check
from quad_nav.mission.robot_goals import WatchedGoalFile

GOALS = Path(__file__).parents[3] / "goals"

# A round pillar of 0.5 m radius at (5, 5) in a 10 m arena without walls.
PILLAR = clearance_check(
    lambda x, y: 0 < x < 10 and 0 < y < 10,
    lambda x, y: math.hypot(x - 5, y - 5) - 0.5,
    robot_radius_m=0.3,
    arena="x 0 to 10 m, y 0 to 10 m",
)


def faults(content, check_place=None):
    with pytest.raises(InputError) as caught:
        parse_goals(content, "f.json", check_place)
    return caught.value.problems


@pytest.mark.parametrize(
    "robot, goals",
    [
        (0, [(3.0, 6.5), (9.0, 5.5), (1.5, 9.0)]),
        (1, [(4.0, 3.5), (2.0, 9.0), (8.5, 5.0)]),
    ],
)
def test_the_tutorials_files_load(robot, goals):
    sequence = load_goals(GOALS / f"quad{robot}_goals.json")
    assert sequence == GoalSequence(tuple(Goal(x, y) for x, y in goals))


def test_the_tutorials_listing_loads_without_braces():
    assert parse_goals('  "goals": [[3.0,6.5],[9.0,5.5]]\n', "f.json").goals == (
        Goal(3.0, 6.5),
        Goal(9.0, 5.5),
    )


def test_every_key_is_read():
    sequence = parse_goals(
        """{"$schema": "schema.json", "goals": [[1, 2], [3, 4, 1.5]],
        "loop": true, "goal_tolerance": 0.25, "yaw_tolerance": 0.3, "goal_timeout": 60,
        "retries": 3}""",
        "f.json",
    )
    assert sequence.goals == (Goal(1.0, 2.0), Goal(3.0, 4.0, 1.5))
    assert sequence.settings == SequenceSettings(0.25, 60.0, 3, True, 0.3)
    assert isinstance(sequence.settings.retries, int)


def test_a_file_overrides_only_the_defaults_that_it_names():
    defaults = SequenceSettings(goal_tolerance_m=0.5, goal_timeout_s=30.0, retries=2)
    settings = parse_goals('{"goals": [[1, 2]], "retries": 0}', "f.json", None, defaults).settings
    assert settings == SequenceSettings(goal_tolerance_m=0.5, goal_timeout_s=30.0, retries=0)


def test_a_byte_order_mark_is_ignored():
    assert parse_goals(b'\xef\xbb\xbf{"goals": [[1, 2]]}', "f.json").goals == (Goal(1.0, 2.0),)


def test_a_goal_may_be_an_object_with_settings_of_its_own():
    content = """{"goals": [[1, 2, null], {"x": 1, "y": 2}, {"x": 3, "y": 4, "yaw": null,
        "wait_s": 5, "tolerance": 0.2}, {"x": 5, "y": 6, "yaw": -1, "yaw_tolerance": 0.5}],
        "goal_tolerance": 0.3, "yaw_tolerance": 0.25}"""
    sequence = parse_goals(content, "f.json")
    assert sequence.goals == (
        Goal(1.0, 2.0),
        Goal(1.0, 2.0),
        Goal(3.0, 4.0, wait_s=5.0, tolerance_m=0.2),
        Goal(5.0, 6.0, -1.0, yaw_tolerance_rad=0.5),
    )
    assert [sequence.tolerance_m(goal) for goal in sequence.goals] == [0.3, 0.3, 0.2, 0.3]
    assert [sequence.yaw_tolerance_rad(goal) for goal in sequence.goals] == [0.25, 0.25, 0.25, 0.5]
    entries = [goal_entry(goal) for goal in sequence.goals]
    assert entries[0] == [1.0, 2.0] and entries[2] == {
        "x": 3.0,
        "y": 4.0,
        "wait_s": 5.0,
        "tolerance": 0.2,
    }
    assert parse_goals(json.dumps({"goals": entries}), "f.json").goals == sequence.goals


def test_goals_at_one_place_are_a_loop_if_they_differ_in_yaw():
    content = '{{"goals": [[1, 2, 0], [1, 2, {yaw}]], "loop": true, "yaw_tolerance": 0.5}}'
    assert parse_goals(content.format(yaw=1.1), "f.json").settings.loop
    for yaw in (0.9, 2 * math.pi - 0.9, "null"):
        assert "all goals are reached at one position" in faults(content.format(yaw=yaw))[0]


@pytest.mark.parametrize(
    "content, problem",
    [
        ('{"goals":\n [[1,2]\n', ":3:1: is not JSON: Expecting ',' delimiter"),
        ('"goals": [[1,2],x]', ":1:17: is not JSON: Expecting value"),
        (b"\xff", ": byte 0 is not UTF-8"),
        ("[" * 100000, ": is nested too deeply"),
        ("[1]", ": is a list; expected {"),
        ("{}", ": has no goals"),
        ('{"goals": 3}', ": goals: is 3; expected a list"),
        ('{"goals": []}', ": goals: is empty; expected at least one goal"),
        ('{"goals": [[1, 2]], "goals": [[3, 4]]}', ": goals: is given twice; expected once"),
        ('{"goals": [[1, 2]], "altitude": 2}', ": altitude cannot be set for a goal: all"),
        ('{"goals": [[1, 2]], "Retrys": 1}', ": Retrys: is not a key of goal files; expected ret"),
        ('{"goals": [[1, 2]], "zzz": 1}', ": zzz: is not a key of goal files; expected one of"),
        ('{"goals": [[1, 2]], "$schema": 1}', ": $schema: is 1; expected a string"),
        ('{"goals": [[1, 2]], "loop": 1}', ": loop: is 1; expected true or false"),
        ('{"goals": [[1, 2]], "retries": 1.5}', ": retries: is 1.5; expected a whole number"),
        ('{"goals": [[1, 2]], "goal_timeout": NaN}', ": goal_timeout: is NaN; expected a number"),
        (
            '{"goals": [[1, 2], [1, 2.8]], "loop": true}',
            ": loop: all goals are reached at one position; expected two goals more than twice the"
            " goal_tolerance apart (0.8 m)",
        ),
    ],
)
def test_each_fault_has_its_place_and_what_was_expected(content, problem):
    (found,) = faults(content)
    assert found.startswith(f"f.json{problem}")


@pytest.mark.parametrize(
    "goal, problem",
    [
        ("5", "is 5; expected [x, y] or [x, y, yaw]"),
        ("[1, 2, 3, 4]", "has 4 numbers; expected [x, y]"),
        ("[1, true]", "y is true; expected a finite number"),
        ("[NaN, 2]", "x is NaN; expected a finite number"),
        ("[1" + "0" * 5000 + ", 2]", "x is Infinity"),
        (
            "[1, 2, 90]",
            "yaw is 90; expected radians between -2 pi and 2 pi (90 degrees are 1.571)",
        ),
        (
            '{"x": 1, "y": 2, "Z": 0}',
            "Z cannot be set for a goal: all quadcopters fly at the scene",
        ),
        ('{"x": 1, "y": 2, "wait": 3}', "wait is not a key of goals; expected wait_s"),
        ('{"x": 1}', "has no y; expected a number of metres"),
        (
            '{"x": 1, "y": 2, "wait_s": -1}',
            "wait_s is -1; expected a number of seconds, 0 to 1e+09",
        ),
        ('{"x": 1, "y": 2, "tolerance": null}', "tolerance is null; expected a number of metres a"),
        (
            '{"x": 1, "y": 2, "yaw": null, "yaw_tolerance": 1}',
            "yaw_tolerance has no effect without a yaw; expected a yaw",
        ),
        ('{"x": 1, "y": 2, "yaw": "north"}', 'yaw is "north"; expected a finite number of radians'),
    ],
)
def test_each_fault_of_a_goal_has_its_number(goal, problem):
    (found,) = faults(f'{{"goals": [{goal}]}}')
    assert found.startswith(f"f.json: goals[0] (goal 1): {problem}")


def test_all_faults_are_listed_at_once():
    content = '{"gaols": 1, "loop": 2, "goals": [[true, null], [5, 5], [1, 2], [11, 2], [5, 5.7]]}'
    assert faults(content, PILLAR) == [
        "f.json: gaols: is not a key of goal files; expected goals",
        "f.json: loop: is 2; expected true or false",
        "f.json: goals[0] (goal 1): x is true; expected a finite number of metres",
        "f.json: goals[0] (goal 1): y is null; expected a finite number of metres",
        (
            "f.json: goals[1] (goal 2): (5, 5) is inside an obstacle; "
            "expected 0.30 m of free space around it"
        ),
        (
            "f.json: goals[3] (goal 4): (11, 2) is outside the arena; "
            "expected a place in x 0 to 10 m, y 0 to 10 m"
        ),
        (
            "f.json: goals[4] (goal 5): (5, 5.7) is 0.20 m from an obstacle or a wall; "
            "expected at least the robot's radius, 0.30 m"
        ),
    ]


def test_a_goal_just_outside_the_robots_radius_is_accepted():
    assert parse_goals('{"goals": [[5, 5.81]]}', "f.json", PILLAR).goals == (Goal(5.0, 5.81),)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(InputError) as caught:
        load_goals(tmp_path / "none.json")
    assert caught.value.problems == [
        f"{tmp_path}/none.json: cannot be read: No such file or directory; expected a file"
    ]


def test_settings_outside_a_file():
    assert read_settings({"retries": 2, "loop": False}, "sequencer") == (
        SequenceSettings(retries=2),
        [],
    )
    _, problems = read_settings({"retries": True, "goal_timeout": "long"}, "sequencer")
    assert problems == [
        "sequencer: retries: is true; expected a whole number, 0 to 10000",
        'sequencer: goal_timeout: is "long"; expected a number of seconds above 0, 1e+09 at most',
    ]


def test_an_edited_file_is_read_when_it_is_stable(tmp_path):
    path = tmp_path / "quad0_goals.json"
    path.write_text('{"goals": [[1, 2]]}')
    watched = WatchedGoalFile(path)
    assert watched.load().goals == (Goal(1.0, 2.0),)
    assert watched.poll() is None
    path.write_text('{"goals": [[1, 2], [3, ')
    assert watched.poll() is None  # read for the first time: an editor may be writing it
    path.write_text('{"goals": [[1, 2], [3, 4]]}')
    assert watched.poll() is None
    assert watched.poll() == GoalSequence((Goal(1.0, 2.0), Goal(3.0, 4.0)))
    assert watched.poll() is None


def test_a_bad_edit_is_reported_once_and_a_repaired_one_accepted(tmp_path):
    path = tmp_path / "quad0_goals.json"
    path.write_text('{"goals": [[1, 2]]}')
    watched = WatchedGoalFile(path)
    watched.load()
    path.write_text('{"goals": [[9, 9]')
    assert watched.poll() is None
    with pytest.raises(InputError, match="is not JSON"):
        watched.poll()
    assert watched.poll() is None
    path.unlink()
    assert watched.poll() is None
    with pytest.raises(InputError, match="cannot be read"):
        watched.poll()
    path.write_text('{"goals": [[9, 9]]}')
    assert watched.poll() is None
    assert watched.poll() == GoalSequence((Goal(9.0, 9.0),))


def test_the_schema_agrees_with_the_code():
    schema = json.loads((GOALS / "schema.json").read_text())
    assert set(schema["properties"]) == set(KEYS)
    assert schema["required"] == ["goals"] and schema["additionalProperties"] is False
    defaults = SequenceSettings()
    for key, setting in SETTINGS.items():
        assert schema["properties"][key].get("default") == getattr(defaults, setting.field)
    properties = schema["properties"]["goals"]["items"]["anyOf"][1]["properties"]
    assert set(properties) == set(GOAL_KEYS)
    assert properties["wait_s"]["default"] == Goal(0.0, 0.0).wait_s
