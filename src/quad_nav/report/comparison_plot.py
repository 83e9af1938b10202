"""Interactive plot of the paths of several flights over one scene."""

from __future__ import annotations

from typing import Dict, List, Sequence, Tuple

import numpy as np

from quad_nav.recording.trace import RobotTrace
from quad_nav.report.compared_flight import ComparedFlight
from quad_nav.report.flight_metrics import FlightMetrics
from quad_nav.report.paths_plot import (
    contact_traces,
    map_aspect,
    map_axes,
    path_trace,
    scene_traces,
)
from quad_nav.report.plot import INK, Json, Plot, layout, numbers, plot_text, rgb
from quad_nav.report.scene_drawing import Extent, scene_extent

MOST_OVERLAID = 40
"""Number of flights whose paths are shown."""


def overlay_plot(flights: Sequence[ComparedFlight], metrics: Sequence[FlightMetrics]) -> Plot:
    """Build the plot.

    Args:
        flights: Flights with their paths.
        metrics: Their metrics, with labels.
    """
    lines = sum(len(flight.robots) for flight in flights)
    scene = flights[0].scene
    traces = scene_traces(scene)
    for number, (flight, flown) in enumerate(zip(flights, metrics)):
        label = flight_label(number, flown)
        traces += _paths(number, flight, label, lines)
        for one in contact_traces(flight.contacts):
            first = not any(other["name"] == one["name"] for other in traces if "name" in other)
            traces.append({**one, "legendgroup": f"flight{number}", "showlegend": first})
    traces += _goals(flights)
    region = paths_extent(flights)
    return Plot(
        "paths",
        "Paths of all flights over the scene",
        traces,
        layout(**map_axes(region)),
        height_px=90,
        aspect=map_aspect(region),
    )


def flight_label(number: int, flight: FlightMetrics) -> str:
    """Return the name of a flight in legends: its number, from 1, and its file."""
    return f"{number + 1}: {flight.title}"


def paths_extent(flights: Sequence[ComparedFlight]) -> Extent:
    """Return (x from, x to, y from, y to) of the first scene, or without one of the paths."""
    places = [robot.positions_m[:, :2] for flight in flights for robot in flight.robots]
    return scene_extent(flights[0].scene, np.concatenate(places or [np.empty((0, 2))]))


def _paths(number: int, flight: ComparedFlight, label: str, lines: int) -> List[Json]:
    group = {"legendgroup": f"flight{number}"}
    found: List[Json] = []
    for robot in flight.robots:
        if len(robot.times_s):
            hover = f"{label}, {robot.name}"
            found.append(
                {
                    **path_trace(number, robot, lines, hover),
                    **group,
                    "name": plot_text(label),
                    "showlegend": not found,
                }
            )
    starts = [(k, robot) for k, robot in enumerate(flight.robots) if len(robot.times_s)]
    if starts:
        found.append({**_starts(number, starts), **group})
    return found


def _starts(number: int, starts: Sequence[Tuple[int, RobotTrace]]) -> Json:
    return {
        "type": "scatter",
        "mode": "markers+text",
        "x": numbers([robot.positions_m[0, 0] for _, robot in starts]),
        "y": numbers([robot.positions_m[0, 1] for _, robot in starts]),
        "text": [str(k) for k, _ in starts],
        "textfont": {"size": 10, "color": "#fff"},
        "marker": {"symbol": "square", "size": 15, "color": rgb(number)},
        "hovertext": [plot_text(robot.name) for _, robot in starts],
        "hovertemplate": "<b>%{hovertext}</b>, start<extra></extra>",
        "showlegend": False,
    }


def _goals(flights: Sequence[ComparedFlight]) -> List[Json]:
    """Return the goals of all flights, each place once."""
    places: Dict[Tuple[str, float, float], None] = {
        (f"{k}.{goal.index + 1}", goal.pose.x_m, goal.pose.y_m): None
        for flight in flights
        for k, robot in enumerate(flight.robots)
        for goal in robot.goals
    }
    if not places:
        return []
    return [
        {
            "type": "scatter",
            "mode": "markers+text",
            "name": "goal",
            "x": numbers([x_m for _, x_m, _ in places]),
            "y": numbers([y_m for _, _, y_m in places]),
            "text": [text for text, _, _ in places],
            "textfont": {"size": 10, "color": INK},
            "marker": {
                "symbol": "circle",
                "size": 24,
                "color": "#fff",
                "line": {"color": INK, "width": 1.5},
            },
            "hovertemplate": "goal %{text}<br>(%{x:.2f}, %{y:.2f}) m<extra></extra>",
        }
    ]
