"""Comparison of flights: values, differences of parameters and set-ups, paths in one plot."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import lru_cache

import plotly.graph_objects
import pytest
from hand_made_traces import TIMES_S, fleet, flight, goal, robot
from report_pages import Parsed, assert_loads_nothing, figures_of

from quad_nav.report.compared_flight import compared_flight, difference_rows, variants
from quad_nav.report.comparison import comparison_page
from quad_nav.report.plot import INK, PAPER
from quad_nav.sim.contacts import Contact

SLOW, FAST = {"controller_frequency": 5.0}, {"controller_frequency": 10.0}


def straight(speed_mps: float, duration_s: float, title: str, parameters=SLOW, **more):
    """A flight of one robot along x to its goal."""
    goals = (goal(0, (1.0 + speed_mps * duration_s, 1.0), 0.0, duration_s),)
    times_s = TIMES_S[TIMES_S <= duration_s]
    pilot = robot(
        0, (1.0, 1.0), (speed_mps, 0.0), times_s=times_s, goals=goals, parameters=parameters
    )
    return compared_flight(replace(flight(pilot, **more), title=title))


@lru_cache(maxsize=None)
def flights():
    """Of 3 m in 10 s, of 3 m in 5 s, and one that is the fastest but has a contact."""
    touch = [Contact(2.0, "quad0", "pillar", 2.0, 1.0)]
    return (
        straight(0.3, 10.0, "calm.bag", jitter_m=0.0),
        straight(0.6, 5.0, "swift.bag", FAST, jitter_m=0.0),
        straight(0.75, 4.0, "wild.bag", FAST, jitter_m=0.1, contacts=touch),
    )


@lru_cache(maxsize=None)
def page():
    return comparison_page(flights())


def rows_of(html: str):
    """The texts of all table rows, without tags."""
    return [
        " ".join(re.sub(r"<[^>]*>|&nbsp;", " ", row).split())
        for row in re.findall(r"<tr>(.*?)</tr>", html, re.S)
    ]


def test_values_and_the_best_of_completed_flights():
    """wild.bag is faster, but its contact makes it fail; equal values have no best one.

    The hull of 0.3 m flies 1 m beside a wall. Control cycles take 20 ms.
    """
    html = page().html
    assert Parsed(html).sections == ["flights", "differences", "paths", "comparison"]
    assert_loads_nothing(html)
    assert [picture.name for picture in page().pictures] == ["paths", "comparison"]
    rows = rows_of(html)
    assert "1 calm.bag default (A) 7 1 of 1 10.0 3.0 1.00 ★ 0.70 ★ 0 0 0.0 20.0 completed" in rows
    assert "2 swift.bag default (B) 7 1 of 1 ★ 5.0 3.0 1.00 ★ 0.70 ★ 0 0 0.0 20.0 completed" in rows
    assert (
        "3 wild.bag default (C) 7 1 of 1 4.0 3.0 1.00 0.00 1 0 0.0 20.0 failed: 1 contact" in rows
    )


def test_a_recording_that_is_not_complete_has_a_mark_of_its_own():
    cut = replace(flights()[0], metrics=replace(flights()[0].metrics, covered_s=(0.0, 9.0)))
    (legend,) = comparison_page([cut]).pictures[1].draw().legends
    assert [text.get_text() for text in legend.get_texts()] == ["mission not complete"]


def test_only_what_differs_is_in_the_table():
    rows = difference_rows(flights(), variants(flights()))
    assert [(row.path, row.values, row.default) for row in rows] == [
        ("largest jitter", ("0 m", "0 m", "0.1 m"), ""),
        ("controller_frequency", ("5", "10", "10"), "20"),
    ]
    assert "controller_frequency 5 10 10 20 Hz" in rows_of(page().html)


def test_flights_that_differ_in_the_seed_alone_share_a_column():
    calm = flights()[0]
    again = replace(calm, metrics=replace(calm.metrics, seed=8))
    groups = variants([calm, again, flights()[1]])
    assert [(group.label, group.numbers) for group in groups] == [
        ("default (A)", (1, 2)),
        ("default (B)", (3,)),
    ]
    html = comparison_page([calm, again]).html
    assert "All flights have the same parameters and set-up." in html
    assert "default 2 2 (100 %)" in rows_of(html)


def test_values_of_single_robots_and_of_both_costmaps():
    def inflated(*radii_m):
        trees = [
            {
                name: {
                    "plugins": [{"name": "wide", "type": "costmap_2d::InflationLayer"}],
                    "wide": {"inflation_radius": radius_m},
                }
                for name in ("global_costmap", "local_costmap")
            }
            for radius_m in radii_m
        ]
        robots = (robot(k, (1.0, 1.0 + k), parameters=tree) for k, tree in enumerate(trees))
        return compared_flight(flight(*robots))

    two = [inflated(0.7, 0.7), inflated(0.7, 0.9)]
    (row,) = difference_rows(two, variants(two))
    assert row.path == "*_costmap/wide/inflation_radius"
    assert row.values == ("0.7", "0.7 (quad0); 0.9 (quad1)")


def test_paths_are_in_one_plot():
    figure = figures_of(page().html)["paths"]
    assert plotly.graph_objects.Figure(figure).data
    lines = [one for one in figure["data"] if one.get("legendgroup") and one["mode"] == "lines"]
    assert [line["name"] for line in lines] == ["1: calm.bag", "2: swift.bag", "3: wild.bag"]
    assert len({(line["line"]["color"], line["line"]["dash"]) for line in lines}) == 3
    assert lines[1]["x"][-1] == 4.0 and lines[1]["customdata"][-1] == [5.0, 0.6]
    goals = next(one for one in figure["data"] if one.get("name") == "goal")
    assert (goals["text"], goals["x"]) == (["0.1"], [4.0])  # once, though all fly there
    assert (goals["textfont"]["color"], goals["marker"]["color"]) == ([INK], [PAPER])  # dark, too


@pytest.mark.filterwarnings("error")
def test_flights_that_hold_little():
    empty = flight(scene=None, seed=None, config_name="", versions={})
    html = comparison_page([compared_flight(empty), compared_flight(fleet(2))]).html
    assert "no value is marked as the best" in html
    assert_loads_nothing(html)
