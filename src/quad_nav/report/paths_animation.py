"""Animation of the plot of paths: frames of what moves, and their slider."""

from __future__ import annotations

from typing import List, Sequence, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.recording.trace import FlightTrace
from quad_nav.report.measures import Tracks
from quad_nav.report.plot import EDGE, OUTLINE, PAPER, Json, numbers, rgb, symbol_scale
from quad_nav.report.scene_drawing import MOVING
from quad_nav.sim.obstacles import ROUND_CORNERS

_MOST_FRAMES = 200
_FRAME_S = 0.1  # shortest time between two frames, in simulated time
_FRAME_MS = 60  # wall time between two frames
CONTROLS_PX = 148
"""Height below the plot on a narrow screen: the axis, the buttons and, under them, the slider."""
NARROW_CONTROLS: Json = {
    "updatemenus[0].pad.t": 46,
    "sliders[0].x": 0,
    "sliders[0].len": 1,
    "sliders[0].pad.t": 84,
}
"""Changes of the layout that put the slider below the buttons."""
_FEWEST_CORNERS, _MOST_OUTLINES = 6, 2000  # of circles; of all obstacles, in all frames


def animation(trace: FlightTrace, tracks: Tracks, first: int) -> Tuple[List[Json], List[Json]]:
    """Return frames of robots and moving obstacles, and the traces that move, from ``first`` on."""
    flown = [k for k, robot in enumerate(trace.robots) if len(robot.times_s)]
    if not flown or len(tracks.times_s) < 2:
        return [], []
    begin_s, end_s = tracks.times_s[[0, -1]]
    count = int(min(_MOST_FRAMES, max((end_s - begin_s) / _FRAME_S, 1))) + 1
    shown = [tracks.index_at(time_s) for time_s in np.linspace(begin_s, end_s, count)]
    obstacles = _obstacle_frames(trace, tracks.times_s[shown])
    moving = [*_obstacle_trace(obstacles), *_robot_traces(tracks, flown)]
    indices = list(range(first, first + len(moving)))
    frames = []
    for number, now in enumerate(shown):
        places = tracks.positions_m[flown, now]
        robots = [{"x": numbers(one[:1]), "y": numbers(one[1:])} for one in places]
        data = [*obstacles[number : number + 1], *robots]
        frames.append({"name": f"{tracks.times_s[now]:.1f}", "data": data, "traces": indices})
    return frames, moving


def _obstacle_frames(trace: FlightTrace, times_s: NDArray[np.float64]) -> List[Json]:
    """Return the outlines of the moving obstacles at each time; nothing if there are none."""
    movers = trace.movers
    if movers is None:
        return []
    many = len(movers) * len(times_s) / _MOST_OUTLINES
    corners = max(_FEWEST_CORNERS, int(ROUND_CORNERS / max(many, 1.0)))
    gap = np.full((1, 2), np.nan)
    frames = []
    for time_s in times_s.tolist():
        shapes = [solid.outline_m(corners) for solid in movers.at(time_s)]
        points = np.concatenate([gap, *(part for shape in shapes for part in (shape, gap))])[1:]
        frames.append({"x": numbers(points[:-1, 0], 2), "y": numbers(points[:-1, 1], 2)})
    return frames


def _obstacle_trace(frames: Sequence[Json]) -> List[Json]:
    """Return the trace of the moving obstacles at the end; nothing if there are none."""
    style = {
        "fill": "toself",
        "fillcolor": MOVING,
        "opacity": 0.7,
        "line": {"color": OUTLINE, "width": 1},
        "name": "moving obstacle",
        "hoverinfo": "skip",
    }
    return [{**last, "type": "scatter", "mode": "lines", **style} for last in frames[-1:]]


def _robot_traces(tracks: Tracks, flown: Sequence[int]) -> List[Json]:
    """Return the traces of the robots at the end."""
    size = round(28 * symbol_scale(len(flown)), 1)
    return [
        {
            "type": "scatter",
            "mode": "markers+text",
            "x": numbers(tracks.positions_m[k, -1:, 0]),
            "y": numbers(tracks.positions_m[k, -1:, 1]),
            "text": [f"<b>{k}</b>"],
            "textposition": "top center",
            "textfont": {"size": 13, "color": rgb(k)},
            "marker": {
                "symbol": "circle",
                "size": size,
                "color": rgb(k, 0.25),
                "line": {"color": rgb(k), "width": 2},
            },
            "legendgroup": f"robot{k}",
            "showlegend": False,
            "hoverinfo": "skip",
        }
        for k in flown
    ]


def controls(frames: Sequence[Json]) -> Json:
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
        "bgcolor": PAPER,
        "bordercolor": EDGE,
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
