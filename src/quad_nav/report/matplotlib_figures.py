"""Draw the figures of a flight with matplotlib, for paper."""

from __future__ import annotations

from typing import Any, Dict, List, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.path import Path
from matplotlib.patheffects import withStroke
from matplotlib.textpath import TextPath

from quad_nav.recording.trace import FlightTrace, RobotTrace
from quad_nav.report.distances import Panel
from quad_nav.report.encounters import LETTERS
from quad_nav.report.marks import Marks
from quad_nav.report.measures import Tracks, goal_end_s, position_m, trace_span_s
from quad_nav.report.paths import FlownPath, PathsMap
from quad_nav.report.scene_drawing import MOVING, draw_hull, draw_motions, draw_scene, outlines
from quad_nav.report.style import (
    ALARM,
    QUIET,
    WIDTH_IN,
    centred_text,
    colour,
    line_style,
    new_figure,
    robot_legend,
    time_axis,
)
from quad_nav.report.timeline import Bar, Bars, Timeline

_FULL_SIZE_UP_TO = 10  # robots; with more, symbols are smaller
_NARROW = 0.02  # shorter bars, in parts of the whole time, have no room for a number
_HALO = [withStroke(linewidth=2.5, foreground="white")]
_SYMBOLS: Dict[str, Dict[str, Any]] = {
    "start": {"marker": "s", "ms": 12, "mew": 1.0},
    "goal": {"marker": "o", "ms": 17, "mew": 1.8},
    "contact": {"marker": "X", "color": ALARM, "mec": "white", "mew": 0.8, "ms": 11, "zorder": 11},
    "recovery": {
        "marker": "v",
        "color": "#e8a33d",
        "mec": "black",
        "mew": 0.6,
        "ms": 8,
        "clip_on": False,
        "zorder": 6,
    },
}


def paths_picture(content: PathsMap) -> Figure:
    """Draw the map of paths; a single flight has hulls, moving obstacles and directions."""
    x0, x1, y0, y1 = content.region
    figure = new_figure((WIDTH_IN - 0.6) * content.height(1.6) + 0.9)
    axes = figure.subplots()
    draw_scene(axes, content.scene)
    axes.set(xlim=(x0, x1), ylim=(y0, y1), xlabel="x (m)", ylabel="y (m)")
    scale = min(1.0, (_FULL_SIZE_UP_TO / content.robots) ** 0.2)
    for path in content.paths:
        x_m, y_m = path.robot.positions_m[:, 0], path.robot.positions_m[:, 1]
        axes.plot(x_m, y_m, zorder=4, **_path_style(path, scale))
    if content.flight is None:
        _draw_marks(axes, [one for one in content.marks if one.kind == "contact"], scale)
        handles = [
            Line2D([], [], label=path.label, **_path_style(path, scale))
            for path in content.paths
            if path.label
        ]
        robot_legend(figure, (), handles, columns=2)
        return figure
    trace, tracks = content.flight
    _draw_flight(axes, trace, tracks, scale)
    _draw_marks(axes, content.marks, scale)
    _draw_letters(axes, [one for one in content.marks if one.kind == "encounter"])
    names = [robot.name for robot in trace.robots]
    robot_legend(figure, names, _map_symbols(content), columns=4, patterns=True)
    return figure


def distance_picture(
    panels: Sequence[Panel], names: Sequence[str], contacts_s: Sequence[float]
) -> Figure:
    """Draw panels of distances, from the top; ``contacts_s`` are the times of contacts."""
    figure = new_figure(0.6 + 2.1 * max(len(panels), 1))
    column = figure.subplots(max(len(panels), 1), 1, sharex=True, squeeze=False)[:, 0]
    for axes, panel in zip(column, panels):
        _draw_panel(axes, panel)
        for time_s in contacts_s:
            axes.axvline(time_s, color=ALARM, lw=0.9, ls="--")
    time_axis(column[-1])
    robot_legend(figure, names)
    return figure


def timeline_picture(content: Timeline) -> Figure:
    """Draw the chart of goals over time."""
    rows, (first_s, last_s) = max(len(content.names), 1), content.span_s
    figure = new_figure(1.0 + 0.5 * min(rows, 8) + 0.32 * max(rows - 8, 0))
    axes = figure.subplots()
    axes.grid(axis="y", visible=False)
    for series in content.series:
        for bar in series.bars:
            _draw_bar(axes, series, bar, last_s - first_s)
    _draw_marks(axes, content.marks)
    axes.set(
        yticks=range(len(content.names)),
        ylim=(rows - 0.4, -0.6),
        yticklabels=content.names,
        xlim=(first_s, last_s),
    )
    axes.tick_params(axis="y", length=0)
    time_axis(axes)
    handles = [_bars_symbol(one) for one in content.series if one.colour or one.is_hatched]
    robot_legend(figure, (), [*handles, *map(_symbol, content.marks)])
    return figure


def _path_style(path: FlownPath, scale: float) -> Dict[str, Any]:
    return {"color": colour(path.number), "ls": line_style(path.number), "lw": 1.7 * scale}


def _draw_flight(axes: Axes, trace: FlightTrace, tracks: Tracks, scale: float) -> None:
    """Draw what only one flight has: directions, moving obstacles, and hulls at the end."""
    draw_motions(axes, trace, trace_span_s(trace))
    for k, robot in enumerate(trace.robots):
        for goal in robot.goals if len(robot.times_s) else ():
            middle_s = 0.5 * (goal.sent_s + goal_end_s(goal, robot))
            _draw_direction(axes, k, robot, middle_s, scale)
        if len(tracks.times_s):
            place_m, yaw_rad = tracks.positions_m[k, -1], tracks.yaws_rad[k, -1]
            draw_hull(axes, k, place_m, yaw_rad, trace.robot_radius_m)


def _draw_direction(
    axes: Axes, number: int, robot: RobotTrace, time_s: float, scale: float
) -> None:
    """Draw an arrowhead on the path at a time, unless the robot stands still."""
    tail, head = position_m(robot, time_s - 0.5), position_m(robot, time_s + 0.5)
    if np.hypot(*(head - tail)) > 0.02:
        axes.annotate(
            "",
            tuple(head),
            tuple(tail),
            zorder=5,
            annotation_clip=True,
            arrowprops={
                "arrowstyle": "-|>",
                "color": colour(number),
                "lw": 0,
                "mutation_scale": 15 * scale,
                "shrinkA": 0,
                "shrinkB": 0,
            },
        )


def _draw_marks(axes: Axes, found: Sequence[Marks], scale: float = 1.0) -> None:
    """Draw marks but letters; ``scale`` is the size of robots' symbols."""
    for marks in found:
        if marks.kind in ("start", "goal"):
            _draw_robot_marks(axes, marks, scale)
        elif marks.kind in _SYMBOLS:
            axes.plot(marks.x, marks.y, ls="", **_SYMBOLS[marks.kind])


def _draw_robot_marks(axes: Axes, marks: Marks, scale: float) -> None:
    style, own = _SYMBOLS[marks.kind], colour(marks.number or 0)
    zorder = 8 if marks.kind == "start" else 9
    filled = marks.filled or [True] * len(marks.x)
    for x_m, y_m, text, is_full in zip(marks.x, marks.y, marks.texts, filled):
        axes.plot(
            x_m,
            y_m,
            style["marker"],
            ms=style["ms"] * scale,
            color=own if is_full else "white",
            mec="white" if marks.kind == "start" else own,
            mew=style["mew"] * scale,
            zorder=zorder,
        )
        ink = "white" if is_full else own
        centred_text(axes, (x_m, y_m), text, 7.5 * scale, ink, zorder=zorder + 1)


def _draw_letters(axes: Axes, found: Sequence[Marks]) -> None:
    """Draw the letters of encounters on a map."""
    for marks in found:
        for x_m, y_m, letter in zip(marks.x, marks.y, marks.texts):
            axes.annotate(
                letter,
                (x_m, y_m),
                (9, 9),
                textcoords="offset points",
                fontsize=10,
                fontweight="bold",
                color=QUIET,
                path_effects=_HALO,
                zorder=12,
                annotation_clip=True,
                arrowprops={"arrowstyle": "-", "color": QUIET, "lw": 0.8, "shrinkB": 0},
            )


def _draw_panel(axes: Axes, panel: Panel) -> None:
    assert panel.least is not None, panel.title
    many, values = panel.is_crowded, [curve.values for curve in panel.curves]
    same = len(values) == 2 and np.array_equal(values[0], values[1], equal_nan=True)
    for k, curve in enumerate(panel.curves):
        axes.plot(
            curve.times_s,
            curve.values,
            color="black" if same else colour(k),
            lw=0.8 if many else 1.4,
            alpha=0.55 if many else 1.0,
        )
    least = panel.least
    if many:
        axes.plot(least.times_s, least.values, color="black", lw=1.3)
    touching = np.where(least.values <= 0.0, 0.0, np.nan)
    axes.plot(least.times_s, touching, color=ALARM, lw=4, solid_capstyle="butt")
    axes.axhspan(-1.0, 0.0, color=ALARM, alpha=0.10, lw=0)
    if panel.close is not None:
        axes.axhline(panel.close, color=QUIET, lw=0.8, ls=":")
    for marks in panel.marks:
        axes.plot(marks.x, marks.y, "o", ms=5, color="none", mec="black", zorder=8)
        for time_s, gap_m, letter in zip(marks.x, marks.y, marks.texts):
            if np.isfinite(time_s):
                axes.annotate(
                    letter,
                    (time_s, gap_m),
                    (5, 8),
                    textcoords="offset points",
                    fontsize=9,
                    fontweight="bold",
                )
    axes.set(
        title=panel.title + (", smallest of all in black" if many else ""),
        ylabel="distance (m)",
        ylim=panel.shown,
    )


def _draw_bar(axes: Axes, series: Bars, bar: Bar, duration_s: float) -> None:
    length_s = bar.end_s - bar.begin_s
    if bar.number is None:
        axes.barh(bar.y, length_s, series.height, bar.begin_s, color=series.colour)
        return
    own = colour(bar.number)
    axes.barh(
        bar.y,
        length_s,
        series.height,
        bar.begin_s,
        facecolor=(*own, 0.5 if bar.is_pale else 0.85),
        edgecolor=ALARM if series.is_failure else "white",
        lw=1.6 if series.is_failure else 0.8,
        hatch="//" if series.is_hatched else None,
    )
    if length_s > _NARROW * duration_s:
        halo = withStroke(linewidth=4, foreground="white" if bar.is_pale else own)
        effects = [halo] if series.is_hatched else []  # keeps the hatching away
        place, ink = (bar.begin_s + length_s / 2, bar.y), "black" if bar.is_pale else "white"
        centred_text(axes, place, bar.text, 8.5, ink, path_effects=effects)


def _bars_symbol(series: Bars) -> Patch:
    """Return the entry of a legend for bars."""
    if series.colour:
        return Patch(color=series.colour, label=series.label)
    edge = ALARM if series.is_failure else "white"
    return Patch(facecolor=QUIET, edgecolor=edge, hatch="//", label=series.label)


def _symbol(marks: Marks) -> Line2D:
    """Return the entry of a legend for marks that have a colour of their own."""
    return Line2D([], [], ls="", label=marks.label, **_SYMBOLS[marks.kind])


def _map_symbols(content: PathsMap) -> List[Line2D]:
    """Return the entries of the legend for what the map of a flight shows."""

    def quiet(marker: Any, label: str, **style: Any) -> Line2D:
        style = {"color": QUIET, "mec": QUIET, "ms": 8, **style}
        return Line2D([], [], ls="", marker=marker, label=label, **style)

    filled = {
        is_full for marks in content.marks if marks.kind == "goal" for is_full in marks.filled
    }
    found = [quiet("s", "start")]
    if True in filled:
        found.append(quiet("o", "goal (robot.number)"))
    if False in filled:
        found.append(quiet("o", "goal not reached", color="white", mew=1.5))
    for marks in content.marks:
        if marks.kind == "encounter":
            found.append(quiet(_letter(LETTERS[0]), marks.label))
        elif marks.kind == "contact":
            found.append(_symbol(marks))
    if content.flight is not None and content.flight[0].movers is not None:
        found.append(quiet("o", "moving obstacle", color=MOVING, alpha=0.7, ms=10))
    if content.scene is not None and outlines(content.scene)[1]:
        label = "not at the flying altitude"
        found.append(Line2D([], [], ls=":", lw=1.0, color=QUIET, label=label))
    return found


def _letter(letter: str) -> Path:
    """Return a letter as a marker; matplotlib's text markers are math text, switched off here."""
    outline = TextPath((0.0, 0.0), letter, prop=FontProperties(weight="bold"))
    middle = outline.get_extents().get_points().mean(axis=0)
    return Path(outline.vertices - middle, outline.codes)
