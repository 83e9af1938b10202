"""Goal files that are edited on a page: checked as flights check them, and written whole."""

from __future__ import annotations

import errno
import math

import pytest

from quad_nav.mission.goal_file import load_goals
from quad_web.view.actions import GoalChange
from quad_web.view.goal_files import GoalFiles

TEXT = '{\n  "retries": 2,\n  "goals": [\n    [1.0, 5.0],\n    [7.0, 3.50, 1.57]\n  ]\n}\n'


def check_place(x_m, y_m):
    return "is outside" if x_m > 10.0 else None


@pytest.fixture
def files(tmp_path):
    path = tmp_path / "quad3_goals.json"
    path.write_text(TEXT)
    return GoalFiles({3: path}, lambda robot: check_place)


def unchanged(files):
    (view,) = files.goal_files()
    return view.version, [GoalChange(index, *goal) for index, goal in enumerate(view.goals)]


def test_a_view_has_the_poses_of_the_file(files):
    (view,) = files.goal_files()
    assert (view.robot, view.path, view.problem) == (3, str(files.files[3]), "")
    assert view.goals == [(1.0, 5.0, None), (7.0, 3.5, 1.57)]


def test_a_saved_goal_changes_its_own_text_alone(files):
    version, (first, second) = unchanged(files)
    answer = files.save_goals(3, version, [first, GoalChange(1, 6.0, 2.0, None)])
    assert (answer.ok, answer.text) == (True, f"{files.files[3]}: saved, 2 goals")
    assert files.files[3].read_text() == TEXT.replace("[7.0, 3.50, 1.57]", "[6.0, 2.0]")
    assert files.save_goals(3, version, [first, second]).ok is False  # of the version before
    assert "has changed since" in files.save_goals(3, version, [first, second]).text


def test_goals_are_added_removed_and_put_in_another_order(files):
    version, (first, second) = unchanged(files)
    new = GoalChange(None, 2.0, 2.0, None)
    assert files.save_goals(3, version, [second, new]).ok
    poses = [(one.x_m, one.y_m, one.yaw_rad) for one in load_goals(files.files[3]).goals]
    assert poses == [(7.0, 3.5, 1.57), (2.0, 2.0, None)]


def test_faults_are_those_of_files(files):
    version, (first, _) = unchanged(files)
    goals = [first, GoalChange(None, 11.0, 0.0, None), GoalChange(None, math.nan, 0.0, 7.0)]
    good, outside, broken = files.check_goals(3, goals)
    assert (good, outside) == ("", "is outside")
    assert "x is NaN; expected a finite number of metres; yaw is 7;" in broken
    for bad, message in ((goals[:2], "goals[1] (goal 2): (11, 0) is outside"), (goals, "x is NaN")):
        answer = files.save_goals(3, version, bad)
        assert not answer.ok and message in answer.text
    assert not files.save_goals(3, version, []).ok
    assert not files.save_goals(4, version, [first]).ok
    assert not files.save_goals(3, version, [GoalChange(2, 1.0, 1.0, None)]).ok
    assert files.files[3].read_text() == TEXT


def test_a_file_that_is_no_goal_file_says_so_and_stays(files):
    files.files[3].write_text("{")
    (view,) = files.goal_files()
    assert "is not JSON" in view.problem and view.goals == []
    assert not files.save_goals(3, view.version, [GoalChange(None, 1.0, 1.0, None)]).ok
    files.files[3].unlink()
    assert "quad3_goals.json" in files.goal_files()[0].problem


def test_a_full_disk_is_an_answer(files, monkeypatch):
    def full(path, content):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("quad_web.view.goal_files.write_bytes", full)
    answer = files.save_goals(3, *unchanged(files))
    text = f"not saved: {files.files[3]}: cannot be written: No space left on device"
    assert (answer.ok, answer.text) == (False, text)
