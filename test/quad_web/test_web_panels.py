"""What the panels of the page show: rows, times, rates, controls of parameters, and edits."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from page_without_browser import PARAMETERS, fleet

from quad_nav.geometry import Pose2D
from quad_web import log_panels as logs
from quad_web import robot_panels as robots
from quad_web.flight_bar import RATES, clock_text, rate_step, rate_text
from quad_web.goal_draft import GoalDraft
from quad_web.live_table import LiveTable, column
from quad_web.parameter_panel import (
    by_namespace,
    is_changed,
    is_found,
    slider_range,
    slider_step,
    widget_kind,
)
from quad_web.view.actions import GoalChange, GoalFileView, ParameterView


@pytest.mark.parametrize(
    "time_s, text",
    [(0.0, "0:00.0"), (59.96, "0:59.9"), (61.5, "1:01.5"), (3661.0, "1:01:01.0"), (None, "–:––")],
)
def test_times_are_minutes_and_seconds(time_s, text):
    assert clock_text(time_s) == text


def test_steps_of_the_rate():
    shown = [RATES[rate_step(rate)] for rate in (1.0, 0.9, 1.6, 300.0, None, 0.0)]
    assert shown == [1.0, 1.0, 2.0, 10.0, 1.0, 0.0]
    texts = ["0.00×", "1.00×", "0.12×", "35×", "–"]
    assert [rate_text(rate) for rate in (0.0, 1.0, 0.123456, 35.2, None)] == texts


@pytest.mark.parametrize(
    "age_s, text", [(0.1, "now"), (1.94, "1.9 s"), (2.1, "2.1 s"), (70.2, "70 s")]
)
@pytest.mark.parametrize("state", ["flying", "lost"])
def test_rows_of_robots_are_lost_if_their_source_says_so(age_s, text, state):
    (status, _) = fleet().item("status").data["rows"]
    row = robots.table_row({**status, "state": state, "age_s": age_s}, "#123456")
    assert (row["age"], row["lost"]) == (text, state == "lost")
    assert row["state"] == state
    assert (row["goal"], row["goal_distance"], row["gap_m"]) == ("1/3", 1.23, None)


def test_nothing_in_a_row_is_a_control_character():
    (status, _) = fleet().item("status").data["rows"]
    row = robots.table_row({**status, "state": "fly\x1b[31m", "reason": "a\nb"}, "")
    assert (row["state"], row["reason"]) == ("fly\\x1b[31m", "a\\nb")


def test_a_goal_without_a_yaw_faces_the_way_there():
    state = fleet()
    pose = np.full((2, 9), np.nan, np.float32)
    pose[1] = 0.0
    state.put("poses", {}, {"pose": pose})
    assert robots.goal_pose(state, 1, 0.0, 2.0, None).yaw_rad == pytest.approx(math.pi / 2)
    assert robots.goal_pose(state, None, -3.0, 0.0, None).yaw_rad == pytest.approx(math.pi)
    assert robots.goal_pose(state, 0, 1.0, 2.0, None) == Pose2D(1.0, 2.0)  # pose not known
    assert robots.goal_pose(state, 1, 1.0, 2.0, 0.3) == Pose2D(1.0, 2.0, 0.3)
    assert robots.nearest_robot(state, 9.0, 9.0) == 1


def view(kind, low=None, high=None, **more):
    return ParameterView("", "p", kind, 0, 0, low, high, **more)


@pytest.mark.parametrize(
    "parameter, widget",
    [
        (view("bool"), "switch"),
        (view("double", 0.0, 5.0), "slider"),
        (view("double", 0.0, 1.79e308), "number"),
        (view("double", -math.inf, math.inf), "number"),
        (view("int", None, 5), "number"),
        (view("int", 3, 3), "number"),
        (view("int", 0, 2, choices=(("a", 0),)), "select"),
        (view("str"), "text"),
    ],
)
def test_control_of_a_parameter(parameter, widget):
    assert widget_kind(parameter) == widget


@pytest.mark.parametrize(
    "kind, value, limits, ends, step",
    [
        ("double", 0.3, (0.0, 20.0), (0.0, 1.0), 0.005),
        ("double", 0.0, (0.0, 5.0), (0.0, 5.0), 0.05),
        ("double", -0.3, (-20.0, 20.0), (-1.0, 1.0), 0.01),
        ("double", 15.0, (0.0, 20.0), (0.0, 20.0), 0.1),
        ("double", -0.2, (-20.0, 0.0), (-0.5, 0.0), 0.005),
        ("int", 10, (1, 100), (1.0, 20.0), 1.0),
        ("int", 900, (0, 9000), (0.0, 2000.0), 10.0),
    ],
)
def test_sliders_have_the_size_of_their_values_and_round_steps(kind, value, limits, ends, step):
    parameter = replace(view(kind, *limits), value=value, file_value=value)
    assert slider_range(parameter) == pytest.approx(ends)
    assert slider_step(*ends, kind) == pytest.approx(step)
    assert slider_range(replace(parameter, file_value=10 * value))[0] >= limits[0]


def test_parameters_are_found_by_all_words():
    found = [one.name for one in PARAMETERS if is_found(one, "dwa SPEED")]
    assert found == ["max_vel_x"]
    assert [one.name for one in PARAMETERS if is_changed(one)] == ["max_vel_x"]
    assert {name: len(group) for name, group in by_namespace(PARAMETERS).items()} == {
        "": 1,
        "DWA": 4,
    }


def test_diagnostics_have_problems_first():
    levels = ("OK", "WARN", "STALE", "ERROR", "odd")
    statuses = [{"name": f"{i}", "level": level} for i, level in enumerate(levels)]
    shown = [status["level"] for status in logs.sorted_statuses(statuses)]
    assert shown == ["odd", "ERROR", "STALE", "WARN", "OK"]
    assert logs.problem_count(statuses) == 4
    numbered = [{"name": f"move_base{i}", "level": "OK"} for i in (10, 2, 0)]
    names = [status["name"] for status in logs.sorted_statuses(numbered)]
    assert names == ["move_base0", "move_base2", "move_base10"]


def test_only_changed_cells_are_sent():
    sent = []
    table = LiveTable.__new__(LiveTable)  # without a page
    table._rows, table.run_method = {}, lambda *args: sent.append(args)
    rows = [{"key": i, "a": 1, "b": None} for i in range(3)]
    table.set_rows(rows)
    table.set_rows([dict(row) for row in rows])
    table.set_rows([{**rows[0], "a": 2}, rows[1]])
    assert sent[1:] == [("patch", [{"key": 0, "a": 2}], [2])]
    assert column("x", "X", digits=2)["field"] == "x"


@pytest.fixture
def draft():
    return GoalDraft(GoalFileView(0, "f", "v", [(1.0, 2.0, None), (3.0, 4.0, 1.5)]))


def test_a_draft_is_changed_until_it_is_as_the_file_again(draft):
    assert not draft.is_changed
    draft.move(0, 1)
    assert [goal["source"] for goal in draft.goals] == [1, 0] and draft.is_changed
    draft.move(1, 1)  # the last one stays
    draft.move(1, -1)
    assert not draft.is_changed
    draft.add(5.0, 6.0)
    draft.delete(0)
    assert draft.changes() == [GoalChange(1, 3.0, 4.0, 1.5), GoalChange(None, 5.0, 6.0, None)]


def test_a_value_that_is_no_number_has_the_message_of_files_and_is_not_saved(draft):
    draft.set(0, "yaw", "east")
    message = 'yaw is "east"; expected a finite number of radians, or null'
    assert draft.faults == [message, ""] and draft.changes() is None
    assert draft.valid_changes() == [GoalChange(1, 3.0, 4.0, 1.5)]
    draft.found(["is outside"])
    assert draft.faults == [message, "is outside"] and draft.fault_count == 2
    draft.set(0, "yaw", None)
    assert draft.faults == ["", ""]


def test_a_draft_takes_the_goals_of_the_arena(draft):
    draft.take([GoalChange(1, 3.0, 4.0, None)])
    assert draft.goals == [{"source": 1, "x": 3.0, "y": 4.0, "yaw": None}]
