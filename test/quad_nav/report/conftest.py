"""What is written in the pictures of reports."""

from __future__ import annotations

import pytest
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.text import Text


@pytest.fixture
def written(monkeypatch):
    """All that is written in the figures that are saved, and the texts that are markers."""
    found = []
    draw = Figure.savefig

    def savefig(figure, *arguments, **options):
        draw(figure, *arguments, **options)
        found.extend(text.get_text() for text in figure.findobj(Text) if text.get_visible())
        markers = [
            line.get_marker() for legend in figure.legends for line in legend.findobj(Line2D)
        ]
        found.extend(marker for marker in markers if isinstance(marker, str))

    monkeypatch.setattr(Figure, "savefig", savefig)
    return found
