"""Edits of the goals in the text of a goal file."""

from __future__ import annotations

import pytest

from quad_web.view.goal_edit import GoalEdit, edited_text

GOALS = '{\n  "retries": 2,\n  "goals": [\n    [1.0, 5.0],\n    [7.0, 3.50, 1.57]\n  ]\n}\n'


def test_goals_that_stay_keep_their_text():
    kept = [GoalEdit(0, 1.0, 5.0), GoalEdit(1, 7.0, 3.5, 1.57)]
    assert edited_text(GOALS, kept) == GOALS
    moved = edited_text(GOALS, [GoalEdit(0, 1.0, 5.0), GoalEdit(1, 6.12345, 3.5, 1.57)])
    assert moved == GOALS.replace("[7.0, 3.50, 1.57]", "[6.123, 3.5, 1.57]")


@pytest.mark.parametrize(
    "text, goals, expected",
    [
        (
            GOALS,
            [GoalEdit(1, 7.0, 3.5, 1.57), GoalEdit(None, 2.0, -0.0)],
            GOALS.replace("[1.0, 5.0]", "[7.0, 3.50, 1.57]", 1).replace(
                "    [7.0, 3.50, 1.57]\n  ]", "    [2.0, 0.0]\n  ]"
            ),
        ),
        (
            '"goals": [[1,2]]',
            [GoalEdit(0, 1, 2), GoalEdit(None, 3, 4)],
            '"goals": [[1,2], [3.0, 4.0]]',
        ),
        (
            '{"goals":[\n [1,2]\n]}',
            [GoalEdit(0, 1, 2), GoalEdit(None, 3, 4)],
            '{"goals":[\n [1,2],\n [3.0, 4.0]\n]}',
        ),
        (
            '\ufeff{"loop": false, "goals": [[1, 2, 3]]}',
            [GoalEdit(0, 1, 2)],
            '\ufeff{"loop": false, "goals": [[1.0, 2.0]]}',
        ),
        (
            '{"goals": [{"wait_s": 5, "x": 1, "y": 2}]}',
            [GoalEdit(0, 1, 3, 0.5)],
            '{"goals": [{"wait_s": 5, "x": 1.0, "y": 3.0, "yaw": 0.5}]}',
        ),
        (
            '{"goals": [{"x": 1, "y": 2, "yaw": 1}]}',
            [GoalEdit(0, 1, 2)],
            '{"goals": [{"x": 1.0, "y": 2.0, "yaw": null}]}',
        ),
    ],
)
def test_edits_keep_the_form_of_the_file(text, goals, expected):
    assert edited_text(text, goals) == expected
