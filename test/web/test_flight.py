"""Real sources behind the page: an offline flight, and its recording."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from browser import ROOT
from driver import Driver
from playwright.sync_api import expect
from test_looks import violations

# The first flight after a change of the kernels compiles them.
pytestmark = pytest.mark.timeout(300)

QUAD = [sys.executable, "-m", "quad_nav.cli"]


@pytest.fixture(scope="module")
def goals(tmp_path_factory):
    """A folder of goals: both fly 1.5 m, from (1.5, 1.5) and (10, 2)."""
    folder = tmp_path_factory.mktemp("goals")
    (folder / "quad0_goals.json").write_text(json.dumps({"goals": [[1.4, 3.0]]}))
    (folder / "quad1_goals.json").write_text(json.dumps({"goals": [[10.0, 3.5]]}))
    return folder


@pytest.fixture(scope="module")
def recording(goals, tmp_path_factory):
    file = tmp_path_factory.mktemp("recording") / "flight.bag"
    path = {**os.environ, "PYTHONPATH": str(ROOT / "src")}
    subprocess.run([*QUAD, "fly", "--goals", goals, "--record", file], check=True, env=path)
    return file


def near(robot, x_m, y_m):
    """Return the condition that a robot is within a goal's tolerance of a place, about."""
    return _within(0.6, x_m, y_m, f"arena.fleet.robots[{robot}]")


def _within(radius_m, x_m, y_m, thing):
    return f"(({{x, y}} = {{}}) => Math.hypot(x - {x_m}, y - {y_m}) < {radius_m})({thing})"


def test_a_quadcopter_arrives_at_a_goal_that_was_clicked_and_stop_all_stops_it(
    serve, open_page, recording
):
    """The tutorial's mission; the recording has had the kernels compiled."""
    flight = Driver(open_page(serve(command=[*QUAD, "fly", "--web"]).url)).is_ready()
    expect(flight.at("time")).not_to_have_text("0:00.0", timeout=60000)
    flight.at("robots-row-1").click()
    flight.use_goal_tool()
    flight.fit()
    flight.click_arena(8.0, 1.5)
    flight.says("quad1")
    flight.wait_for_arena(near(1, 8.0, 1.5), timeout_s=60)
    flight.page.keyboard.press(".")
    expect(flight.at("flight-state")).to_have_text("stopped")
    expect(flight.at("robots-row-0")).to_contain_text("stopped")
    flight.at("dock-events").click()  # opens at its end
    expect(flight.at("events").get_by_text("missions stopped")).to_be_in_viewport()


def test_a_flight_by_keyboard_alone(serve, open_page, recording):
    flight = Driver(open_page(serve(command=[*QUAD, "fly", "--web"]).url))
    expect(flight.is_ready().at("flight-state")).to_have_text("running", timeout=60000)
    flight.fly_by_keyboard()


def test_a_robot_is_told_where_it_is_and_searches_the_whole_map(serve, open_page, goals):
    """By a drag, by keyboard, and by its scans alone; quad0 hovers at its start."""
    options = ["--web", "--localization", "amcl", "--goals", str(goals)]
    served = serve(command=[*QUAD, "fly", *options])
    flight = Driver(open_page(served.url)).is_ready()
    state = flight.at("flight-state")
    expect(state).to_have_text("running", timeout=120000)
    flight.page.keyboard.press(".")
    expect(state).to_have_text("stopped")
    flight.select(0)
    flight.wait_for_arena("arena.fleet.localizations[0]?.points.length > 200")
    expect(flight.at("card-facts")).to_contain_text("from the truth")
    here = flight.arena("fleet.robots[0]")
    flight.use_goal_tool("tool-pose")
    flight.fit()
    flight.drag_arena((4.0, 4.0), (4.0, 5.0))
    flight.says("quad0: pose set to (4.00, 4.00), 90°")
    flight.wait_for_arena(believed_near(4.0, 4.0))
    flight.page.keyboard.press("Escape")
    for name, value in (("x", here["x"]), ("y", here["y"]), ("yaw", here["yaw"])):
        flight.at(f"goal-{name}").fill(f"{value:.2f}")
    flight.tab_to("[data-testid=pose-set]")
    flight.page.keyboard.press("Enter")
    flight.wait_for_arena(believed_near(here["x"], here["y"]))
    flight.at("play").click()  # resumes
    expect(state).to_have_text("running")
    flight.at("play").click()
    expect(state).to_have_text("paused")
    flight.at("search").click()
    flight.says("quad0: searches the whole map")
    xs = "arena.fleet.localizations[0].points.filter((_, i) => i % 2 === 0)"
    flight.wait_for_arena(f"Math.max(...{xs}) - Math.min(...{xs}) > 8")
    expect(flight.at("robots-row-0")).to_contain_text("lost")
    dark = Driver(open_page(served.url, color_scheme="dark")).is_ready()
    dark.select(0)
    assert [violations(one.page) for one in (flight, dark)] == [[], []]


def believed_near(x_m, y_m):
    """Return the condition that robot 0 believes itself near a place: particles spread by 0.5 m."""
    return _within(1.7, x_m, y_m, "arena.fleet.localizations[0]")


def test_a_flight_that_has_ended_shows_its_result_and_its_closest_moments(
    serve, open_page, goals, tmp_path
):
    report = tmp_path / "report.html"
    options = ["--web", "--rate", "0", "--goals", goals, "--report", report]
    served = serve(command=[*QUAD, "fly", *map(str, options)])
    flight = Driver(open_page(served.url))
    card = flight.at("result")
    expect(card).to_contain_text("Mission succeeded", timeout=200000)
    expect(flight.at("flight-state")).to_have_text("ended")
    summary = flight.page.request.get(f"{served.url}summary.json").json()
    assert summary["success"]
    for text in (
        "2 of 2",
        f"{summary['sim_time_s']:.1f} s",
        f"{summary['min_separation_m']:.2f} m",
        f"{min(robot['min_clearance_m'] for robot in summary['robots']):.2f} m",
    ):
        expect(card).to_contain_text(text)
    history = "getElement(document.querySelector('.quad-charts')).view._history"
    least_m = flight.page.evaluate(f"() => Math.min(...{history}.band(0).least)")
    assert least_m == pytest.approx(summary["min_separation_m"], abs=0.01)
    assert flight.page.evaluate(f"() => {history}.times.length") > 5 * summary["sim_time_s"]
    with flight.page.context.expect_page() as opened:
        flight.at("result-report").click()
    expect(opened.value.locator("h1")).to_contain_text("2 quadcopters")
    flight.at("result-again").click()
    flight.says("the flight starts again")  # it takes a tenth of a second, and shows a new card


def test_goals_are_edited_before_the_flight(serve, open_page, goals, tmp_path):
    """The tab of goals is open; an edit shows the new plan, and is saved to the file."""
    file = Path(shutil.copy(goals / "quad0_goals.json", tmp_path))
    served = serve(command=[*QUAD, "preview", "--edit", "--goals", tmp_path])
    driver = Driver(open_page(served.url))
    expect(driver.at("flight-state")).to_have_text("ready")
    expect(driver.at("stop-all")).to_be_disabled()
    driver.at("g-y-0").fill("4.0")
    driver.at("g-y-0").press("Enter")
    driver.wait_for_arena("arena.fleet.plans[0]?.points.at(-1) > 3.9")
    driver.at("goals-save").click()
    driver.says("saved, 1 goal")
    assert json.loads(file.read_text())["goals"] == [[1.4, 4.0]]


def test_a_recording_is_scrubbed(serve, open_page, recording):
    server = serve(command=[*QUAD, "replay", str(recording)])
    driver = Driver(open_page(server.url)).is_ready()
    expect(driver.at("flight-state")).to_have_text("running")
    driver.at("play").click()
    expect(driver.at("flight-state")).to_have_text("paused")
    line = driver.at("scrub").bounding_box()
    driver.page.mouse.click(line["x"] + line["width"] - 9, line["y"] + line["height"] / 2)
    driver.wait_for_arena(near(0, 1.4, 3.0))
    driver.page.mouse.click(line["x"] + 9, line["y"] + line["height"] / 2)
    driver.wait_for_arena(near(0, 1.5, 1.5))
    expect(driver.at("time")).to_have_text("0:00.0")
    expect(driver.at("scrub-time")).to_have_text(re.compile("^0:00.0 / 0:"))  # it is let go
