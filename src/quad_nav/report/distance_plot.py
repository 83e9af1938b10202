"""Interactive plot of separations, clearances and speeds over time."""

from __future__ import annotations

from typing import Any, List, NamedTuple, Sequence

import numpy as np
from numpy.typing import NDArray

from quad_nav.recording.trace import FlightTrace
from quad_nav.report.distance_picture import SHOWN_M, shown_gaps, smallest_of_all
from quad_nav.report.encounters import CLOSE_M, LETTERS, Encounter
from quad_nav.report.measures import Tracks, speed_mps
from quad_nav.report.plot import (
    ALARM,
    QUIET,
    Json,
    Plot,
    axis,
    dash,
    layout,
    numbers,
    plot_text,
    rgb,
    sample,
    smallest_samples,
)

_PANEL_PX = 210
_FEW = 4  # more lines cannot be followed one by one


class _Curve(NamedTuple):
    robot: int
    times_s: NDArray[np.float64]
    values: NDArray[np.float64]


class _Panel(NamedTuple):
    title: str
    quantity: str
    unit: str
    curves: Sequence[_Curve]
    smallest: Any = None  # smallest value at each time, where that counts


def distance_plot(trace: FlightTrace, tracks: Tracks, marked: Sequence[Encounter] = ()) -> Plot:
    """Build a panel for each measured distance and one for the speeds, with common times."""
    panels = _panels(trace, tracks)
    traces: List[Json] = []
    axes: Json = {"xaxis": axis("time (s)", anchor=f"y{len(panels)}" if len(panels) > 1 else "y")}
    shapes: List[Json] = []
    height = 1.0 / len(panels)
    titles = []
    for row, panel in enumerate(panels):
        top = 1.0 - row * height
        number = str(row + 1) if row else ""
        name = f"y{number}"
        axes[f"yaxis{number}"] = axis(panel.unit, domain=[top - 0.84 * height, top - 0.1 * height])
        traces += _curves(trace, panel, name, row == 0)
        titles.append(_title(panel, top - 0.1 * height))
        if panel.smallest is not None:
            axes[f"yaxis{number}"]["range"] = _range(panel)
            shapes += _limits(name)
    shapes += [
        _line(
            x0=contact.time_s, x1=contact.time_s, y0=0, y1=1, yref="paper", color=ALARM, kind="dash"
        )
        for contact in trace.contacts
    ]
    if len(trace.robots) > 1:
        traces += _letters(marked)
    return Plot(
        "distances",
        "Separation, clearance and speed over time",
        traces,
        layout(**axes, shapes=shapes, annotations=titles),
        height_px=60 + _PANEL_PX * len(panels),
    )


def _panels(trace: FlightTrace, tracks: Tracks) -> List[_Panel]:
    panels = [
        _Panel(
            title,
            title.split()[0].lower(),
            "distance (m)",
            [_Curve(k, tracks.times_s, gap_m) for k, gap_m in enumerate(gaps_m)],
            smallest_of_all(gaps_m),
        )
        for title, gaps_m in shown_gaps(trace, tracks)
    ]
    speeds = [_Curve(k, robot.times_s, speed_mps(robot)) for k, robot in enumerate(trace.robots)]
    return [*panels, _Panel("Speed", "speed", "speed (m/s)", speeds)]


def _curves(trace: FlightTrace, panel: _Panel, name: str, first: bool) -> List[Json]:
    count = len(panel.curves)
    many = count > _FEW
    found = []
    for robot, times_s, values in panel.curves:
        if not np.isfinite(values).any():
            continue
        is_gap = panel.smallest is not None
        shown = smallest_samples(values, count) if is_gap else sample(len(values), count)
        label = plot_text(trace.robots[robot].name)
        unit = "m" if is_gap else "m/s"
        found.append(
            {
                "type": "scatter",
                "mode": "lines",
                "name": label,
                "legendgroup": f"robot{robot}",
                "showlegend": first,
                "x": numbers(times_s[shown], 2),
                "y": numbers(values[shown]),
                "yaxis": name,
                "opacity": 0.75 if many else 1.0,
                "line": {"color": rgb(robot), "width": 1.3 if many else 2, "dash": dash(robot)},
                "hovertemplate": f"<b>{label}</b><br>%{{x:.1f}} s<br>"
                f"{panel.quantity} %{{y:.2f}} {unit}<extra></extra>",
            }
        )
    if many and panel.smallest is not None and np.isfinite(panel.smallest).any():
        found.append(_smallest(panel, name, first))
    return found


def _smallest(panel: _Panel, name: str, first: bool) -> Json:
    shown = smallest_samples(panel.smallest, len(panel.curves))
    return {
        "type": "scatter",
        "mode": "lines",
        "name": "smallest of all",
        "legendgroup": "smallest",
        "showlegend": first,
        "x": numbers(panel.curves[0].times_s[shown], 2),
        "y": numbers(panel.smallest[shown]),
        "yaxis": name,
        "line": {"color": "#000", "width": 2},
        "hoverinfo": "skip",
    }


def _range(panel: _Panel) -> List[float]:
    known = panel.smallest[np.isfinite(panel.smallest)]
    return [min(-0.1, float(known.min()) - 0.05) if len(known) else -0.1, SHOWN_M]


def _limits(name: str) -> List[Json]:
    """Return the area below zero, and the distance from which robots have a close encounter."""
    area = {
        "type": "rect",
        "layer": "below",
        "xref": "paper",
        "yref": name,
        "x0": 0,
        "x1": 1,
        "y0": -1,
        "y1": 0,
        "fillcolor": ALARM,
        "opacity": 0.12,
        "line": {"width": 0},
    }
    if name != "y":
        return [area]
    return [area, _line(x0=0, x1=1, xref="paper", y0=CLOSE_M, y1=CLOSE_M, yref=name)]


def _line(color: str = QUIET, kind: str = "dot", **place: Any) -> Json:
    return {
        "type": "line",
        "layer": "below",
        **place,
        "line": {"color": color, "width": 1, "dash": kind},
    }


def _title(panel: _Panel, top: float) -> Json:
    return {
        "text": f"<b>{panel.title}</b>",
        "showarrow": False,
        "xref": "paper",
        "yref": "paper",
        "x": 0,
        "y": top,
        "xanchor": "left",
        "yanchor": "bottom",
    }


def _letters(marked: Sequence[Encounter]) -> List[Json]:
    pairs = [
        (letter, encounter)
        for letter, encounter in zip(LETTERS, marked)
        if encounter.other is not None
    ]
    if not pairs:
        return []
    return [
        {
            "type": "scatter",
            "mode": "markers+text",
            "name": "close encounter",
            "x": numbers([encounter.time_s for _, encounter in pairs], 2),
            "y": numbers([encounter.separation_m for _, encounter in pairs]),
            "yaxis": "y",
            "text": [f"<b>{letter}</b>" for letter, _ in pairs],
            "textposition": "top right",
            "marker": {"symbol": "circle-open", "size": 8, "color": "#000"},
            "customdata": [" and ".join(map(plot_text, one.names)) for _, one in pairs],
            "hovertemplate": "%{text}: %{customdata}<br>%{x:.1f} s, gap %{y:.2f} m<extra></extra>",
        }
    ]
