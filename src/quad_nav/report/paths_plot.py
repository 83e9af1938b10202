"""Interactive plot of the paths over the scene, with an animation of the flight."""

from __future__ import annotations

from typing import Any, List, Optional, Sequence, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.recording.trace import FlightTrace, GoalTrace, RobotTrace
from quad_nav.report.encounters import LETTERS, Encounter, separation_text
from quad_nav.report.measures import Tracks, goal_end_s, speed_mps
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
)
from quad_nav.report.scene_drawing import Extent, extent, outlines
from quad_nav.sim.contacts import Contact
from quad_nav.sim.scene import Scene

MOST_FRAMES = 200
"""Number of frames of an animation."""
_FRAME_S = 0.1  # shortest time between two frames, in simulated time
_FRAME_MS = 60  # wall time between two frames
_FULL_SIZE_UP_TO = 10  # robots; with more, symbols are smaller


def paths_plot(trace: FlightTrace, tracks: Tracks, marked: Sequence[Encounter]) -> Plot:
    """Build the plot; the encounters ``marked`` get the letters A, B, ..."""
    region = extent(trace.scene, tracks)
    traces = scene_traces(trace.scene)
    count = len(trace.robots)
    for k, robot in enumerate(trace.robots):
        traces += _robot_traces(k, robot, count)
    traces += contact_traces(trace.contacts) + _letters(marked)
    first = len(traces)
    frames, traces_now = _animation(trace, tracks, first)
    traces += traces_now
    return Plot(
        "paths",
        "Paths over the scene",
        traces,
        layout(
            **map_axes(region),
            **_controls(frames),
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
            **_marks(number, robot.positions_m[:1, :2], [str(number)], "square", 15, count),
            **group,
            "hovertemplate": f"<b>{plot_text(robot.name)}</b><br>start<extra></extra>",
        }
    )
    places = {(goal.index, goal.pose.x_m, goal.pose.y_m): goal for goal in robot.goals}
    if places:
        goals = list(places.values())
        marks = _marks(
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


def _marks(
    number: int,
    places_m: NDArray[np.float64],
    texts: Sequence[str],
    symbol: str,
    size: float,
    count: int,
    alpha: float = 1.0,
) -> Json:
    scale = min(1.0, (_FULL_SIZE_UP_TO / count) ** 0.25)
    return {
        "type": "scatter",
        "mode": "markers+text",
        "x": numbers(places_m[:, 0]),
        "y": numbers(places_m[:, 1]),
        "text": list(texts),
        "textfont": {"size": round(10 * scale**0.7, 1), "color": "#fff"},
        "marker": {
            "symbol": symbol,
            "size": round(size * scale, 1),
            "color": rgb(number, alpha),
            "line": {"color": rgb(number), "width": 2},
        },
        "showlegend": False,
    }


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


def _animation(trace: FlightTrace, tracks: Tracks, first: int) -> Tuple[List[Json], List[Json]]:
    """Return frames of the robots' positions, and the traces, from number ``first``, that move."""
    flown = [k for k, robot in enumerate(trace.robots) if len(robot.times_s)]
    if not flown or len(tracks.times_s) < 2:
        return [], []
    begin_s, end_s = tracks.times_s[[0, -1]]
    count = int(min(MOST_FRAMES, max((end_s - begin_s) / _FRAME_S, 1))) + 1
    shown = [tracks.index_at(time_s) for time_s in np.linspace(begin_s, end_s, count)]
    moving = [
        {
            **_marks(
                k, tracks.positions_m[k, -1:], [f"<b>{k}</b>"], "circle", 28, len(flown), 0.25
            ),
            "legendgroup": f"robot{k}",
            "textposition": "top center",
            "textfont": {"size": 13, "color": rgb(k)},
            "hoverinfo": "skip",
        }
        for k in flown
    ]
    indices = list(range(first, first + len(flown)))
    frames = []
    for now in shown:
        x, y = (
            numbers(tracks.positions_m[flown, now, 0]),
            numbers(tracks.positions_m[flown, now, 1]),
        )
        data = [{"x": [x[k]], "y": [y[k]]} for k in range(len(flown))]
        name = f"{tracks.times_s[now]:.1f}"
        frames.append({"name": name, "data": data, "traces": indices})
    return frames, moving


def _controls(frames: Sequence[Json]) -> Json:
    """Return the slider over the frames and the buttons beside it."""
    if not frames:
        return {}
    at_once = {"mode": "immediate", "transition": {"duration": 0}}
    play = {**at_once, "fromcurrent": True, "frame": {"duration": _FRAME_MS, "redraw": False}}
    jump = {**at_once, "frame": {"duration": 0, "redraw": False}}
    place = {"x": 0, "y": 0, "xanchor": "left", "yanchor": "top"}
    buttons = {
        **place,
        "type": "buttons",
        "direction": "right",
        "showactive": False,
        "buttons": [
            {"label": "▶", "method": "animate", "args": [None, play]},
            {"label": "❚❚", "method": "animate", "args": [[None], jump]},
        ],
        "pad": {"t": 58, "r": 8},
        "bgcolor": "#fff",
        "bordercolor": "#a0a8b0",
    }
    return {"updatemenus": [buttons], "sliders": [{**place, **_slider(frames, jump)}]}


def _slider(frames: Sequence[Json], jump: Json) -> Json:
    return {
        "x": 0.2,
        "len": 0.8,
        "pad": {"t": 44},
        "active": len(frames) - 1,
        "steps": [
            {"label": frame["name"], "method": "animate", "args": [[frame["name"]], jump]}
            for frame in frames
        ],
        "currentvalue": {"prefix": "time ", "suffix": " s", "font": {"size": 12}},
        "font": {"size": 11},
        "ticklen": 3,
        "minorticklen": 0,
    }
