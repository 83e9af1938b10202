"""Picture of the paths over the scene, with goals, close encounters and contacts."""

from __future__ import annotations

from typing import Any, List, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.lines import Line2D
from matplotlib.path import Path
from matplotlib.patheffects import withStroke
from matplotlib.textpath import TextPath

from quad_nav.recording.trace import FlightTrace, RobotTrace
from quad_nav.report.encounters import LETTERS, Encounter
from quad_nav.report.measures import Tracks, goal_end_s, position_m, trace_span_s
from quad_nav.report.scene_drawing import (
    MOVING,
    draw_hull,
    draw_motions,
    draw_scene,
    extent,
    outlines,
)
from quad_nav.report.style import (
    ALARM,
    QUIET,
    WIDTH_IN,
    colour,
    line_style,
    new_figure,
    robot_legend,
)

_FULL_SIZE_UP_TO = 10  # robots; with more, symbols are smaller
_HALO = [withStroke(linewidth=2.5, foreground="white")]


def paths_picture(trace: FlightTrace, tracks: Tracks, marked: Sequence[Encounter]) -> Figure:
    """Draw the paths; the encounters ``marked`` get the letters A, B, ..."""
    x0, x1, y0, y1 = extent(trace.scene, tracks)
    height_in = (WIDTH_IN - 0.6) * min(max((y1 - y0) / (x1 - x0), 0.3), 1.6) + 0.9
    figure = new_figure(height_in)
    axes = figure.subplots()
    draw_scene(axes, trace.scene)
    draw_motions(axes, trace, trace_span_s(trace))
    scale = min(1.0, (_FULL_SIZE_UP_TO / max(len(trace.robots), 1)) ** 0.2)
    for k, robot in enumerate(trace.robots):
        _draw_path(axes, k, robot, scale)
        if len(tracks.times_s):
            draw_hull(
                axes, k, tracks.positions_m[k, -1], tracks.yaws_rad[k, -1], trace.robot_radius_m
            )
    for k, robot in enumerate(trace.robots):
        _draw_goals(axes, k, robot, scale)
    for contact in trace.contacts:
        axes.plot(
            contact.x_m, contact.y_m, "X", color=ALARM, mec="white", mew=0.8, ms=11, zorder=11
        )
    for letter, encounter in zip(LETTERS, marked):
        axes.annotate(
            letter,
            (encounter.x_m, encounter.y_m),
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
    axes.set(xlim=(x0, x1), ylim=(y0, y1), xlabel="x (m)", ylabel="y (m)")
    names = [robot.name for robot in trace.robots]
    robot_legend(figure, names, _symbols(trace, bool(marked)), columns=4, patterns=True)
    return figure


def _draw_path(axes: Axes, number: int, robot: RobotTrace, scale: float) -> None:
    if len(robot.times_s) == 0:
        return
    x_m, y_m = robot.positions_m[:, 0], robot.positions_m[:, 1]
    axes.plot(x_m, y_m, color=colour(number), ls=line_style(number), lw=1.7 * scale, zorder=4)
    for goal in robot.goals:
        _draw_direction(axes, number, robot, 0.5 * (goal.sent_s + goal_end_s(goal, robot)), scale)
    axes.plot(x_m[0], y_m[0], "s", ms=12 * scale, color=colour(number), mec="white", zorder=8)
    axes.text(
        x_m[0],
        y_m[0],
        str(number),
        color="white",
        fontsize=7.5 * scale,
        fontweight="bold",
        ha="center",
        va="center_baseline",
        zorder=9,
        clip_on=True,
    )


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


def _draw_goals(axes: Axes, number: int, robot: RobotTrace, scale: float) -> None:
    places = {(goal.index, goal.pose.x_m, goal.pose.y_m): goal for goal in robot.goals}
    for goal in places.values():
        face = colour(number) if goal.reached else "white"
        ink = "white" if goal.reached else colour(number)
        axes.plot(
            goal.pose.x_m,
            goal.pose.y_m,
            "o",
            ms=17 * scale,
            color=face,
            mec=colour(number),
            mew=1.8 * scale,
            zorder=9,
        )
        axes.text(
            goal.pose.x_m,
            goal.pose.y_m,
            f"{number}.{goal.index + 1}",
            color=ink,
            fontsize=7.5 * scale,
            fontweight="bold",
            ha="center",
            va="center_baseline",
            zorder=10,
            clip_on=True,
        )


def _symbols(trace: FlightTrace, lettered: bool) -> List[Any]:
    def symbol(marker: Any, label: str, **style: Any) -> Line2D:
        return Line2D(
            [],
            [],
            ls="",
            marker=marker,
            label=label,
            **{"color": QUIET, "mec": QUIET, "ms": 8, **style},
        )

    goals = [goal for robot in trace.robots for goal in robot.goals]
    found = [symbol("s", "start")]
    if any(goal.reached for goal in goals):
        found.append(symbol("o", "goal (robot.number)"))
    if any(not goal.reached for goal in goals):
        found.append(symbol("o", "goal not reached", color="white", mew=1.5))
    if lettered:
        found.append(symbol(_letter(LETTERS[0]), "close encounter"))
    if trace.contacts:
        found.append(symbol("X", "contact", color=ALARM, mec="white", ms=10))
    if trace.movers is not None:
        found.append(symbol("o", "moving obstacle", color=MOVING, alpha=0.7, ms=10))
    if trace.scene is not None and outlines(trace.scene)[1]:
        label = "not at the flying altitude"
        found.append(Line2D([], [], ls=":", lw=1.0, color=QUIET, label=label))
    return found


def _letter(letter: str) -> Path:
    """Return a letter as a marker; matplotlib's text markers are math text, switched off here."""
    outline = TextPath((0.0, 0.0), letter, prop=FontProperties(weight="bold"))
    middle = outline.get_extents().get_points().mean(axis=0)
    return Path(outline.vertices - middle, outline.codes)
