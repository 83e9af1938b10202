"""The page of ``quad preview --edit``: a mission that waits, and edits of its goals."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import urllib.request
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from test_preview import GOALS, INSIDE, SCENE

from quad_nav.cli.preview import preview as command
from quad_nav.scenario.flight_setup import FlightOptions
from quad_web.offline.waiting_mission import WaitingMission
from quad_web.view.actions import GoalChange
from quad_web.view.state import FleetState

SOURCES = Path(__file__).resolve().parents[2] / "src"
STAYS, MOVED = GoalChange(0, 1.0, 5.0), GoalChange(1, 6.0, 2.0, 1.57)


@pytest.fixture
def hall(tmp_path):
    """Scene and goal files of two robots; the options that read them."""
    (tmp_path / "hall.yaml").write_text(SCENE)
    for robot in (0, 1):
        (tmp_path / f"quad{robot}_goals.json").write_text(GOALS)
    return FlightOptions(tmp_path / "hall.yaml", tmp_path)


def begin(options):
    state = FleetState()
    return WaitingMission(options, "hall", state), state


def goal_states(state):
    return [(goal["robot"], goal["state"]) for goal in state.item("goals").data["goals"]]


def plan_end(state):
    return state.item("plan/0").arrays["points"][-1].tolist()


def test_the_mission_waits_at_its_start(hall):
    mission, state = begin(hall)
    assert state.item("flight").data["state"] == "ready"
    poses = state.item("poses").arrays["pose"][:, [0, 1, 2, 5]]
    np.testing.assert_allclose(poses, [[1, 1, 1, 0], [7, 5, 1, 3.14]], atol=1e-6)
    assert goal_states(state) == [(robot, "pending") for robot in (0, 0, 1, 1)]
    assert plan_end(state) == [7.0, 3.5]
    assert state.item("global_costmap/1").arrays["costs"].max() == 100
    assert [row["gap_m"] > 5.0 for row in state.item("status").data["rows"]] == [True, True]
    for refused in (mission.call("start"), mission.call("stop_all"), mission.call("cancel", 0)):
        assert not refused.ok and "the flight has not begun" in refused.text


def test_a_dragged_goal_is_checked_planned_and_saved(hall):
    mission, state = begin(hall)
    file = mission.goal_files()[0]
    assert mission.check_goals(0, file.version, [STAYS, MOVED]) == ["", ""]
    assert plan_end(state) == [6.0, 2.0]
    assert mission.save_goals(0, file.version, [STAYS, MOVED]).ok
    text = (hall.goals / "quad0_goals.json").read_text()
    assert text == GOALS.replace("[7.0, 3.50, 1.57]", "[6.0, 2.0, 1.57]")
    assert mission.goal_files()[0].version != file.version
    assert [goal["x"] for goal in state.item("goals").data["goals"][:2]] == [1.0, 6.0]
    refused = mission.save_goals(0, file.version, [STAYS])  # from a page that is not reloaded
    assert not refused.ok and "has changed since the page was loaded" in refused.text


def test_a_faulty_place_is_refused_as_by_fly_and_nothing_is_written(hall):
    mission, state = begin(hall)
    file = mission.goal_files()[0]
    inside = [STAYS, GoalChange(1, 4.0, 3.0)]
    assert mission.check_goals(0, file.version, inside) == ["", INSIDE]
    assert plan_end(state) == [1.0, 5.0]
    answer = mission.save_goals(0, file.version, inside)
    assert answer.text == f"not saved: {file.path}: goals[1] (goal 2): (4, 3) {INSIDE}"
    assert (hall.goals / "quad0_goals.json").read_text() == GOALS


def test_files_that_others_change_are_shown_anew(hall):
    mission, state = begin(hall)
    path = hall.goals / "quad0_goals.json"
    path.write_text('{"goals": [[4.0, 3.0]]}')
    assert [len(file.goals) for file in mission.goal_files()] == [1, 2]
    assert goal_states(state)[0] == (0, "failed")
    assert state.events()[0].text == f"{path}: goals[0] (goal 1): (4, 3) {INSIDE}"
    path.write_text("no goals")
    assert "quad0_goals.json" in mission.goal_files()[0].problem
    assert goal_states(state) == [(1, "pending"), (1, "pending")]


@pytest.mark.parametrize(
    "words, problem",
    [
        (["--robots", "3"], "--edit: this mission has no goal files; expected --goals FOLDER"),
        (["--goals", "."], "quad0_goals.json"),
    ],
)
def test_without_files_to_edit_nothing_is_served(tmp_path, monkeypatch, words, problem):
    pytest.importorskip("nicegui")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "quad0_goals.json").write_text("no goals")
    result = CliRunner().invoke(command, ["--edit", *words])
    assert result.exit_code == 2 and problem in result.output, result.output


def test_the_page_is_served_until_ctrl_c(hall):
    pytest.importorskip("nicegui")
    words = ["preview", "--edit", "--scene", str(hall.scene), "--goals", str(hall.goals)]
    with subprocess.Popen(
        [sys.executable, "-m", "quad_nav.cli", *words],
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(SOURCES)},
    ) as process:
        pages = (re.match(r"page: (http://127\.0\.0\.1:\S+)", line) for line in process.stderr)
        with urllib.request.urlopen(next(filter(None, pages)).group(1), timeout=20) as answer:
            assert b"quad preview: hall, 2 quadcopters, default" in answer.read()
        process.send_signal(signal.SIGINT)
        assert process.stderr.read() == "page: ended\n"
    assert process.returncode == 0
