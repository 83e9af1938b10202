"""Goals: sent by click and by drag, and edited in their files."""

from __future__ import annotations

import math
import re

import pytest
from playwright.sync_api import expect


def sent_goal(server):
    """Return robot, x, y and yaw of the only action that was called."""
    (call,) = server.calls()
    robot, x_m, y_m, yaw_rad = re.fullmatch(
        r"\('send_goal', (\w+), Pose2D\(x_m=(\S+), y_m=(\S+), yaw_rad=(\S+)\)\)", call
    ).groups()
    return robot, float(x_m), float(y_m), float(yaw_rad)


def test_a_drag_sends_the_selected_robot_to_a_pose_with_a_yaw(driver, server):
    driver.select(1)
    driver.use_goal_tool()
    driver.fit()
    driver.drag_arena((6.0, 2.0), (6.0, 4.0))
    driver.says("robot1: goal sent")
    assert sent_goal(server) == ("1", *map(pytest.approx, (6.0, 2.0, math.pi / 2), (0.03,) * 3))


def test_a_click_sends_the_nearest_robot(driver, server):
    driver.use_goal_tool()
    driver.click_arena(11.0, 6.0)  # robots fly within 2 m of (3.5, 3.5) and (8.5, 3.5)
    driver.says("robot1: goal sent")
    robot, x_m, y_m, _ = sent_goal(server)
    assert (x_m, y_m) == (pytest.approx(11.0, abs=0.03), pytest.approx(6.0, abs=0.03))


@pytest.mark.parametrize(
    "typed, fault",
    [
        (("nan", "1", ""), "x is NaN; expected a finite number of metres"),
        (("1", "", ""), "y is null; expected a finite number of metres"),
        (("1", "2", "north"), 'yaw is "north"; expected a finite number of radians, or null'),
    ],
)
def test_a_bad_goal_is_refused_with_the_words_of_goal_files(driver, server, typed, fault):
    driver.select(0)
    for name, text in zip(("x", "y", "yaw"), typed):
        driver.at(f"goal-{name}").fill(text)
    driver.at("goal-send").click()
    expect(driver.at("goal-fault")).to_have_text(fault)
    assert server.calls() == []


def test_a_goal_outside_of_the_arena_is_refused_by_the_source(driver, server):
    driver.select(0)
    for name, text in (("x", "-3"), ("y", "1")):
        driver.at(f"goal-{name}").fill(text)
    driver.at("goal-send").click()
    driver.says("goal outside of the arena")


@pytest.fixture
def editor(driver):
    """The page while robot 0's goals, (1, 2), (4, 3) and (6, 6), are edited in the arena."""
    driver.select(0)
    driver.at("side-goals").click()
    expect(driver.at("goals-status")).to_have_text("3 goals, as in the file")
    driver.at("goals-edit").click()
    expect(driver.page.locator(".quad-hint")).to_be_visible()
    driver.fit()
    return driver


def test_a_goal_is_dragged_and_saved(editor, server):
    editor.drag_arena((4.0, 3.0), (5.0, 4.0))
    expect(editor.at("goals-status")).to_have_text("3 goals, not saved")
    editor.at("goals-save").click()
    editor.says("goals0.json: 3 goals saved")
    (call,) = server.calls()
    changes = re.findall(r"source=(\w+), x_m=([\d.]+), y_m=([\d.]+)", call)
    assert [source for source, *_ in changes] == ["0", "1", "2"]
    assert [(round(float(x), 1), round(float(y), 1)) for _, x, y in changes] == [
        (1.0, 2.0),
        (5.0, 4.0),
        (6.0, 6.0),
    ]


def test_goals_are_added_and_deleted(editor, server):
    editor.click_arena(8.0, 1.0)
    expect(editor.at("goals-status")).to_have_text("4 goals, not saved")
    editor.at("g-delete-0").click()
    expect(editor.at("goals-status")).to_have_text("3 goals, not saved")
    editor.at("goals-save").click()
    editor.says("goals0.json: 3 goals saved")
    assert re.findall(r"source=(\w+)", server.calls()[0]) == ["1", "2", "None"]


def test_a_bad_goal_of_a_file_cannot_be_saved(editor, server):
    editor.at("g-x-1").fill("-7")
    editor.at("g-x-1").press("Enter")
    expect(editor.at("g-fault-1")).to_have_text("outside of the arena")
    expect(editor.at("goals-save")).to_be_disabled()
    editor.at("goals-discard").click()
    expect(editor.at("goals-status")).to_have_text("3 goals, as in the file")
    expect(editor.at("g-x-1")).to_have_value("4")
    assert server.calls() == []
