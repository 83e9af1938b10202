"""Texts in pictures are readable."""

from __future__ import annotations

import pytest
from matplotlib.figure import Figure

from quad_nav.report.style import label_log, styled


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
