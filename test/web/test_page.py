"""The page on a desktop and on a phone: what it shows, and what each control calls."""

from __future__ import annotations

import math
import re

import pytest
from browser import PHONE, until
from driver import Driver
from playwright.sync_api import expect

SEND = r"\('send_goal', (\w+), Pose2D\(x_m=(\S+), y_m=(\S+), yaw_rad=(\S+)\)\)"


def sent_goal(server):
    """Return robot, x, y and yaw of the last action, which has sent a goal."""
    robot, x_m, y_m, yaw_rad = re.fullmatch(SEND, server.calls()[-1]).groups()
    return robot, float(x_m), float(y_m), float(yaw_rad)


def test_the_flight_and_its_clock(driver, server):
    expect(driver.at("title")).to_have_text("synthetic, 2 robots")
    expect(driver.at("flight-state")).to_have_text("running")
    expect(driver.at("role")).to_have_text("Steering")
    expect(driver.rows()).to_have_count(2)
    first = driver.at("time").inner_text()
    expect(driver.at("time")).not_to_have_text(first)
    driver.at("play").click()
    expect(driver.at("flight-state")).to_have_text("paused")
    driver.at("play").click()
    expect(driver.at("flight-state")).to_have_text("running")
    driver.at("reset").click()
    driver.says("reset to the start poses")
    thumb = driver.at("rate").locator("[role=slider], [tabindex='0']").first
    thumb.focus()
    thumb.press("ArrowRight")
    thumb.press("Tab")
    driver.says("rate 2")
    expect(driver.at("rate-shown")).to_have_text("2.00×")
    assert server.calls() == ["('pause',)", "('start',)", "('reset',)", "('set_rate', 2.0)"]


def test_robots_are_selected_in_both_views_and_followed(driver):
    driver.at("play").click()  # robots that stand still are easier to hit
    expect(driver.at("flight-state")).to_have_text("paused")
    driver.select(1)
    driver.wait_for_arena("arena.fleet.selected?.index === 1")
    driver.page.mouse.click(*driver.resting_robot_pixel(0))
    expect(driver.at("card-name")).to_contain_text("0")
    expect(driver.at("robots-row-0")).to_have_class(re.compile("selected"))
    driver.at("deselect").click()
    expect(driver.at("card-name")).to_contain_text("No robot")
    driver.at("mode").get_by_text("3D").click()
    driver.wait_for_arena("arena.view.canvas.width > 0 && arena.view.drawLabels !== undefined")
    driver.page.mouse.click(*driver.resting_robot_pixel(1))
    expect(driver.at("card-name")).to_contain_text("1")
    driver.at("mode").get_by_text("2D").click()
    driver.at("play").click()
    driver.at("robots-row-0").click()
    driver.at("robots-row-1").click()
    driver.wait_for_arena("arena.fleet.selected?.index === 1")
    assert not driver.arena("_isFollowing")  # all of the arena is seen
    for _ in range(3):
        driver.page.get_by_title("Zoom in").click()
    driver.at("robots-row-0").click()
    driver.at("robots-row-1").click()
    # Where the robot is drawn does not change while it moves; panels may cover the middle.
    height = "arena.view.viewport?.height / 2"
    is_followed = f"Math.abs(arena.view.toScreen(0, arena.fleet.selected?.y)[1] - {height}) < 1e-6"
    driver.wait_for_arena(is_followed)
    here = driver.arena("view.viewport.y")
    driver.wait_for_arena(f"arena.view.viewport.y !== {here} && {is_followed}")


def test_the_row_of_a_robot_that_is_selected_in_the_arena_comes_into_view(open_page, serve):
    driver = Driver(open_page(serve("--robots", "100").url)).is_ready()
    heading = driver.at("robots").get_by_text("dist m")
    for _ in range(2):  # robot 7 is now the 93rd
        heading.click()
    expect(driver.at("robots-row-99")).to_be_in_viewport()
    expect(driver.at("robots-row-7")).to_have_count(0)  # rows out of view are not there
    driver.arena("pick(7)")
    expect(driver.at("robots-row-7")).to_be_in_viewport()
    expect(driver.at("robots-row-7")).to_have_class(re.compile("selected"))


def test_the_selected_robot_is_told_and_its_parameters_change(driver, server):
    driver.select(1)
    for testid, text in (
        ("cancel", "goal cancelled"),
        ("clear-costmaps", "costmaps cleared"),
        ("lidar", "LIDAR off"),
    ):
        driver.at(testid).click()
        driver.says(text)
    driver.at("side-parameters").click()
    driver.at("parameters-search").fill("max_vel_x")
    field = driver.at("number-DWAPlannerROS/max_vel_x")
    expect(field).to_have_value("0.55")
    field.fill("0.4")
    field.press("Enter")
    until(driver.page, lambda: len(server.calls()) == 4)
    driver.at("reset-DWAPlannerROS/max_vel_x").click()
    until(driver.page, lambda: len(server.calls()) == 5)
    expect(field).to_have_value("0.55")
    assert server.calls() == [
        "('cancel', 1)",
        "('clear_costmaps', 1)",
        "('enable_lidar', 1, False)",
        "('set_parameters', 1, 'DWAPlannerROS', {'max_vel_x': 0.4})",
        "('set_parameters', 1, 'DWAPlannerROS', {'max_vel_x': 0.55})",
    ]


def test_stop_all_events_and_layers(driver, server):
    driver.at("stop-all").click()
    driver.says("every robot hovers")
    expect(driver.at("flight-state")).to_have_text("stopped")
    expect(driver.at("play")).to_have_text(re.compile("Resume$"))
    driver.at("play").click()
    expect(driver.at("flight-state")).to_have_text("running")
    expect(driver.at("play")).not_to_have_text(re.compile("Resume"))
    driver.select(0)
    field = driver.at("goal-x")
    field.click()
    driver.page.keyboard.type("1.5")  # the stop key is a character where one types
    expect(field).to_have_value("1.5")
    driver.at("deselect").click()
    driver.page.keyboard.press(".")
    stop, start = "('stop_all',)", "('start',)"
    until(driver.page, lambda: server.calls() == [stop, start, stop])
    driver.at("dock-events").click()
    expect(driver.at("events")).to_contain_text("every robot hovers")
    driver.at("events-text").fill("mission")
    expect(driver.at("events")).not_to_contain_text("every robot hovers")
    expect(driver.at("events")).to_contain_text("mission started")
    driver.at("layers").click()
    driver.wait_for_arena("arena.fleet.scans.length === 2")
    driver.at("layer-scan").click()
    driver.wait_for_arena("arena.fleet.scans.length === 0")
    driver.at("layer-local_costmap").click()
    driver.page.keyboard.press("Escape")
    for robot in (1, 0):  # a costmap is the selected robot's
        driver.select(robot)
        key = f"local_costmap/{robot}"
        driver.wait_for_arena(f"arena.fleet.costmaps.map(({{ key }}) => key)[0] === '{key}'")


def test_goals_are_sent_by_drag_by_click_and_typed(driver, server):
    driver.select(1)
    driver.use_goal_tool()
    driver.fit()
    driver.drag_arena((6.0, 2.0), (6.0, 4.0))
    driver.says("robot1: goal sent")
    assert sent_goal(server) == ("1", *map(pytest.approx, (6.0, 2.0, math.pi / 2), (0.03,) * 3))
    driver.at("deselect").click()
    driver.click_arena(11.0, 6.0)  # robots fly within 2 m of (3.5, 3.5) and (8.5, 3.5)
    until(driver.page, lambda: len(server.calls()) == 2)
    assert sent_goal(server)[:3] == ("None", *map(pytest.approx, (11.0, 6.0), (0.03,) * 2))
    for x, y, yaw, fault in (
        ("nan", "1", "", "x is NaN; expected a finite number of metres"),
        ("1", "2", "north", 'yaw is "north"; expected a finite number of radians, or null'),
        ("-3", "1", "", ""),
    ):
        for name, text in (("x", x), ("y", y), ("yaw", yaw)):
            driver.at(f"goal-{name}").fill(text)
        driver.at("goal-send").click()
        expect(driver.at("goal-fault")).to_have_text(fault)
    driver.says("goal outside of the arena")
    assert len(server.calls()) == 3


def test_a_goal_file_is_edited_in_the_arena_and_in_the_list(driver, server):
    """Robot 0's goals are (1, 2), (4, 3) and (6, 6)."""
    driver.select(0)
    driver.at("side-goals").click()
    status = driver.at("goals-status")
    expect(status).to_have_text("3 goals, as in the file")
    driver.at("goals-edit").click()
    expect(driver.page.locator(".quad-hint")).to_be_visible()
    driver.fit()
    driver.at("g-x-1").fill("-7")
    driver.at("g-x-1").press("Enter")
    expect(driver.at("g-fault-1")).to_have_text("outside of the arena")
    expect(driver.at("goals-save")).to_be_disabled()
    driver.at("goals-discard").click()
    expect(status).to_have_text("3 goals, as in the file")
    expect(driver.at("g-x-1")).to_have_value("4")
    driver.drag_arena((4.0, 3.0), (5.0, 4.0))
    expect(status).to_have_text("3 goals, not saved")
    driver.click_arena(8.0, 1.0)
    expect(status).to_have_text("4 goals, not saved")
    driver.at("g-delete-0").click()
    expect(status).to_have_text("3 goals, not saved")
    driver.at("goals-save").click()
    driver.says("goals0.json: 3 goals saved")
    (call,) = server.calls()
    changes = re.findall(r"source=(\w+), x_m=([\d.]+), y_m=([\d.]+)", call)
    assert [(source, round(float(x), 1), round(float(y), 1)) for source, x, y in changes] == [
        ("1", 5.0, 4.0),
        ("2", 6.0, 6.0),
        ("None", 8.0, 1.0),
    ]


def test_a_phone_steers_by_touch(open_page, server):
    phone = Driver(open_page(server.url, **PHONE)).is_ready()
    width = phone.page.evaluate("document.documentElement.scrollWidth")
    assert width <= PHONE["viewport"]["width"]
    phone.at("robots-row-1").tap()
    phone.use_goal_tool("tool-goal")
    phone.page.touchscreen.tap(*phone.pixel(6.0, 2.0))
    phone.says("goal sent")
    for panel in ("robots", "robot", "events", "parameters", "goals", "diagnostics"):
        phone.at(f"phone-{panel}").tap()
        expect(phone.at(f"panel-{panel}")).to_be_visible()
        expect(phone.at("stop-all")).to_be_in_viewport(ratio=1)
    phone.at("stop-all").tap()
    phone.says("every robot hovers")
    assert [call[:13] for call in server.calls()] == ["('send_goal',", "('stop_all',)"]


def test_two_pages_both_see_what_came_of_an_action(driver, open_page, server):
    other = Driver(open_page(server.url)).is_ready()
    driver.at("play").click()
    for one in (driver, other):
        expect(one.at("flight-state")).to_have_text("paused")
        expect(one.at("events")).to_contain_text("paused")
    other.select(1)
    assert driver.arena("fleet.selected") is None  # each page has its own selection
