"""Draw the figures of a flight with plotly.js, for pages."""

from __future__ import annotations

from typing import Any, Dict, List, Optional, Sequence

import numpy as np

from quad_nav.report.distances import Curve, Panel
from quad_nav.report.marks import Hover, Marks
from quad_nav.report.measures import speed_mps
from quad_nav.report.paths import FlownPath, PathsMap
from quad_nav.report.paths_animation import CONTROLS_PX, NARROW_CONTROLS, animation, controls
from quad_nav.report.plot import (
    ALARM,
    INK,
    OUTLINE,
    PAPER,
    QUIET,
    SOLID,
    Json,
    Plot,
    axis,
    dash,
    layout,
    lines,
    numbers,
    plot_text,
    rgb,
    sample,
    smallest_samples,
    symbol_scale,
)
from quad_nav.report.scene_drawing import outlines
from quad_nav.report.timeline import Bars, Timeline
from quad_nav.sim.scene import Scene

_PANEL_PX, _ROW_PX, _ROWS_PX = 210, 30, 110
_PALE = 0.6
_MARKS: Dict[str, Json] = {
    "start": {"symbol": "square", "size": 15},
    "goal": {"symbol": "circle", "size": 24},
    "contact": {
        "symbol": "x",
        "size": 12,
        "color": ALARM,
        "line": {"color": "#fff", "width": 1},
    },
    "encounter": {"symbol": "circle-open", "size": 12, "color": QUIET, "line": {"width": 2}},
    "recovery": {
        "symbol": "triangle-down",
        "size": 10,
        "color": "#e8a33d",
        "line": {"color": "#000", "width": 1},
    },
}
"""Symbol, size in pixels and colour of each kind of mark; a robot's marks have its colour."""


def paths_plot(content: PathsMap) -> Plot:
    """Draw the map of paths; a single flight has an animation."""
    x0, x1, y0, y1 = content.region
    traces = _scene_traces(content.scene)
    for part in content.parts:
        if isinstance(part, FlownPath):
            traces.append(_path_trace(part, len(content.paths)))
        else:
            traces.append(_marks_trace(part, symbol_scale(content.robots)))
    frames: List[Json] = []
    if content.flight is not None:
        frames, moving = animation(*content.flight, len(traces))
        traces += moving
    margins = {"l": 50, "r": 12, "t": 28, "b": 100 if frames else 44}
    below_px = CONTROLS_PX if frames else 44
    return Plot(
        "paths",
        content.alt,
        traces,
        layout(
            xaxis=axis("x (m)", range=[x0, x1], constrain="domain"),
            yaxis=axis("y (m)", range=[y0, y1], scaleanchor="x", constrain="domain"),
            **controls(frames),
            margin=margins,
        ),
        frames,
        150 if frames else 90,
        0.84 * content.height(1.0),
        NARROW_CONTROLS if frames else {},
        40 + below_px,
        below_px,
        content.height(1.6),
    )


def distance_plot(
    panels: Sequence[Panel], names: Sequence[str], contacts_s: Sequence[float]
) -> Plot:
    """Draw panels over common times, from the top; ``contacts_s`` are the times of contacts."""
    traces: List[Json] = []
    axes: Json = {"xaxis": axis("time (s)", anchor=f"y{len(panels)}" if len(panels) > 1 else "y")}
    shapes: List[Json] = []
    titles: List[Json] = []
    height = 1.0 / len(panels)
    for row, panel in enumerate(panels):
        top, number = 1.0 - (row + 0.1) * height, str(row + 1) if row else ""
        name = "distance" if panel.least is not None else panel.quantity
        axes[f"yaxis{number}"] = axis(
            f"{name} ({panel.unit})", domain=[1.0 - (row + 0.84) * height, top]
        )
        if panel.least is not None:
            axes[f"yaxis{number}"]["range"] = panel.shown
        traces += _panel_traces(panel, names, f"y{number}", row == 0)
        shapes += _limits(panel, f"y{number}")
        titles.append(_title(panel.title, top))
    for time_s in contacts_s:
        shapes.append(_line(ALARM, "dash", x0=time_s, x1=time_s, y0=0, y1=1, yref="paper"))
    return Plot(
        "distances",
        "Separation, clearance and speed over time",
        traces,
        layout(**axes, shapes=shapes, annotations=titles),
        height_px=60 + _PANEL_PX * len(panels),
    )


def timeline_plot(content: Timeline) -> Plot:
    """Draw the chart of goals over time."""
    rows = range(len(content.names))
    traces = [_bars_trace(one) for one in content.series]
    traces += [{**_marks_trace(one), "cliponaxis": False} for one in content.marks]
    return Plot(
        "timeline",
        "Goals over time",
        traces,
        layout(
            xaxis=axis("time (s)", range=list(content.span_s)),
            yaxis=axis(
                "",
                range=[len(rows) - 0.4, -0.6],
                tickvals=list(rows),
                ticktext=[plot_text(name) for name in content.names],
                showgrid=False,
            ),
        ),
        height_px=_ROWS_PX + _ROW_PX * max(len(rows), 3),
    )


def _hover_text(hover: Hover) -> str:
    first, *others = map(plot_text, hover)
    return "<br>".join((f"<b>{first}</b>", *others))


def _scene_traces(scene: Optional[Scene]) -> List[Json]:
    """Return a trace of the obstacles and walls, and one of those that robots fly over or under."""
    found = []
    for shapes, name, style in zip(
        outlines(scene) if scene is not None else ((), ()),
        ("obstacle or wall", "below or above<br>the flying altitude"),
        (
            {"fillcolor": SOLID, "line": {"color": OUTLINE, "width": 1}},
            {"fillcolor": "rgba(0,0,0,0)", "line": {"color": OUTLINE, "width": 1, "dash": "dot"}},
        ),
    ):
        if not shapes:
            continue
        gap = np.full((1, 2), np.nan)
        points = np.concatenate([part for shape in shapes for part in (shape, gap)])[:-1]
        more: Json = {"fill": "toself", "name": name, "hoverinfo": "skip", **style}
        found.append(lines(*points.T, **more))
    return found


def _path_trace(path: FlownPath, count: int) -> Json:
    """Return the trace of a path; hovering it shows time, position and speed."""
    robot = path.robot
    shown = sample(len(robot.times_s), count)
    times_s, speeds_mps = numbers(robot.times_s[shown], 2), numbers(speed_mps(robot)[shown], 2)
    return lines(
        *robot.positions_m[shown, :2].T,
        name=plot_text(path.label),
        legendgroup=path.group,
        showlegend=bool(path.label),
        customdata=[list(pair) for pair in zip(times_s, speeds_mps)],
        line={"color": rgb(path.number), "width": 2, "dash": dash(path.number)},
        hovertemplate=f"<b>{plot_text(path.hover)}</b><br>%{{customdata[0]:.1f}} s<br>"
        "(%{x:.2f}, %{y:.2f}) m<br>%{customdata[1]:.2f} m/s<extra></extra>",
    )


def _marks_trace(marks: Marks, scale: float = 1.0, axis_name: str = "y") -> Json:
    """Return a trace of marks; ``scale`` is the size of a robot's symbols."""
    marker = dict(_MARKS[marks.kind])
    colour = INK if marks.number is None else rgb(marks.number)
    font: Json = {"size": 14, "color": INK}
    if "color" not in marker:  # one of a robot
        filled = marks.filled or [True] * len(marks.x)
        font = {
            "size": round(10 * scale**0.7, 1),
            "color": ["#fff" if full else colour for full in filled],
        }
        marker["size"] = round(marker["size"] * scale, 1)
        marker["color"] = [colour if full else PAPER for full in filled]
        marker["line"] = {"color": colour, "width": 2}
    return {
        "type": "scatter",
        "mode": "markers+text" if marks.texts else "markers",
        "name": plot_text(marks.label),
        "showlegend": bool(marks.label),
        **({"legendgroup": marks.group} if marks.group else {}),
        "x": numbers(marks.x),
        "y": numbers(marks.y),
        "yaxis": axis_name,
        "text": [f"<b>{text}</b>" if marks.kind == "encounter" else text for text in marks.texts],
        "textposition": "top right" if marks.kind == "encounter" else "middle center",
        "textfont": font,
        "marker": marker,
        "hovertext": [_hover_text(hover) for hover in marks.hovers],
        "hovertemplate": "%{hovertext}<extra></extra>",
    }


def _panel_traces(panel: Panel, names: Sequence[str], axis_name: str, is_first: bool) -> List[Json]:
    count, place = len(panel.curves), {"showlegend": is_first, "yaxis": axis_name}
    found = []
    for robot, (curve, name) in enumerate(zip(panel.curves, map(plot_text, names))):
        if np.isfinite(curve.values).any():
            width = 1.3 if panel.is_crowded else 2
            found.append(
                _curve(
                    curve,
                    count,
                    panel.least is not None,
                    name=name,
                    legendgroup=f"robot{robot}",
                    opacity=0.75 if panel.is_crowded else 1.0,
                    line={"color": rgb(robot), "width": width, "dash": dash(robot)},
                    hovertemplate=f"<b>{name}</b><br>%{{x:.1f}} s<br>"
                    f"{panel.quantity} %{{y:.2f}} {panel.unit}<extra></extra>",
                    **place,
                )
            )
    if panel.is_crowded and panel.least is not None and np.isfinite(panel.least.values).any():
        style = {"line": {"color": INK, "width": 2}, "hoverinfo": "skip", **place}
        name = "smallest of all"
        found.append(_curve(panel.least, count, True, name=name, legendgroup="smallest", **style))
    return found + [_marks_trace(marks, axis_name=axis_name) for marks in panel.marks]


def _curve(curve: Curve, count: int, is_distance: bool, **more: Any) -> Json:
    """Return the trace of a curve; that of a distance keeps its smallest values."""
    if is_distance:
        shown = smallest_samples(curve.values, count)
    else:
        shown = sample(len(curve.values), count)
    return lines(curve.times_s[shown], curve.values[shown], (2, 3), **more)


def _limits(panel: Panel, axis_name: str) -> List[Json]:
    """Return the area below zero, and the distance from which robots have a close encounter."""
    if panel.least is None:
        return []
    area = {
        "type": "rect",
        "layer": "below",
        "xref": "paper",
        "yref": axis_name,
        "x0": 0,
        "x1": 1,
        "y0": -1,
        "y1": 0,
        "fillcolor": ALARM,
        "opacity": 0.12,
        "line": {"width": 0},
    }
    if panel.close is None:
        return [area]
    place = {"x0": 0, "x1": 1, "xref": "paper", "y0": panel.close, "y1": panel.close}
    return [area, _line(QUIET, "dot", **place, yref=axis_name)]


def _line(colour: str, pattern: str, **place: Any) -> Json:
    style = {"color": colour, "width": 1, "dash": pattern}
    return {"type": "line", "layer": "below", **place, "line": style}


def _title(text: str, top: float) -> Json:
    return {
        "text": f"<b>{text}</b>",
        "showarrow": False,
        "xref": "paper",
        "yref": "paper",
        "x": 0,
        "y": top,
        "xanchor": "left",
        "yanchor": "bottom",
    }


def _bars_trace(series: Bars) -> Json:
    bars = series.bars
    return {
        "type": "bar",
        "orientation": "h",
        "name": series.label,
        "y": numbers([bar.y for bar in bars]),
        "base": numbers([bar.begin_s for bar in bars], 2),
        "x": numbers([bar.end_s - bar.begin_s for bar in bars], 2),
        "width": series.height,
        "text": [bar.text for bar in bars],
        "textposition": "inside",
        "insidetextanchor": "middle",
        "textangle": 0,
        "textfont": {"size": 11, "color": [INK if bar.is_pale else "#fff" for bar in bars]},
        "constraintext": "none",
        "marker": {"color": series.colour} if series.colour else _goal_style(series),
        "hovertext": [_hover_text(bar.hover) for bar in bars],
        "hovertemplate": "%{hovertext}<extra></extra>",
    }


def _goal_style(series: Bars) -> Json:
    colours = [rgb(bar.number or 0, _PALE if bar.is_pale else 1.0) for bar in series.bars]
    return {
        "color": colours,
        "line": {
            "color": ALARM if series.is_failure else PAPER,
            "width": 2 if series.is_failure else 1,
        },
        "pattern": {"shape": "/" if series.is_hatched else "", "fgcolor": colours},
    }
