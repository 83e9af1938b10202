"""Texts in pictures are readable."""

from __future__ import annotations

import pytest
from hand_made_traces import fleet, flight, robot
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.text import Text
from optuna.distributions import CategoricalDistribution, FloatDistribution
from optuna.trial import TrialState, create_trial

from quad_nav.report.flight_page import flight_page
from quad_nav.report.style import label_log, png, styled
from quad_tune.report.search_pictures import history_picture, slice_picture
from quad_tune.space import Dimension, SearchSpace

SPACE = SearchSpace(
    "by hand",
    (
        Dimension("a/weight", 0.0003, 0.03, log=True),
        Dimension("*_costmap/scale", 1.0, 20.0, log=True),
        Dimension("a/speed", 0.2, 0.6),
        Dimension("rate", choices=(5.0, 10.0)),
    ),
)
DISTRIBUTIONS = {
    "a/weight": FloatDistribution(0.0003, 0.03, log=True),
    "*_costmap/scale": FloatDistribution(1.0, 20.0, log=True),
    "a/speed": FloatDistribution(0.2, 0.6),
    "rate": CategoricalDistribution((5.0, 10.0)),
}


def trial(number: int, cost: float, *values: float, state: TrialState = TrialState.COMPLETE):
    made = create_trial(
        state=state,
        value=cost,
        params=dict(zip(DISTRIBUTIONS, values)),
        distributions=DISTRIBUTIONS,
        intermediate_values={1: cost} if state is TrialState.PRUNED else None,
    )
    made.number = number
    return made


TRIALS = [
    trial(0, 5.0, 0.001, 4.0, 0.3, 10.0),
    trial(1, 9000.0, 0.0004, 18.0, 0.5, 5.0),
    trial(2, 4.0, 0.02, 1.5, 0.4, 10.0),
    trial(3, 6.0, 0.003, 9.0, 0.25, 5.0, state=TrialState.PRUNED),
]


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


def test_no_source_of_formulas_in_pictures_of_a_search(written):
    base = {"a/weight": 0.001, "*_costmap/scale": 4.0, "a/speed": 0.3, "rate": 10.0}
    with styled():
        png(history_picture(TRIALS, 5.0))
        png(slice_picture(TRIALS, SPACE, SPACE.paths, {"a/weight": 0.02}, base, 5.0))
    texts = [text for text in written if isinstance(text, str)]
    assert {"0.001", "0.01", "10", "tuned", "10.0"} <= set(texts)
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
