"""Interactive plots of a sweep: curves, maps and bars, with intervals at each point."""

from __future__ import annotations

from typing import Any, List, Sequence, Tuple

from quad_nav.report.panels import Panel, panel_plot
from quad_nav.report.plot import ALARM, INK, QUIET, Json, Plot, axis, plot_text, rgb
from quad_tune.report.sweep_measures import (
    MEASURES,
    Estimate,
    Measure,
    is_log,
    is_numeric,
    point_text,
    starts_at_zero,
)
from quad_tune.study_text import format_value
from quad_tune.sweep import SweepRow

_COLUMNS = 2
_BETTER = ([0.0, "#d73027"], [0.5, "#fee08b"], [1.0, "#1a9850"])  # plotly.js has no such scale
_MAX_NUMBERS = 100  # largest map with numbers in its cells


def sweep_plot(rows: Sequence[SweepRow]) -> Plot:
    """Build one panel for each measure."""
    paths = list(rows[0].point)
    values = [list(dict.fromkeys(row.point[path] for row in rows)) for path in paths]
    if len(paths) == 1 and is_numeric(values[0]):
        return _panels(rows, _curve, 230, paths[0])
    if len(paths) == 2 and len(rows) == len(values[0]) * len(values[1]):
        return _panels(rows, _map, 44 * max(len(values[0]), 4), paths[1])
    return _panels(rows, _bars, 30 + 24 * len(rows), "")


def _panels(rows: Sequence[SweepRow], draw: Any, panel_px: int, xlabel: str) -> Plot:
    panels = []
    for k, measure in enumerate(MEASURES):
        traces, x, y = draw(rows, measure, k % _COLUMNS == 0)
        is_last = k >= len(MEASURES) - _COLUMNS
        x["title"]["text"] = plot_text(xlabel) if is_last else ""
        panels.append(Panel(measure.title, traces, x, y))
    return panel_plot("sweep", "Measures over the values", panels, _COLUMNS, panel_px)


def _curve(
    rows: Sequence[SweepRow], measure: Measure, is_left: bool
) -> Tuple[List[Json], Json, Json]:
    """Draw points with intervals over one parameter, whose values are numbers."""
    (path,) = rows[0].point
    values = [row.point[path] for row in rows]
    found = [measure.estimate(row.flights) for row in rows]
    traces = [
        {
            "type": "scatter",
            "mode": "markers",
            "x": [
                value for value, row in zip(values, rows) for _ in measure.of_flights(row.flights)
            ],
            "y": [one for row in rows for one in measure.of_flights(row.flights)],
            "marker": {"size": 5, "color": QUIET, "opacity": 0.45},
            "hovertemplate": "one flight: %{y}<extra></extra>",
        },
        {
            "type": "scatter",
            "mode": "lines+markers",
            "x": values,
            "y": [one.value for one in found],
            "error_y": _errors(found),
            "line": {"color": rgb(0), "width": 2},
            "marker": {"size": 9, "color": rgb(0)},
            "hovertext": _hovers(rows, measure, found),
            "hovertemplate": "%{hovertext}<extra></extra>",
        },
    ]
    return traces, _number_axis(values), _value_axis(measure)


def _number_axis(values: Sequence[float]) -> Json:
    if is_log(values):
        return axis("", type="log")
    return axis("", rangemode="tozero" if starts_at_zero(values) else "normal")


def _value_axis(measure: Measure) -> Json:
    """Return an axis that starts at 0."""
    if measure.is_percentage:
        return axis("", range=[0, 105])
    return axis("", rangemode="tozero")


def _map(
    rows: Sequence[SweepRow], measure: Measure, is_left: bool
) -> Tuple[List[Json], Json, Json]:
    """Draw a cell for each pair of values; colours start at 0."""
    first, second = list(rows[0].point)
    down, right = (list(dict.fromkeys(row.point[path] for row in rows)) for path in (first, second))
    cells = {(row.point[first], row.point[second]): row for row in rows}
    table = [[cells[one, other] for other in right] for one in down]
    found = [[measure.estimate(row.flights) for row in line] for line in table]
    values = [one.value for line in found for one in line if one.value is not None]
    names = [[plot_text(format_value(value)) for value in axis] for axis in (right, down)]
    show = len(rows) <= _MAX_NUMBERS
    trace = {
        "type": "heatmap",
        "x": names[0],
        "y": names[1],
        "z": [[one.value for one in line] for line in found],
        "zmin": 0,
        "zmax": 100 if measure.is_percentage else max([*values, 1e-9]),
        "colorscale": _BETTER,
        "reversescale": not measure.more_is_better,
        "showscale": False,
        "xgap": 2,
        "ygap": 2,
        "opacity": 0.8,
        "text": [[_cell_text(one, measure) if show else "" for one in line] for line in found],
        "texttemplate": "%{text}",
        "textfont": {"color": "#111", "size": 12},  # also on a dark screen: cells are coloured
        "hovertext": [_hovers(line, measure, own) for line, own in zip(table, found)],
        "hovertemplate": "%{hovertext}<extra></extra>",
        "hoverongaps": False,
    }
    title = plot_text(first.rpartition("/")[2]) if is_left else ""
    y = axis(title, type="category", showticklabels=is_left)
    return [trace], axis("", type="category", showgrid=False), {**y, "showgrid": False}


def _cell_text(found: Estimate, measure: Measure) -> str:
    if found.value is None:
        return "–"
    text = f"<b>{found.value:.{measure.decimals}f}</b>"
    if found.low is None or found.high is None:
        return text
    return f"{text}<br>{found.low:.{measure.decimals}f}–{found.high:.{measure.decimals}f}"


def _bars(
    rows: Sequence[SweepRow], measure: Measure, is_left: bool
) -> Tuple[List[Json], Json, Json]:
    """Draw a bar from 0 for each point."""
    found = [measure.estimate(row.flights) for row in rows]
    trace = {
        "type": "bar",
        "orientation": "h",
        "y": list(range(len(rows))),
        "x": [one.value for one in found],
        "error_x": _errors(found),
        "width": 0.65,
        "marker": {"color": ALARM if measure.title.startswith("Flights with") else rgb(0)},
        "hovertext": _hovers(rows, measure, found),
        "hovertemplate": "%{hovertext}<extra></extra>",
    }
    y = axis(
        "",
        range=[len(rows) - 0.4, -0.6],
        tickvals=list(range(len(rows))),
        ticktext=[plot_text(point_text(list(row.point.values()))) for row in rows],
        showticklabels=is_left,
        showgrid=False,
    )
    return [trace], _value_axis(measure), y


def _errors(found: Sequence[Estimate]) -> Json:
    """Return the intervals as error bars, none for a measure without intervals."""
    return {
        "type": "data",
        "symmetric": False,
        "array": [above for _, above in map(Estimate.reach, found)],
        "arrayminus": [below for below, _ in map(Estimate.reach, found)],
        "visible": any(one.low is not None for one in found),
        "color": INK,
        "thickness": 1.2,
        "width": 4,
    }


def _hovers(rows: Sequence[SweepRow], measure: Measure, found: Sequence[Estimate]) -> List[str]:
    return [
        "<br>".join(
            [f"{plot_text(path)}: {plot_text(format_value(row.point[path]))}" for path in row.point]
            + [f"<b>{one.text(measure.decimals)}</b>"]
        )
        for row, one in zip(rows, found)
    ]
