"""Interactive plot of the paths over the scene, with an animation of the flight."""

from __future__ import annotations

from typing import Any, List, Optional, Sequence

import numpy as np

from quad_nav.recording.trace import FlightTrace, GoalTrace, RobotTrace
from quad_nav.report.encounters import LETTERS, Encounter, separation_text
from quad_nav.report.measures import Tracks, goal_end_s, speed_mps
from quad_nav.report.paths_animation import animation, controls
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
    robot_marks,
    sample,
)
from quad_nav.report.scene_drawing import Extent, extent, outlines
from quad_nav.sim.contacts import Contact
from quad_nav.sim.scene import Scene


def paths_plot(trace: FlightTrace, tracks: Tracks, marked: Sequence[Encounter]) -> Plot:
    """Build the plot; the encounters ``marked`` get the letters A, B, ..."""
    region = extent(trace.scene, tracks)
    traces = scene_traces(trace.scene)
    count = len(trace.robots)
    for k, robot in enumerate(trace.robots):
        traces += _robot_traces(k, robot, count)
    traces += contact_traces(trace.contacts) + _letters(marked)
    first = len(traces)
    frames, moving = animation(trace, tracks, first)
    traces += moving
    return Plot(
        "paths",
        "Paths over the scene",
        traces,
        layout(
            **map_axes(region),
            **controls(frames),
            margin={"l": 50, "r": 12, "t": 28, "b": 100 if frames else 44},
        ),
        frames,
        150 if frames else 90,
        map_aspect(region),
    )


def map_aspect(region: Extent) -> float:
    """Return the height of a plot of the map, in parts of the width of the page."""
    x0, x1, y0, y1 = region
    return 0.84 * min(max((y1 - y0) / (x1 - x0), 0.3), 1.0)


def map_axes(region: Extent) -> Json:
    """Return the axes of a plot of the map, x and y to the same scale."""
    x0, x1, y0, y1 = region
    return {
        "xaxis": axis("x (m)", range=[x0, x1], constrain="domain"),
        "yaxis": axis("y (m)", range=[y0, y1], scaleanchor="x", constrain="domain"),
    }


def scene_traces(scene: Optional[Scene]) -> List[Json]:
    """Return a trace of the obstacles and walls, and one of those that robots fly over or under."""
    found = []
    for shapes, name, style in zip(
        outlines(scene) if scene is not None else ((), ()),
        ("obstacle or wall", "below or above<br>the flying altitude"),
        (
            {"fillcolor": "#b9bfc6", "line": {"color": "#7c858e", "width": 1}},
            {"fillcolor": "rgba(0,0,0,0)", "line": {"color": "#7c858e", "width": 1, "dash": "dot"}},
        ),
    ):
        if not shapes:
            continue
        gap = np.full((1, 2), np.nan)
        points = np.concatenate([part for shape in shapes for part in (shape, gap)])[:-1]
        found.append(
            {
                "type": "scatter",
                "mode": "lines",
                "fill": "toself",
                "name": name,
                "x": numbers(points[:, 0]),
                "y": numbers(points[:, 1]),
                "hoverinfo": "skip",
                **style,
            }
        )
    return found


def path_trace(number: int, robot: RobotTrace, lines: int, label: str, **more: Any) -> Json:
    """Return the trace of a robot's path; hovering it shows time, position and speed.

    Args:
        number: Number of the colour and line pattern.
        robot: Robot with at least one sample.
        lines: Number of lines in the plot.
        label: Name in the legend and while hovering.
        more: Further keys of plotly.js.
    """
    shown = sample(len(robot.times_s), lines)
    speeds = speed_mps(robot)[shown]
    return {
        "type": "scatter",
        "mode": "lines",
        "name": plot_text(label),
        "x": numbers(robot.positions_m[shown, 0]),
        "y": numbers(robot.positions_m[shown, 1]),
        "customdata": [
            list(pair) for pair in zip(numbers(robot.times_s[shown], 2), numbers(speeds, 2))
        ],
        "line": {"color": rgb(number), "width": 2, "dash": dash(number)},
        "hovertemplate": f"<b>{plot_text(label)}</b><br>%{{customdata[0]:.1f}} s<br>"
        "(%{x:.2f}, %{y:.2f}) m<br>%{customdata[1]:.2f} m/s<extra></extra>",
        **more,
    }


def _robot_traces(number: int, robot: RobotTrace, count: int) -> List[Json]:
    if len(robot.times_s) == 0:
        return []
    group = {"legendgroup": f"robot{number}"}
    found = [path_trace(number, robot, count, robot.name, **group)]
    found.append(
        {
            **robot_marks(number, robot.positions_m[:1, :2], [str(number)], "square", 15, count),
            **group,
            "hovertemplate": f"<b>{plot_text(robot.name)}</b><br>start<extra></extra>",
        }
    )
    places = {(goal.index, goal.pose.x_m, goal.pose.y_m): goal for goal in robot.goals}
    if places:
        goals = list(places.values())
        marks = robot_marks(
            number,
            np.array([(goal.pose.x_m, goal.pose.y_m) for goal in goals]),
            [f"{number}.{goal.index + 1}" for goal in goals],
            "circle",
            24,
            count,
        )
        reached = [goal.reached for goal in goals]
        marks["marker"]["color"] = [rgb(number) if good else "#fff" for good in reached]
        marks["textfont"]["color"] = ["#fff" if good else rgb(number) for good in reached]
        found.append(
            {
                **marks,
                **group,
                "customdata": [_goal_text(goal, robot) for goal in goals],
                "hovertemplate": f"<b>{plot_text(robot.name)}</b>, goal %{{text}}<br>"
                "(%{x:.2f}, %{y:.2f}) m<br>%{customdata}<extra></extra>",
            }
        )
    return found


def _goal_text(goal: GoalTrace, robot: RobotTrace) -> str:
    spent = f"{goal_end_s(goal, robot) - goal.sent_s:.1f} s"
    if goal.reached:
        error = goal.yaw_error_rad
        return f"reached in {spent}" + (f", yaw error {error:.2f} rad" if error is not None else "")
    return f"{plot_text(goal.reason or 'not ended')} after {spent}"


def contact_traces(contacts: Sequence[Contact]) -> List[Json]:
    """Return a trace with a cross for each contact, or none."""
    if not contacts:
        return []
    return [
        {
            "type": "scatter",
            "mode": "markers",
            "name": "contact",
            "x": numbers([contact.x_m for contact in contacts]),
            "y": numbers([contact.y_m for contact in contacts]),
            "text": [
                f"{plot_text(contact.robot)} touches {plot_text(contact.other)}<br>"
                f"{contact.time_s:.1f} s"
                for contact in contacts
            ],
            "hovertemplate": "%{text}<br>(%{x:.2f}, %{y:.2f}) m<extra></extra>",
            "marker": {
                "symbol": "x",
                "size": 12,
                "color": ALARM,
                "line": {"color": "#fff", "width": 1},
            },
        }
    ]


def _letters(marked: Sequence[Encounter]) -> List[Json]:
    if not marked:
        return []
    return [
        {
            "type": "scatter",
            "mode": "markers+text",
            "name": "close encounter",
            "x": numbers([encounter.x_m for encounter in marked]),
            "y": numbers([encounter.y_m for encounter in marked]),
            "text": [f"<b>{letter}</b>" for letter, _ in zip(LETTERS, marked)],
            "textposition": "top right",
            "textfont": {"size": 14, "color": "#20262c"},
            "marker": {"symbol": "circle-open", "size": 12, "color": QUIET, "line": {"width": 2}},
            "customdata": [_encounter_text(encounter) for encounter in marked],
            "hovertemplate": "%{text}: %{customdata}<extra></extra>",
        }
    ]


def _encounter_text(encounter: Encounter) -> str:
    names = " and ".join(map(plot_text, encounter.names))
    return f"{names}<br>{separation_text(encounter.separation_m)} at {encounter.time_s:.1f} s"
