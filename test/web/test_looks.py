"""How the page looks, and whether everybody can use it: contrasts, names, legend, marks, charts."""

from __future__ import annotations

import re

import pytest
from axe_playwright_python.sync_playwright import Axe
from browser import PHONE, until
from driver import ARENA, Driver
from playwright.sync_api import expect

CHARTS = "getElement(document.querySelector('.quad-charts')).view"
REACH = "view.reachOf(fleet.robots[1])"
SCHEMES = pytest.mark.parametrize("scheme", ["light", "dark"])
PIXEL = """([x, y]) => {
  const canvas = document.querySelector(".quad-map");
  const box = canvas.getBoundingClientRect();
  const scale = canvas.width / box.width;
  const place = [(x - box.left) * scale, (y - box.top) * scale];
  return [...canvas.getContext("2d").getImageData(...place, 1, 1).data.slice(0, 3)];
}"""


def violations(page):
    """Return what axe-core finds: rule, and elements."""
    page.wait_for_function("() => !document.querySelector('.q-notification')")
    found = Axe().run(page).response["violations"]
    return [(one["id"], [node["html"][:150] for node in one["nodes"]]) for one in found]


@SCHEMES
def test_nothing_keeps_anybody_from_using_a_page_of_a_flight(open_page, server, scheme):
    driver = Driver(open_page(server.url, color_scheme=scheme)).is_ready()
    assert violations(driver.page) == []
    driver.select(0)
    for tab in ("side-robots", "side-parameters", "side-goals", "dock-events", "dock-diagnostics"):
        driver.at(tab).click()
        panel = tab.partition("-")[2]
        expect(driver.at(f"panel-{panel}")).to_be_visible()
        if panel == "parameters":
            driver.at("namespace-DWAPlannerROS").get_by_role("button").first.click()
            expect(driver.at("number-DWAPlannerROS/max_vel_x")).to_be_visible()
        assert violations(driver.page) == []
    server.end()
    expect(driver.at("result")).to_be_visible()
    assert violations(driver.page) == []
    phone = Driver(open_page(server.url, **PHONE, color_scheme=scheme)).is_ready()
    assert violations(phone.page) == []


@SCHEMES
def test_nothing_keeps_anybody_from_using_a_page_of_a_recording(open_page, serve, scheme):
    served = serve("--robots", "2", "--replay", "60")
    driver = Driver(open_page(served.url, color_scheme=scheme)).is_ready()
    driver.select(0)
    assert violations(driver.page) == []
    served.end()
    expect(driver.at("result")).to_be_visible()
    assert violations(driver.page) == []


def test_the_colours_follow_the_reader_while_the_page_is_open(open_page, server):
    driver = Driver(open_page(server.url, color_scheme="light")).is_ready()
    corner = driver.pixel(6.4, 10.6)  # floor, beside the lines of the grid
    paper = "() => getComputedStyle(document.querySelector('.side')).backgroundColor"
    assert driver.page.evaluate(PIXEL, corner) == [255, 255, 255]
    assert driver.page.evaluate(paper) == "rgb(255, 255, 255)"
    driver.page.emulate_media(color_scheme="dark")
    until(driver.page, lambda: max(driver.page.evaluate(PIXEL, corner)) < 60)
    until(driver.page, lambda: driver.page.evaluate(paper) == "rgb(23, 27, 33)")


def test_the_legend_lists_what_is_there_below_the_toolbar(open_page, serve, server):
    driver = Driver(open_page(server.url)).is_ready()
    legend = driver.page.locator(".quad-legend")
    for text in ("Goal reached", "Waits for the other", "Obstacle below it"):
        expect(legend).to_contain_text(text)
    for text in ("Goal failed", "Makes room", "Person", "Cost", "Recovering", "Suspect"):
        expect(legend).not_to_contain_text(text)
    driver.at("layers").click()
    driver.at("layer-goals").click()
    expect(legend).not_to_contain_text("Goal reached")
    everything = Driver(open_page(serve("--robots", "5", "--obstacles").url)).is_ready()
    everything.page.set_viewport_size({"width": 1300, "height": 560})
    legend = everything.page.locator(".quad-legend")
    expect(legend).to_contain_text("Suspect: may move")
    expect(legend).to_contain_text("Obstacle above it")
    toolbar = everything.page.locator(".toolbar").bounding_box()
    assert legend.bounding_box()["y"] > toolbar["y"] + toolbar["height"]
    phone = Driver(open_page(server.url, **PHONE)).is_ready()
    expect(phone.page.locator(".quad-legend")).to_be_hidden()  # until it is asked for


def test_the_selected_robot_has_a_ring_in_black_and_white_and_keeps_its_colour(driver):
    driver.at("play").click()
    expect(driver.at("flight-state")).to_have_text("paused")
    driver.select(1)
    driver.wait_for_arena("arena.fleet.selected?.index === 1")
    x, y = driver.resting_robot_pixel(1)
    radius = driver.page.evaluate(f"() => (({{ view, fleet }}) => {REACH})({ARENA})")
    below = [driver.page.evaluate(PIXEL, [x, y + radius + at]) for at in (4.5, 7.5)]
    assert min(below[0]) > 200 and max(below[1]) < 60
    row = driver.at("robots-row-1").locator(".dot")
    colour = row.evaluate("(dot) => getComputedStyle(dot).backgroundColor")
    number = driver.page.evaluate(PIXEL, [x + 0.6 * radius + 4, y - 0.6 * radius - 8])
    assert number == pytest.approx([int(part) for part in re.findall(r"\d+", colour)], abs=6)


def test_charts_say_what_is_not_recorded_and_lines_that_cover_each_other_are_dashed(
    open_page, serve
):
    driver = Driver(open_page(serve("--robots", "2", "--replay", "60").url)).is_ready()
    texts = f"""() => {CHARTS}._chart.getOption().graphic[0].elements
        .filter(({{ invisible }}) => !invisible).map(({{ style }}) => style.text)"""
    until(driver.page, lambda: driver.page.evaluate(texts) == ["not recorded"])
    dashes = f"""() => {CHARTS}._chart.getOption().series
        .filter(({{ xAxisIndex }}) => xAxisIndex === 0).map(({{ lineStyle }}) => lineStyle.type)"""
    assert driver.page.evaluate(dashes) == ["solid", [6, 6]]  # the gap of two is the same


def test_a_slider_has_the_size_of_its_value_and_the_note_counts(driver):
    driver.select(0)
    driver.at("side-parameters").click()
    driver.at("parameters-search").fill("max_vel_x")
    expect(driver.at("panel-parameters")).to_contain_text("1 of 5 shown")
    slider = driver.at("value-DWAPlannerROS/max_vel_x")
    track, thumb = (
        slider.locator(part).bounding_box() for part in (".q-slider__track", ".q-slider__thumb")
    )
    share = (thumb["x"] + thumb["width"] / 2 - track["x"]) / track["width"]
    assert share == pytest.approx(0.55 / 2.0, abs=0.02)  # the range is 0 to 5


def test_values_lie_within_their_fields_and_banners_stay_on_their_tab(driver):
    driver.select(0)
    driver.at("side-goals").click()
    driver.at("goals-edit").click()
    hint = driver.page.locator(".quad-hint")
    expect(hint).to_contain_text("Goals of robot 0")
    lower = driver.at("g-x-1").evaluate(
        """(input) => {
          const border = input.closest(".q-field__control").getBoundingClientRect();
          const style = getComputedStyle(input);
          const { top, height } = input.getBoundingClientRect();
          return border.bottom - (top + height / 2 + parseFloat(style.fontSize) / 2);
        }"""
    )
    assert lower >= 5.0  # pixels between the text and the border
    driver.at("side-robots").click()
    expect(hint).to_be_hidden()
    expect(driver.at("goals-edit")).to_have_text(re.compile("Edit in the arena$"))


def test_the_text_of_a_fault_covers_no_robot(driver):
    """Robot 0 stands where the text below goal 1 would be."""
    driver.at("play").click()
    expect(driver.at("flight-state")).to_have_text("paused")
    driver.resting_robot_pixel(0)
    told = driver.page.evaluate(
        """async () => {
          const arena = getElement(document.querySelector(".quad-arena")).view;
          const { x, y, radius } = arena.fleet.robots[0];
          const above = y + 26 * arena.view.metresPerPixel;
          const goals = [{ source: 0, x, y: above, yaw: null }];
          arena.apply({ tool: "edit", editing: { robot: 0, goals, faults: ["in an obstacle"] } });
          const { prototype } = CanvasRenderingContext2D;
          const { fillText } = prototype;
          const places = [];
          prototype.fillText = function (text, px, py) {
            if (text === "in an obstacle") places.push([px, py]);
            fillText.call(this, text, px, py);
          };
          arena._draw();
          prototype.fillText = fillText;
          return [places[0], arena.view.toScreen(x, y), arena.view.reachOf(arena.fleet.robots[0])];
        }"""
    )
    (px, py), (rx, ry), reach = told
    assert abs(px - rx) > reach + 30 or abs(py - ry) > reach + 6
