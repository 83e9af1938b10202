"""The page on a desktop: what it shows, and what each control calls."""

from __future__ import annotations

import re

import pytest
from browser import until
from driver import Driver
from playwright.sync_api import expect


def test_a_page_shows_the_flight_and_its_robots(driver):
    expect(driver.at("title")).to_have_text("synthetic, 2 robots")
    expect(driver.at("flight-state")).to_have_text("running")
    expect(driver.at("role")).to_have_text("Steering")
    expect(driver.rows()).to_have_count(2)
    expect(driver.at("events")).to_contain_text("mission started")
    first = driver.at("time").inner_text()
    expect(driver.at("time")).not_to_have_text(first)


def test_a_click_in_the_table_or_in_the_arena_selects_a_robot(driver):
    driver.at("play").click()  # robots that stand still are easier to hit
    expect(driver.at("flight-state")).to_have_text("paused")
    driver.select(1)
    driver.wait_for_arena("arena.fleet.selected?.index === 1")
    driver.page.mouse.click(*driver.resting_robot_pixel(0))
    expect(driver.at("card-name")).to_contain_text("0")
    expect(driver.at("robots-row-0")).to_have_class(re.compile("selected"))
    driver.at("deselect").click()
    expect(driver.at("card-name")).to_contain_text("No robot")


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


def test_a_selected_robot_is_followed(driver):
    driver.select(1)
    # Where the robot is drawn does not change while it moves; panels may cover the middle.
    height = "arena.view.viewport.height / 2"
    is_followed = f"Math.abs(arena.view.toScreen(0, arena.fleet.selected?.y)[1] - {height}) < 1e-6"
    driver.wait_for_arena(is_followed)
    here = driver.arena("view.viewport.y")
    driver.wait_for_arena(f"arena.view.viewport.y !== {here} && {is_followed}")


def test_clock_controls(driver, server):
    driver.at("play").click()
    expect(driver.at("flight-state")).to_have_text("paused")
    driver.at("play").click()
    expect(driver.at("flight-state")).to_have_text("running")
    driver.at("reset").click()
    driver.says("reset to the start poses")
    assert server.calls() == ["('pause',)", "('start',)", "('reset',)"]


def test_rate(driver, server):
    thumb = driver.at("rate").locator("[role=slider], [tabindex='0']").first
    thumb.focus()
    thumb.press("ArrowRight")
    thumb.press("Tab")
    driver.says("rate 2")
    assert server.calls() == ["('set_rate', 2.0)"]
    expect(driver.at("rate-shown")).to_have_text("2.00×")


def test_robot_controls(driver, server):
    driver.select(1)
    driver.at("cancel").click()
    driver.says("goal cancelled")
    driver.at("clear-costmaps").click()
    driver.says("costmaps cleared")
    driver.at("lidar").click()
    driver.says("LIDAR off")
    driver.at("lidar").click()
    driver.says("LIDAR on")
    assert server.calls() == [
        "('cancel', 1)",
        "('clear_costmaps', 1)",
        "('enable_lidar', 1, False)",
        "('enable_lidar', 1, True)",
    ]


@pytest.mark.parametrize("by", ["button", "key"])
def test_stop_all(driver, server, by):
    if by == "button":
        driver.at("stop-all").click()
    else:
        driver.page.keyboard.press(".")
    driver.says("every robot hovers")
    assert server.calls() == ["('stop_all',)"]
    expect(driver.at("events")).to_contain_text("every robot hovers")


def test_the_stop_key_is_a_character_where_one_types(driver, server):
    driver.select(0)
    field = driver.at("goal-x")
    field.click()
    driver.page.keyboard.type("1.5")
    expect(field).to_have_value("1.5")
    driver.at("goal-y").click()
    driver.page.keyboard.type("2")
    driver.at("goal-send").click()
    until(driver.page, lambda: len(server.calls()) > 0)
    assert [call.split(",")[0] for call in server.calls()] == ["('send_goal'"]


def test_events_are_filtered(driver):
    driver.at("dock-events").click()
    driver.select(0)
    driver.at("cancel").click()
    expect(driver.at("events")).to_contain_text("goal cancelled")
    driver.at("events-text").fill("mission")
    expect(driver.at("events")).not_to_contain_text("goal cancelled")
    expect(driver.at("events")).to_contain_text("mission started")


def test_layers_are_switched(driver):
    driver.at("layers").click()
    driver.wait_for_arena("arena.fleet.scans.length === 2")
    driver.at("layer-scan").click()
    driver.wait_for_arena("arena.fleet.scans.length === 0")
    driver.at("layer-cell").click()
    driver.wait_for_arena("arena.fleet.cells.length === 2")


def test_a_costmap_is_the_selected_robots(driver):
    driver.select(1)
    driver.at("layers").click()
    driver.at("layer-local_costmap").click()
    driver.wait_for_arena("arena.fleet.costmaps.map(({ key }) => key)[0] === 'local_costmap/1'")
    driver.page.keyboard.press("Escape")
    driver.select(0)
    driver.wait_for_arena("arena.fleet.costmaps.map(({ key }) => key)[0] === 'local_costmap/0'")


def test_a_robot_is_selected_in_3d(driver):
    driver.at("play").click()
    driver.at("mode").get_by_text("3D").click()
    driver.wait_for_arena("arena.view.canvas.width > 0 && arena.view.drawLabels !== undefined")
    driver.page.mouse.click(*driver.resting_robot_pixel(1))
    expect(driver.at("card-name")).to_contain_text("1")


def test_parameters_are_changed_and_go_back_to_the_file(driver, server):
    driver.select(1)
    driver.at("side-parameters").click()
    driver.at("parameters-search").fill("max_vel_x")
    field = driver.at("number-DWAPlannerROS/max_vel_x")
    expect(field).to_have_value("0.55")
    field.fill("0.4")
    field.press("Enter")
    until(driver.page, lambda: len(server.calls()) == 1)
    driver.at("reset-DWAPlannerROS/max_vel_x").click()
    until(driver.page, lambda: len(server.calls()) == 2)
    assert server.calls() == [
        "('set_parameters', 1, 'DWAPlannerROS', {'max_vel_x': 0.4})",
        "('set_parameters', 1, 'DWAPlannerROS', {'max_vel_x': 0.55})",
    ]
    expect(field).to_have_value("0.55")
