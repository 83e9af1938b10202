"""Report of a sweep over one parameter, two parameters, or a list of points."""

from __future__ import annotations

from pathlib import Path
from typing import Any, List, Optional, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from quad_nav.report.page import Page, Section, picture, render
from quad_nav.report.style import ALARM, QUIET, colour, label_log, new_figure
from quad_nav.versions import versions
from quad_tune.report.sweep_measures import (
    EXPLANATIONS,
    MEASURES,
    Estimate,
    Measure,
    axis_note,
    is_log,
    is_numeric,
    point_text,
    starts_at_zero,
)
from quad_tune.report.sweep_plot import sweep_plot
from quad_tune.study_text import format_value
from quad_tune.sweep import SweepRow, SweepSetup

_COLUMNS = 2
_MAX_NUMBERS = 100  # largest map with numbers in its cells
_MAX_LABELS = 30
_MAX_LETTERS = 36  # longest label of a point


def sweep_picture(rows: Sequence[SweepRow]) -> Figure:
    """Draw one panel for each measure."""
    paths = list(rows[0].point)
    axis_values = [list(dict.fromkeys(row.point[path] for row in rows)) for path in paths]
    lines = -(-len(MEASURES) // _COLUMNS)
    if len(paths) == 1 and is_numeric(axis_values[0]):
        figure = new_figure(2.3 * lines)
        for axes, measure in zip(figure.subplots(lines, _COLUMNS, sharex=True).flat, MEASURES):
            _draw_curve(axes, rows, paths[0], measure)
        for axes in figure.axes[-_COLUMNS:]:
            axes.set_xlabel(paths[0])
    elif len(paths) == 2 and len(rows) == len(axis_values[0]) * len(axis_values[1]):
        figure = new_figure(0.6 + lines * (0.7 + 0.4 * max(len(axis_values[0]), 3)))
        for axes, measure in zip(figure.subplots(lines, _COLUMNS).flat, MEASURES):
            _draw_map(figure, axes, rows, axis_values, measure)
        figure.supxlabel(paths[1], fontsize=9)
        figure.supylabel(paths[0], fontsize=9)
    else:
        figure = new_figure(lines * (0.6 + 0.2 * len(rows)))
        for axes, measure in zip(figure.subplots(lines, _COLUMNS, sharey=True).flat, MEASURES):
            _draw_list(axes, rows, measure)
    return figure


def _draw_curve(axes: Axes, rows: Sequence[SweepRow], path: str, measure: Measure) -> None:
    """Draw the flights, and the measure with its interval, over numbers."""
    places = [float(row.point[path]) for row in rows]
    for place, row in zip(places, rows):
        each = measure.of_flights(row.flights)
        axes.plot([place] * len(each), each, ".", ms=4, color=QUIET, alpha=0.6, zorder=1)
    found = [measure.estimate(row.flights) for row in rows]
    shown = [(place, one.value, one) for place, one in zip(places, found) if one.value is not None]
    if shown:
        axes.errorbar(
            [place for place, _, _ in shown],
            [value for _, value, _ in shown],
            yerr=_errors([one for _, _, one in shown]),
            fmt="o-",
            capsize=3,
            elinewidth=1.0,
            color=colour(0),
            zorder=3,
        )
    axes.set_title(measure.title)
    axes.set_ylim(0.0, 105.0 if measure.is_percentage else None)
    if is_log(places):
        axes.set_xscale("log")
        label_log(axes.xaxis)
    elif starts_at_zero(places):
        axes.set_xlim(left=0.0)


def _errors(found: Sequence[Estimate]) -> Optional[NDArray[np.float64]]:
    """Return how far the intervals reach below and above the values, shape (2, k), if any."""
    if all(one.low is None for one in found):
        return None
    return np.array([one.reach() for one in found]).T


def _draw_map(
    figure: Figure,
    axes: Axes,
    rows: Sequence[SweepRow],
    values: Sequence[List[Any]],
    measure: Measure,
) -> None:
    cells = _cells(rows, values, measure)
    known = cells[np.isfinite(cells)]
    high = 100.0 if measure.is_percentage else float(known.max(initial=1e-9))
    image = axes.imshow(
        cells,
        aspect="auto",
        origin="lower",
        vmin=0.0,
        vmax=high,
        cmap="RdYlGn" if measure.more_is_better else "RdYlGn_r",
        alpha=0.85,
    )
    if cells.size <= _MAX_NUMBERS:
        for (i, j), number in np.ndenumerate(cells):
            text = "–" if np.isnan(number) else f"{number:.{measure.decimals}f}"
            # Unknown cells are transparent, so white text would be invisible.
            ink = "black" if np.isnan(number) else _ink(image.to_rgba(np.array(number)))
            axes.text(j, i, text, color=ink, ha="center", va="center", fontsize=8)
    else:
        figure.colorbar(image, ax=axes)
    axes.set_title(measure.title)
    axes.grid(visible=False)
    axes.set(xticks=range(len(values[1])), yticks=range(len(values[0])))
    axes.set_xticklabels(list(map(format_value, values[1])))
    axes.set_yticklabels(list(map(format_value, values[0])))


def _cells(
    rows: Sequence[SweepRow], values: Sequence[List[Any]], measure: Measure
) -> NDArray[np.float64]:
    """Return the measure for each pair of values, NaN where it is unknown."""
    cells = np.full((len(values[0]), len(values[1])), np.nan)
    first, second = list(rows[0].point)
    for row in rows:
        value = measure.estimate(row.flights).value
        place = (values[0].index(row.point[first]), values[1].index(row.point[second]))
        cells[place] = np.nan if value is None else value
    return cells


def _ink(rgba: NDArray[Any]) -> str:
    """Return black or white, whichever is readable on a colour, by its luma (ITU-R BT.601)."""
    luma = float(np.dot(rgba[:3], (0.299, 0.587, 0.114)))
    return "black" if luma > 0.5 else "white"


def _draw_list(axes: Axes, rows: Sequence[SweepRow], measure: Measure) -> None:
    found = [measure.estimate(row.flights) for row in rows]
    is_alarming = measure.title.startswith("Flights with")
    axes.barh(
        range(len(rows)),
        [one.value or 0.0 for one in found],
        xerr=_errors(found),
        height=0.65,
        capsize=2,
        error_kw={"elinewidth": 0.9},
        color=ALARM if is_alarming else colour(0),
    )
    axes.set_title(measure.title, fontsize=8)
    axes.set(ylim=(len(rows) - 0.4, -0.6), yticks=range(len(rows)))
    labels = [point_text(list(row.point.values()))[:_MAX_LETTERS] for row in rows]
    axes.set_yticklabels(labels if len(rows) <= _MAX_LABELS else [""] * len(rows))
    axes.grid(axis="y", visible=False)
    axes.set_xlim(0.0, 105.0 if measure.is_percentage else None)


_FOLDER = Path(__file__).parent


def sweep_page(setup: SweepSetup, rows: Sequence[SweepRow]) -> Page:
    """Build the page with plot and table."""
    section = Section(
        "sweep",
        "Comparison",
        f"Flights per point: {setup.flights}, with the same missions and seeds at each point. "
        f"{_drawn(rows)}",
        plots=(sweep_plot(rows),),
        paper=(picture("sweep", "Measures over the values", lambda: sweep_picture(rows)),),
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
