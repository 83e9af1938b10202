"""Report that compares several flights."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Callable, Dict, List, Mapping, Optional, Sequence, Tuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from quad_nav.report.compared_flight import (
    ComparedFlight,
    Variant,
    difference_rows,
    labelled,
    variants,
)
from quad_nav.report.flight_metrics import FlightMetrics
from quad_nav.report.matplotlib_figures import paths_picture
from quad_nav.report.page import Page, Section, picture, render
from quad_nav.report.paths import MOST_OVERLAID, overlaid_paths
from quad_nav.report.plotly_figures import paths_plot
from quad_nav.report.style import ALARM, QUIET, colour, new_figure, robot_legend

_MOST_NUMBERS = 6  # in the head of a column
_BOX_FROM = 5  # flights; for fewer, the dots alone are clearer
_COUNTS = ("recoveries", "contacts")
_MARKS: Mapping[str, Dict[str, Any]] = {
    "completed": {"marker": "o", "ms": 5.5, "color": colour(0)},
    "failed": {"marker": "X", "ms": 7.5, "color": ALARM},
    "not complete": {"marker": "D", "ms": 5.0, "color": QUIET},
    "unknown": {"marker": "s", "ms": 5.0, "color": QUIET},
}
"""Marks of flights in the picture, by verdict."""
_PANELS = ("mission time", "detour", "recoveries", "min clearance", "min separation", "contacts")


@dataclass(frozen=True)
class Column:
    """Column of the table of values.

    Attributes:
        title: Heading; its unit is in a second line.
        unit: Unit, or empty.
        decimals: Number of decimals.
        value: Returns the value of a flight; None if it is not known.
        prefers: ``min`` or ``max`` of two values is the better one.
        only_completed: Values of failed flights cannot be the best: they flew less.
    """

    title: str
    unit: str
    decimals: int
    value: Callable[[FlightMetrics], Optional[float]]
    prefers: Callable[..., float] = min
    only_completed: bool = True


COLUMNS: Tuple[Column, ...] = (
    Column("goals reached", "", 0, lambda flight: flight.reached, max, False),
    Column("mission time", "s", 1, lambda flight: flight.mission_s if flight.goals else None),
    Column("path length", "m", 1, lambda flight: flight.path_length_m),
    Column("detour", "", 2, lambda flight: flight.detour),
    Column("min clearance", "m", 2, lambda flight: flight.min_clearance_m, max),
    Column("min separation", "m", 2, lambda flight: flight.min_separation_m, max),
    Column("contacts", "", 0, lambda flight: flight.contacts, min, False),
    Column("recoveries", "", 0, lambda flight: flight.recoveries),
    Column("time spinning", "s", 1, lambda flight: flight.spin_s),
    Column("position error, 95 %", "m", 3, lambda flight: flight.position_error_m),
    Column("control cycle", "ms", 1, lambda flight: flight.cycle_ms, min, False),
)
"""Columns of the table of values; those without any value are left out."""


@dataclass(frozen=True)
class Cell:
    """Value in the table, and whether it is the best of its column."""

    text: str
    best: bool = False


def comparison_page(flights: Sequence[ComparedFlight]) -> Page:
    """Build the report that compares several flights."""
    groups = variants(flights)
    metrics = labelled(flights, groups)
    columns = [
        column for column in COLUMNS if any(column.value(one) is not None for one in metrics)
    ]
    comparable = len({(one.setting["scene"], one.setting["quadcopters"]) for one in flights}) == 1
    cells = [_cells(column, metrics, comparable) for column in columns]
    return render(
        "comparison.html.jinja",
        [_paths(flights, metrics), _dots(metrics)],
        flights=metrics,
        groups=_grouped(metrics),
        columns=columns,
        rows=list(zip(metrics, zip(*cells))) if cells else [],
        comparable=comparable,
        variants=[(group.label, _flights_text(group)) for group in groups],
        differences=difference_rows(flights, groups),
        parameters_known=any(flight.differences is not None for flight in flights),
    )


def _cells(column: Column, flights: Sequence[FlightMetrics], comparable: bool) -> List[Cell]:
    values = [column.value(flight) for flight in flights]
    texts = ["–" if value is None else f"{value:.{column.decimals}f}" for value in values]
    known = [
        float(text)
        for flight, text in zip(flights, texts)
        if text != "–" and (flight.success or not column.only_completed)
    ]
    # Values that are printed alike are equal, and no flight is the best of one.
    if not comparable or len(set(texts)) < 2 or len(known) < 2:
        return list(map(Cell, texts))
    best = column.prefers(known)
    counts = [flight.success or not column.only_completed for flight in flights]
    return [
        Cell(text, text != "–" and float(text) == best and does_count)
        for text, does_count in zip(texts, counts)
    ]


def _flights_text(group: Variant) -> str:
    count = len(group.numbers)
    if count == 1:
        return f"flight {group.numbers[0]}"
    if count <= _MOST_NUMBERS:
        return f"flights {', '.join(map(str, group.numbers))}"
    return f"{count} flights"


def _paths(flights: Sequence[ComparedFlight], metrics: Sequence[FlightMetrics]) -> Section:
    caption = (
        "All flights over the scene of the first one. Each flight has a colour and a line pattern. "
        "Squares are start positions, goal 0.2 is the second goal of quadcopter 0. A click in the "
        "legend hides a flight, a double click all others."
    )
    if len(flights) > MOST_OVERLAID:
        caption += f" The first {MOST_OVERLAID} flights of {len(flights)} are shown."
    content = overlaid_paths(flights[:MOST_OVERLAID], metrics)
    return Section(
        "paths",
        "Paths",
        caption,
        plots=(paths_plot(content),),
        paper=(picture("paths", "Paths of all flights", lambda: paths_picture(content)),),
    )


def _dots(metrics: Sequence[FlightMetrics]) -> Section:
    return Section(
        "comparison",
        "Side by side",
        "A mark is a flight. Boxes span the middle half of five or more flights, with the median.",
        (picture("comparison", "Metrics of each flight", lambda: _metrics_picture(metrics)),),
    )


def _grouped(flights: Sequence[FlightMetrics]) -> Dict[str, List[FlightMetrics]]:
    """Group flights by the name of their configuration, in order of appearance."""
    groups: Dict[str, List[FlightMetrics]] = {}
    for flight in flights:
        groups.setdefault(flight.config_name or "unknown", []).append(flight)
    return groups


def _metrics_picture(flights: Sequence[FlightMetrics]) -> Figure:
    """Draw a mark for each flight."""
    groups = _grouped(flights)
    figure = new_figure(5.2)
    panels = [column for title in _PANELS for column in COLUMNS if column.title == title]
    for axes, column in zip(figure.subplots(2, 3).flat, panels):
        unit = f" ({column.unit})" if column.unit else ""
        axes.set_title(column.title.capitalize() + unit)
        axes.grid(axis="x", visible=False)
        for k, group in enumerate(groups.values()):
            _draw_group(axes, k, [(flight, column.value(flight)) for flight in group])
        axes.set(xticks=range(len(groups)), xlim=(-0.6, len(groups) - 0.4))
        axes.set_xticklabels(
            list(groups),
            rotation=0 if len(groups) < 4 else 25,
            ha="center" if len(groups) < 4 else "right",
        )
        if column.title in _COUNTS:
            axes.yaxis.get_major_locator().set_params(integer=True)
            axes.set_ylim(bottom=-0.3, top=max(axes.get_ylim()[1], 1.3))
    found = {flight.verdict for flight in flights}
    shown = [verdict for verdict in _MARKS if verdict in found]
    symbols = [Line2D([], [], ls="", label=f"mission {one}", **_MARKS[one]) for one in shown]
    robot_legend(figure, (), symbols)
    return figure


def _draw_group(
    axes: Axes, column: int, values: Sequence[Tuple[FlightMetrics, Optional[float]]]
) -> None:
    known = [(flight, value) for flight, value in values if value is not None]
    if len(known) >= _BOX_FROM:
        axes.boxplot(
            [value for _, value in known],
            positions=[column],
            widths=0.6,
            showfliers=False,
            boxprops={"color": "#9aa4ae"},
            manage_ticks=False,
            whiskerprops={"color": "#9aa4ae"},
            capprops={"color": "#9aa4ae"},
            medianprops={"color": "black", "lw": 1.4},
        )
    # Side by side in the order of the flights: equal values do not hide each other.
    places = column + (np.linspace(-0.2, 0.2, len(known)) if len(known) > 1 else np.zeros(1))
    for place, (flight, value) in zip(places, known):
        mark = _MARKS[flight.verdict]
        axes.plot(place, value, mec="white", mew=0.6, alpha=0.9, zorder=5, **mark)
