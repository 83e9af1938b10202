"""Texts in pictures are readable."""

from __future__ import annotations

import pytest
from matplotlib.figure import Figure
from optuna.distributions import CategoricalDistribution, FloatDistribution
from optuna.trial import create_trial

from quad_nav.report.style import label_log, png, styled
from quad_tune.report.search_pictures import history_picture, slice_picture
from quad_tune.space import Dimension, SearchSpace

DISTRIBUTIONS = {
    "a/weight": FloatDistribution(0.0003, 0.03, log=True),
    "*_costmap/scale": FloatDistribution(1.0, 20.0, log=True),
    "a/speed": FloatDistribution(0.2, 0.6),
    "rate": CategoricalDistribution((5.0, 10.0)),
}
SPACE = SearchSpace(
    "by hand",
    (
        *(
            Dimension(name, one.low, one.high, log=one.log)
            for name, one in DISTRIBUTIONS.items()
            if name != "rate"
        ),
        Dimension("rate", choices=(5.0, 10.0)),
    ),
)


def trial(number: int, cost: float, *values: float):
    made = create_trial(
        value=cost, params=dict(zip(DISTRIBUTIONS, values)), distributions=DISTRIBUTIONS
    )
    made.number = number
    return made


TRIALS = [
    trial(0, 5.0, 0.001, 4.0, 0.3, 10.0),
    trial(1, 9000.0, 0.0004, 18.0, 0.5, 5.0),
    trial(2, 4.0, 0.02, 1.5, 0.4, 10.0),
]


def test_no_source_of_formulas_in_pictures_of_a_search(written):
    base = {"a/weight": 0.001, "*_costmap/scale": 4.0, "a/speed": 0.3, "rate": 10.0}
    with styled():
        png(history_picture(TRIALS, 5.0))
        png(slice_picture(TRIALS, SPACE, SPACE.paths, {"a/weight": 0.02}, base, 5.0))
    assert {"0.001", "0.01", "10", "tuned", "10.0"} <= set(written)
    assert [text for text in written if "$" in text] == []


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
