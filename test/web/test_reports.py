"""Reports in the browser: on a phone, and on a dark screen."""

from __future__ import annotations

import pytest
from browser import PHONE
from hand_made_traces import fleet

from quad_nav.report.flight_page import flight_page

BOXES = """selector => [...document.querySelectorAll(selector)].map(one => {
  const {left, right, top, bottom} = one.getBoundingClientRect();
  return {left, right, top, bottom};
})"""


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    path = tmp_path_factory.mktemp("report") / "flight.html"
    path.write_text(flight_page(fleet(2)).html, encoding="utf-8")
    return path.as_uri()


@pytest.fixture
def opened(open_page, report):
    def open_report(**options):
        page = open_page(None, **options)
        page.goto(report)
        page.wait_for_function("document.querySelectorAll('.plot .legend').length >= 5")
        return page

    return open_report


def test_on_a_phone_plots_have_one_column_the_full_width_and_the_legend_below(opened):
    page = opened(**PHONE)

    def boxes(selector):
        return page.evaluate(BOXES, selector)

    assert page.evaluate("document.documentElement.scrollWidth") == 390
    (area,) = boxes("#plot-paths .cartesianlayer .xy .gridlayer, #plot-paths .nsewdrag")[-1:]
    width, height = area["right"] - area["left"], area["bottom"] - area["top"]
    assert width > 280 and abs(width - height) < 3  # the scene is square
    (buttons,), (slider,), (legend,) = map(
        boxes,
        (
            "#plot-paths .updatemenu-container",
            "#plot-paths .slider-container",
            "#plot-paths .legend",
        ),
    )
    assert area["bottom"] < buttons["top"] and buttons["bottom"] <= slider["top"]
    assert slider["bottom"] <= legend["top"] and slider["right"] <= 390
    panels = boxes("#plot-motion .nsewdrag")
    assert len(panels) == 6 and len({round(one["left"]) for one in panels}) == 1
    assert all(above["bottom"] < below["top"] for above, below in zip(panels, panels[1:]))
    titles = boxes("#plot-distances .annotation")
    (legend,) = boxes("#plot-distances .legend")
    assert max(one["bottom"] for one in titles) < legend["top"]


def test_on_a_screen_the_whole_plot_of_paths_with_its_button_is_seen(opened):
    page = opened()
    button = page.locator("#plot-paths .updatemenu-button").first
    page.locator("#plot-paths").evaluate("one => one.scrollIntoView()")
    box = button.bounding_box()
    assert 0 < box["y"] and box["y"] + box["height"] < 900


def test_on_a_dark_screen_a_report_is_dark_and_on_paper_it_is_white(opened):
    page = opened(color_scheme="dark")

    def colours():
        return page.evaluate(
            "[getComputedStyle(document.body).backgroundColor,"
            " document.getElementById('plot-motion').layout.paper_bgcolor]"
        )

    assert colours() == ["rgb(23, 27, 33)", "#171b21"]
    page.emulate_media(media="print")
    page.evaluate("window.dispatchEvent(new Event('beforeprint'))")
    assert colours() == ["rgb(255, 255, 255)", "#ffffff"]
    page.emulate_media(media="screen", color_scheme="light")
    page.evaluate("window.dispatchEvent(new Event('afterprint'))")
    assert colours() == ["rgb(255, 255, 255)", "#ffffff"]
