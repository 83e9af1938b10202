"""Pictures of sweeps: what stands where, and that it can be read."""

from __future__ import annotations

import itertools

import matplotlib
import pytest

from quad_nav.report.style import png, styled
from quad_nav.tuning.flight_result import FlightResult
from quad_nav.tuning.report.sweep_page import sweep_picture
from quad_nav.tuning.sweep import SweepRow

pytestmark = pytest.mark.filterwarnings("error")


def flown(time_s: float, gap_m: float, reached: int = 2, contacts: int = 0) -> FlightResult:
    return FlightResult(2, reached, contacts, time_s, 6.0, clearance_m=gap_m)


def panels(rows):
    """Axes by their titles, of a figure that has been drawn."""
    with styled():
        figure = sweep_picture(rows)
        assert png(figure).startswith(b"\x89PNG")
    return {axes.get_title() or axes.get_title(loc="left"): axes for axes in figure.axes}


def luma(rgb):
    return sum(weight * part for weight, part in zip((0.299, 0.587, 0.114), rgb))


def test_map_over_two_parameters():
    """With b = 2 a third of the flights fails where a = 1, and all where a = 2."""
    flights = {
        (1, 1): (flown(20.0, 0.3), flown(21.0, 0.126)),
        (2, 1): (flown(10.0, 0.05), flown(11.0, 0.2)),
        (1, 2): (flown(30.0, 0.2), flown(32.0, 0.2), flown(50.0, 0.2, 1, contacts=1)),
        (2, 2): (flown(60.0, 0.004, 0, contacts=2),),
    }
    rows = [
        SweepRow({"a": a, "b": b}, flights[a, b]) for a, b in itertools.product((1, 2), repeat=2)
    ]
    shown = panels(rows)
    numbers = {title: [text.get_text() for text in axes.texts] for title, axes in shown.items()}
    assert numbers == {
        "Completed missions (%)": ["100", "67", "100", "0"],
        "Flights with contacts (%)": ["0", "33", "0", "100"],
        "Mean mission time (s)": ["20.5", "31.0", "10.5", "–"],
        "Min gap (m)": ["0.13", "0.20", "0.05", "0.00"],
    }
    for axes in shown.values():
        (image,) = axes.images
        for text, cell in zip(axes.texts, image.to_rgba(image.get_array()).reshape(-1, 4)):
            paper = 0.85 * luma(cell[:3]) + 0.15 if cell[3] else 1.0
            assert abs(paper - luma(matplotlib.colors.to_rgb(text.get_color()))) > 0.4


def test_map_where_nothing_arrived():
    rows = [
        SweepRow({"a": a, "b": b}, (flown(60.0, 0.1, 0),))
        for a, b in itertools.product((1, 2), repeat=2)
    ]
    assert [text.get_text() for text in panels(rows)["Mean mission time (s)"].texts] == ["–"] * 4


def test_curve_over_one_parameter():
    """Means as a line, and every flight that arrived as a dot."""
    rows = [
        SweepRow({"a": 0.5}, (flown(20.0, 0.3), flown(22.0, 0.1))),
        SweepRow({"a": 2.0}, (flown(10.0, 0.2), flown(90.0, 0.2, 1))),
    ]
    lines = panels(rows)["Mean mission time (s)"].lines
    assert lines[0].get_xydata().tolist() == [[0.5, 21.0], [2.0, 10.0]]
    assert [line.get_xydata().tolist() for line in lines[1:]] == [
        [[0.5, 20.0], [0.5, 22.0]],
        [[2.0, 10.0]],
    ]


def test_bars_for_a_list_of_points():
    rows = [
        SweepRow({"a": 1, "b": "x"}, (flown(20.0, 0.3),)),
        SweepRow({"a": 2, "b": "y"}, (flown(10.0, 0.2),)),
        SweepRow({"a": 3, "b": "x"}, (flown(15.0, 0.1, 0),)),
    ]
    shown = panels(rows)
    bars = shown["Mean mission time (s)"].patches
    assert [bar.get_width() for bar in bars] == [20.0, 10.0, 0.0]
    labels = shown["Completed missions (%)"].get_yticklabels()  # the leftmost has them for all
    assert [label.get_text() for label in labels] == ["1, x", "2, y", "3, x"]
