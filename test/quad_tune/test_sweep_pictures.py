"""Pictures of sweeps: what stands where, and that it can be read."""

from __future__ import annotations

import itertools
import json

import matplotlib
import plotly.graph_objects
import pytest

from quad_nav.report.style import png, styled
from quad_tune.flight_result import FlightResult
from quad_tune.report.sweep_measures import (
    MEASURES,
    Estimate,
    axis_note,
    is_log,
    is_numeric,
    starts_at_zero,
)
from quad_tune.report.sweep_page import sweep_picture
from quad_tune.report.sweep_plot import sweep_plot
from quad_tune.sweep import SweepRow

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
        "Roughness (m/s²)": ["0.00"] * 4,
        # (1, 2): 30, 32 and 50 s over 6 m, 1/3 for each gap, 7500 for a goal, 50 for a contact.
        "Cost": ["3.71", "2523.22", "2.33", "10085.99"],
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
    """Means as a line with intervals, every flight that arrived as a dot, and axes from 0."""
    rows = [
        SweepRow({"a": 0.5}, (flown(20.0, 0.3), flown(22.0, 0.1))),
        SweepRow({"a": 2.0}, (flown(10.0, 0.2), flown(90.0, 0.2, 1))),
    ]
    shown = panels(rows)
    axes = shown["Mean mission time (s)"]
    lines = [line.get_xydata().tolist() for line in axes.lines]
    assert lines[:2] == [[[0.5, 20.0], [0.5, 22.0]], [[2.0, 10.0]]]
    assert lines[2] == [[0.5, 21.0], [2.0, 10.0]]
    (bars,) = axes.collections  # of two flights the interval spans both; one flight has none
    assert [bar.tolist() for bar in bars.get_segments()] == [
        [[0.5, 20.0], [0.5, 22.0]],
        [[2.0, 10.0], [2.0, 10.0]],
    ]
    for panel in shown.values():
        assert panel.get_ylim()[0] == 0.0 and panel.get_xlim()[0] == 0.0


def test_axes_of_parameters_that_do_not_start_at_zero():
    assert not starts_at_zero([5.0, 6.0]) and starts_at_zero([0.2, 0.6])
    assert not starts_at_zero([-1.0, 6.0])
    assert is_log([0.001, 0.1]) and not is_log([0.0, 1.0]) and not is_log([0.1, 1.0])
    assert axis_note("a", [0.001, 0.1]) == "The horizontal axis of a is logarithmic."
    assert axis_note("a", [5.0, 6.0]) == "The axis of a does not start at 0."
    assert axis_note("a", [0.2, 0.6]) == ""
    assert not is_numeric([True, False]) and not is_numeric(["a"]) and is_numeric([1, 2.5])


@pytest.mark.parametrize("values", [("p/Trajectory", "p/DWA"), (True, False)])
def test_values_without_order_are_not_joined(values):
    rows = [SweepRow({"a": value}, (flown(20.0, 0.3), flown(22.0, 0.1))) for value in values]
    shown = panels(rows)
    assert all(not axes.lines or len(axes.lines) == 2 for axes in shown.values())  # caps of bars
    bars = shown["Mean mission time (s)"].patches
    assert [(bar.get_x(), bar.get_width()) for bar in bars] == [(0.0, 21.0)] * 2
    assert all(trace["type"] == "bar" for trace in sweep_plot(rows).traces)
    labels = shown["Completed missions (%)"].get_yticklabels()
    assert [label.get_text() for label in labels] == (
        ["Trajectory", "DWA"] if "p/DWA" in values else ["true", "false"]
    )


def test_shares_have_wilsons_interval_and_means_the_bootstraps():
    """4 of 4: Wilson's lower end is 1 / (1 + 1.96^2 / 4) = 51 %."""
    flights = tuple(flown(time_s, 0.2) for time_s in (20.0, 21.0, 22.0, 23.0))
    found = {measure.title: measure.estimate(flights) for measure in MEASURES}
    share = found["Completed missions (%)"]
    assert (share.flights, share.value, share.high) == (4, 100.0, pytest.approx(100.0))
    assert share.low == pytest.approx(51.0, abs=0.05)
    assert found["Mean mission time (s)"] == (4, 21.5, 20.0, 23.0)  # the tails reach both ends
    assert found["Min gap (m)"] == (4, 0.2, None, None)
    assert found["Mean mission time (s)"].text(1) == "21.5 (95 %: 20.0 to 23.0), 4 flights"
    assert Estimate(0).text(1) == "unknown, 0 flights"


def plots():
    """A sweep of each kind."""
    kinds = (
        [{"a": 0.5}, {"a": 1.0}],
        [{"a": 1, "b": 1}, {"a": 1, "b": 2}, {"a": 2, "b": 1}, {"a": 2, "b": 2}],
        [{"a": "<x>", "b": 1}, {"a": "y", "b": 2}],
    )
    for points in kinds:
        yield sweep_plot([SweepRow(point, (flown(20.0, 0.3), flown(9.0, 0.1))) for point in points])


def test_plots_are_figures_of_plotly_whose_axes_start_at_zero():
    for plot in plots():
        figure = json.loads(plot.json)
        found = plotly.graph_objects.Figure({"data": figure["data"], "layout": figure["layout"]})
        titles = [note["text"] for note in figure["layout"]["annotations"]]
        assert titles == [f"<b>{measure.title}</b>" for measure in MEASURES]
        assert "<x>" not in plot.json
        for trace in found.data:
            if trace.type == "heatmap":
                assert trace.zmin == 0
                continue
            side = "x" if trace.type == "bar" else "y"
            axis = found.layout[f"{side}axis{(trace[f'{side}axis'] or side)[1:]}"]
            assert axis.rangemode == "tozero" or axis.range[0] == 0
            if trace.type == "bar":
                assert trace.base is None
    curve = next(plots()).traces[5]  # of the mean time
    assert (curve["mode"], curve["y"]) == ("lines+markers", [14.5, 14.5])
    assert curve["hovertext"][0] == "a: 0.5<br><b>14.5 (95 %: 9.0 to 20.0), 2 flights</b>"


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
