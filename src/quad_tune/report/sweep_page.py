"""Report of a sweep over one parameter, two parameters, or a list of points."""

from __future__ import annotations

from pathlib import Path
from typing import Sequence

from quad_nav.report.page import Page, render
from quad_nav.report.panels import plot_section
from quad_nav.versions import versions
from quad_tune.report.sweep_measures import EXPLANATIONS, axis_note, is_numeric
from quad_tune.report.sweep_plot import sweep_plot
from quad_tune.study_text import format_value
from quad_tune.sweep import SweepRow, SweepSetup

_FOLDER = Path(__file__).parent


def sweep_page(setup: SweepSetup, rows: Sequence[SweepRow]) -> Page:
    """Build the page with plot and table."""
    section = plot_section(
        "sweep",
        "Comparison",
        f"Flights per point: {setup.flights}, with the same missions and seeds at each point. "
        f"{_drawn(rows)}",
        sweep_plot(rows),
    )
    return render(
        "sweep.html.jinja",
        [section],
        _FOLDER,
        setup=setup,
        rows=rows,
        words=format_value,
        explanations=EXPLANATIONS,
        versions=versions(),
    )


def _drawn(rows: Sequence[SweepRow]) -> str:
    """Say what the panels show, and where their axes start."""
    intervals = (
        "95 % intervals, Wilson's for shares and the bootstrap's for means. Values whose intervals "
        "overlap may differ by chance."
    )
    paths = list(rows[0].point)
    values = [
        list({repr(row.point[path]): row.point[path] for row in rows}.values()) for path in paths
    ]
    if len(paths) == 1 and is_numeric(values[0]):
        return (
            f"Vertical axes start at 0. {axis_note(paths[0], values[0])} Grey dots are single "
            f"flights, thin lines are {intervals}"
        )
    if len(paths) == 2 and len(rows) == len(values[0]) * len(values[1]):
        return (
            "Colours start at 0, green is better. A cell has the value above its interval; an "
            f"empty cell has no completed mission. These are {intervals}"
        )
    return f"Bars start at 0, thin lines are {intervals}"
