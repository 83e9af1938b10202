"""Report of a sweep over one parameter, two parameters, or a list of points."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Callable, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from quad_nav.report import style
from quad_nav.report.page import Page, Section, picture, render
from quad_nav.report.style import ALARM, QUIET, colour, new_figure
from quad_nav.tuning.statistics import FlightStatistics
from quad_nav.tuning.study_text import format_value
from quad_nav.tuning.sweep import SweepRow, SweepSetup
from quad_nav.versions import versions


class Measure(NamedTuple):
    """Measure of a panel; ``decimals`` is that of the numbers in a map."""

    title: str
    more_is_better: bool
    decimals: int
    value: Callable[[FlightStatistics], Optional[float]]

    @property
    def is_percentage(self) -> bool:
        """True if the values are percentages."""
        return self.title.endswith("(%)")


MEASURES: Tuple[Measure, ...] = (
    Measure(
        "Completed missions (%)",
        True,
        0,
        lambda flights: 100.0 * flights.completed / flights.flights,
    ),
    Measure(
        "Flights with contacts (%)",
        False,
        0,
        lambda flights: 100.0 * flights.touched / flights.flights,
    ),
    Measure("Mean mission time (s)", False, 1, lambda flights: flights.mean_time_s),
    Measure("Min gap (m)", True, 2, lambda flights: flights.least_gap_m),
)
_MAX_NUMBERS = 100  # largest map with numbers in its cells
_MAX_LABELS = 30
_MAX_LETTERS = 36  # longest label of a point


def sweep_picture(rows: Sequence[SweepRow]) -> Figure:
    """Draw one panel for each measure."""
    paths = list(rows[0].point)
    axis_values = [list(dict.fromkeys(row.point[path] for row in rows)) for path in paths]
    if len(paths) == 1:
        figure = new_figure(4.6)
        for axes, measure in zip(figure.subplots(2, 2, sharex=True).flat, MEASURES):
            _draw_curve(axes, rows, paths[0], measure)
    elif len(paths) == 2 and len(rows) == len(axis_values[0]) * len(axis_values[1]):
        figure = new_figure(1.6 + 0.75 * max(len(axis_values[0]), 4))
        for axes, measure in zip(figure.subplots(2, 2).flat, MEASURES):
            _draw_map(figure, axes, rows, axis_values, measure)
        figure.supxlabel(paths[1], fontsize=9)
        figure.supylabel(paths[0], fontsize=9)
    else:
        figure = new_figure(1.4 + 0.24 * len(rows))
        panels = figure.subplots(1, len(MEASURES), sharey=True)
        for axes, measure in zip(panels, MEASURES):
            _draw_list(axes, rows, measure)
    return figure


def _draw_curve(axes: Axes, rows: Sequence[SweepRow], path: str, measure: Measure) -> None:
    places, labels = _places([row.point[path] for row in rows])
    found = [measure.value(row.statistics) for row in rows]
    axes.plot(
        places, [np.nan if value is None else value for value in found], "o-", color=colour(0)
    )
    if measure.title.startswith("Mean"):  # also each flight
        for place, row in zip(places, rows):
            times_s = [flight.time_s for flight in row.flights if flight.completed]
            axes.plot([place] * len(times_s), times_s, ".", ms=4, color=QUIET, alpha=0.6, zorder=1)
    axes.set_title(measure.title)
    axes.set_xlabel(path)
    if labels:
        axes.set_xticks(places)
        axes.set_xticklabels(labels)
    if measure.is_percentage:
        axes.set_ylim(-5, 105)


def _draw_map(
    figure: Figure,
    axes: Axes,
    rows: Sequence[SweepRow],
    values: Sequence[List[Any]],
    measure: Measure,
) -> None:
    cells = _cells(rows, values, measure)
    low, high = (0.0, 100.0) if measure.is_percentage else (None, None)
    image = axes.imshow(
        cells,
        aspect="auto",
        origin="lower",
        vmin=low,
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
        value = measure.value(row.statistics)
        place = (values[0].index(row.point[first]), values[1].index(row.point[second]))
        cells[place] = np.nan if value is None else value
    return cells


def _ink(rgba: NDArray[Any]) -> str:
    """Return black or white, whichever is readable on a colour, by its luma (ITU-R BT.601)."""
    luma = float(np.dot(rgba[:3], (0.299, 0.587, 0.114)))
    return "black" if luma > 0.5 else "white"


def _draw_list(axes: Axes, rows: Sequence[SweepRow], measure: Measure) -> None:
    found = [measure.value(row.statistics) for row in rows]
    is_alarming = measure.title.startswith("Flights with")
    axes.barh(
        range(len(rows)),
        [0.0 if value is None else value for value in found],
        height=0.65,
        color=ALARM if is_alarming else colour(0),
    )
    axes.set_title(measure.title, fontsize=8)
    axes.set(ylim=(len(rows) - 0.4, -0.6), yticks=range(len(rows)))
    labels = [", ".join(map(format_value, row.point.values()))[:_MAX_LETTERS] for row in rows]
    axes.set_yticklabels(labels if len(rows) <= _MAX_LABELS else [""] * len(rows))
    axes.grid(axis="y", visible=False)
    if measure.is_percentage:
        axes.set_xlim(0, 105)


def _places(values: Sequence[Any]) -> Tuple[List[float], List[str]]:
    """Return positions on the axis, and labels unless the values are numbers."""
    if all(isinstance(value, (int, float)) and not isinstance(value, bool) for value in values):
        return [float(value) for value in values], []
    return [float(k) for k in range(len(values))], list(map(format_value, values))


_FOLDER = Path(__file__).parent


def sweep_page(setup: SweepSetup, rows: Sequence[SweepRow]) -> Page:
    """Build the page with pictures and table."""
    with style.styled():
        section = Section(
            "sweep",
            "Comparison",
            f"Flights per point: {setup.flights}, equal for all points. A gap is the smaller of "
            "clearance and separation. Times are those of completed missions.",
            (picture("sweep", "Statistics over the values", sweep_picture(rows)),),
        )
    return render(
        "sweep.html.jinja",
        [section],
        _FOLDER,
        setup=setup,
        rows=rows,
        words=format_value,
        versions=versions(),
    )
