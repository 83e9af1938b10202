"""Texts in pictures are readable."""

from __future__ import annotations

import pytest
from hand_made_traces import fleet, flight, robot
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.text import Text

from quad_nav.report.flight_page import flight_page
from quad_nav.report.style import label_log, styled


@pytest.fixture
def written(monkeypatch):
    """All that is written in the figures that are drawn, and their markers."""
    found = []
    draw = Figure.savefig

    def savefig(figure, *arguments, **options):
        draw(figure, *arguments, **options)
        found.extend(text.get_text() for text in figure.findobj(Text) if text.get_visible())
        found.extend(
            line.get_marker() for legend in figure.legends for line in legend.findobj(Line2D)
        )

    monkeypatch.setattr(Figure, "savefig", savefig)
    return found


@pytest.mark.slow
def test_no_source_of_formulas_in_reports_of_flights(written):
    near = flight(robot(0, (1.0, 2.0), (0.5, 0.0)), robot(1, (6.0, 3.0), (-0.5, 0.0)))
    for trace in (fleet(3), near):
        for picture in flight_page(trace, wall_time_s=2.0).pictures:
            assert picture.png
    texts = [text for text in written if isinstance(text, str)]
    assert {"close encounter", "contact", "100 %"} <= set(texts)
    assert [text for text in texts if "$" in text] == []


@pytest.mark.parametrize(
    "low, high, labels",
    [
        (0.0002, 0.04, ["0.0003", "0.001", "0.003", "0.01", "0.03"]),
        (0.9, 22.0, ["1", "3", "10"]),
        (0.4, 0.9, ["0.5", "0.7"]),
        (1e-4, 1e3, ["0.0001", "0.001", "0.01", "0.1", "1", "10", "100", "1000"]),
    ],
)
def test_labels_of_logarithmic_axes(low, high, labels):
    with styled():
        figure = Figure()
        axes = figure.subplots()
        axes.set(xscale="log", xlim=(low, high))
        label_log(axes.xaxis)
        ticks = axes.xaxis.get_majorticklocs()
        texts = axes.xaxis.get_major_formatter().format_ticks(ticks)
        minor = axes.xaxis.get_minor_formatter().format_ticks(axes.xaxis.get_minorticklocs())
    edges = (low * (1.0 - 1e-9), high * (1.0 + 1e-9))
    assert [text for at, text in zip(ticks, texts) if edges[0] <= at <= edges[1]] == labels
    assert not any(minor)
