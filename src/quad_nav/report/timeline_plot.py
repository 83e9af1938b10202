"""Interactive plot of the goals over time, with recoveries, spins and contacts."""

from __future__ import annotations

from typing import Any, Iterator, List, NamedTuple, Sequence, Tuple

from quad_nav.navigator.tick import State
from quad_nav.recording.trace import FlightTrace, GoalTrace, RobotTrace
from quad_nav.report.measures import goal_end_s, spins, trace_span_s
from quad_nav.report.plot import ALARM, INK, Json, Plot, axis, layout, numbers, plot_text, rgb
from quad_nav.report.timeline_picture import BAR, STATE_COLOURS, STRIP, periods

_SHADES = (1.0, 0.6)  # of neighbouring goals
_ROW_PX, _ROWS_PX = 30, 110


class _Bar(NamedTuple):
    row: float
    begin_s: float
    end_s: float
    colour: str
    hover: str
    label: str = ""


def timeline_plot(trace: FlightTrace) -> Plot:
    """Build the plot: one row for each robot, the first at the top."""
    first_s, last_s = trace_span_s(trace)
    rows = range(len(trace.robots))
    axes = {
        "xaxis": axis("time (s)", range=[first_s, last_s]),
        "yaxis": axis(
            "",
            range=[len(rows) - 0.4, -0.6],
            tickvals=list(rows),
            ticktext=[plot_text(robot.name) for robot in trace.robots],
            showgrid=False,
        ),
    }
    traces = [
        *_goals(trace, "goal reached", lambda goal: goal.reached),
        *_goals(trace, "not reached", _is_failed, "/", ALARM),
        *_goals(trace, "not ended", lambda goal: goal.ended_s is None, "/"),
        *_strips(trace, last_s),
        *_recoveries(trace),
        *_contacts(trace),
    ]
    return Plot(
        "timeline",
        "Goals over time",
        traces,
        layout(**axes),
        height_px=_ROWS_PX + _ROW_PX * max(len(rows), 3),
    )


def _is_failed(goal: GoalTrace) -> bool:
    return goal.ended_s is not None and not goal.reached


def _goals(
    trace: FlightTrace, name: str, is_shown: Any, pattern: str = "", edge: str = "#fff"
) -> List[Json]:
    bars = [
        _Bar(
            row,
            goal.sent_s,
            goal_end_s(goal, robot),
            rgb(row, _SHADES[k % 2]),
            _goal_text(goal, row, robot),
            str(goal.index + 1),
        )
        for row, robot in enumerate(trace.robots)
        for k, goal in enumerate(robot.goals)
        if is_shown(goal)
    ]
    line = {"color": edge, "width": 2 if edge == ALARM else 1}
    return _bars(bars, name, BAR, line=line, pattern={"shape": pattern, "fgcolor": "#fff"})


def _goal_text(goal: GoalTrace, row: int, robot: RobotTrace) -> str:
    end_s = goal_end_s(goal, robot)
    result = "reached" if goal.reached else plot_text(goal.reason or "not ended")
    lap = f", lap {goal.lap}" if goal.lap > 1 else ""
    return (
        f"<b>{plot_text(robot.name)}</b>, goal {row}.{goal.index + 1}{lap}<br>"
        f"{goal.sent_s:.1f} to {end_s:.1f} s ({end_s - goal.sent_s:.1f} s)<br>{result}"
    )


def _strips(trace: FlightTrace, last_s: float) -> List[Json]:
    """Return strips above a bar for states, and below for turning in place."""
    named = {State.PLANNING: "planning", State.CLEARING: "recovering"}
    found: List[Json] = []
    for state, colour in STATE_COLOURS.items():
        bars = [
            _strip(row - (BAR + STRIP) / 2, robot, begin_s, end_s, colour, named[state])
            for row, robot in enumerate(trace.robots)
            for begin_s, shown, end_s in periods(robot, last_s)
            if shown is state
        ]
        found += _bars(bars, named[state], STRIP)
    turns = [
        _strip(row + (BAR + STRIP) / 2, robot, begin_s, end_s, INK, "turns in place")
        for row, robot in enumerate(trace.robots)
        for begin_s, end_s in spins(robot)
    ]
    return found + _bars(turns, "turns in place", STRIP)


def _strip(
    row: float, robot: RobotTrace, begin_s: float, end_s: float, colour: str, what: str
) -> _Bar:
    text = f"<b>{plot_text(robot.name)}</b> {what}<br>{begin_s:.1f} to {end_s:.1f} s"
    return _Bar(row, begin_s, end_s, colour, text)


def _bars(bars: Sequence[_Bar], name: str, width: float, **marker: Any) -> List[Json]:
    if not bars:
        return []
    return [
        {
            "type": "bar",
            "orientation": "h",
            "name": name,
            "y": numbers([bar.row for bar in bars]),
            "base": numbers([bar.begin_s for bar in bars], 2),
            "x": numbers([bar.end_s - bar.begin_s for bar in bars], 2),
            "width": width,
            "text": [bar.label for bar in bars],
            "textposition": "inside",
            "insidetextanchor": "middle",
            "textangle": 0,
            "textfont": {"size": 11},
            "constraintext": "none",
            "marker": {"color": [bar.colour for bar in bars], **marker},
            "hovertext": [bar.hover for bar in bars],
            "hovertemplate": "%{hovertext}<extra></extra>",
        }
    ]


def _recoveries(trace: FlightTrace) -> List[Json]:
    places = (
        (time_s, row - BAR / 2 - STRIP, f"<b>{plot_text(robot.name)}</b>: {plot_text(what)}")
        for row, robot in enumerate(trace.robots)
        for time_s, what in robot.recoveries
    )
    return _marks(places, "recovery starts", "triangle-down", 10, "#e8a33d", "#000")


def _contacts(trace: FlightTrace) -> List[Json]:
    places = (
        (
            contact.time_s,
            row,
            f"{plot_text(contact.robot)} touches {plot_text(contact.other)}",
        )
        for row, robot in enumerate(trace.robots)
        for contact in trace.contacts
        if robot.name in (contact.robot, contact.other)
    )
    return _marks(places, "contact", "x", 11, ALARM, "#fff")


def _marks(
    places: Iterator[Tuple[float, float, str]],
    name: str,
    symbol: str,
    size: float,
    colour: str,
    edge: str,
) -> List[Json]:
    found = list(places)
    if not found:
        return []
    return [
        {
            "type": "scatter",
            "mode": "markers",
            "name": name,
            "x": numbers([time_s for time_s, _, _ in found], 2),
            "y": numbers([row for _, row, _ in found]),
            "text": [text for _, _, text in found],
            "hovertemplate": "%{text}<br>%{x:.1f} s<extra></extra>",
            "cliponaxis": False,
            "marker": {
                "symbol": symbol,
                "size": size,
                "color": colour,
                "line": {"color": edge, "width": 1},
            },
        }
    ]
