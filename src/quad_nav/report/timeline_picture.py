"""Picture of the goals over time, with recoveries, spins and contacts."""

from __future__ import annotations

from typing import Any, List, Tuple

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke

from quad_nav.navigator.tick import State
from quad_nav.recording.trace import FlightTrace, RobotTrace
from quad_nav.report.measures import goal_end_s, spins, trace_span_s
from quad_nav.report.style import ALARM, QUIET, colour, new_figure, robot_legend, time_axis

BAR = 0.52
"""Height of a goal's bar in a row of height 1."""
STRIP = 0.14
"""Height of a strip beside a bar."""
STATE_COLOURS = {State.PLANNING: "#9ec4ee", State.CLEARING: "#e8a33d"}
_SPIN = "#202428"
_RECOVERY: Any = {"marker": "v", "color": "#e8a33d", "mec": "black", "mew": 0.6, "ms": 8}
_CONTACT: Any = {"marker": "X", "color": ALARM, "mec": "white", "mew": 0.7, "ms": 10}
_NARROW = 0.02  # shorter bars, in parts of the whole time, have no room for a number


def timeline_picture(trace: FlightTrace) -> Figure:
    """Draw one row for each robot, the first at the top."""
    rows = max(len(trace.robots), 1)
    figure = new_figure(1.0 + 0.5 * min(rows, 8) + 0.32 * max(rows - 8, 0))
    axes = figure.subplots()
    axes.grid(axis="y", visible=False)
    first_s, last_s = trace_span_s(trace)
    for k, robot in enumerate(trace.robots):
        _draw_goals(axes, k, robot, last_s - first_s)
        _draw_states(axes, k, robot, last_s)
        for begin_s, end in spins(robot):
            axes.barh(k + BAR / 2 + STRIP / 2, end - begin_s, STRIP, begin_s, color=_SPIN)
        for time_s, _ in robot.recoveries:
            axes.plot(time_s, k - BAR / 2 - STRIP, clip_on=False, zorder=6, **_RECOVERY)
        for contact in trace.contacts:
            if robot.name in (contact.robot, contact.other):
                axes.plot(contact.time_s, k, zorder=7, **_CONTACT)
    axes.set(
        yticks=range(len(trace.robots)),
        ylim=(rows - 0.4, -0.6),
        yticklabels=[robot.name for robot in trace.robots],
        xlim=(first_s, last_s),
    )
    axes.tick_params(axis="y", length=0)
    time_axis(axes)
    robot_legend(figure, (), _symbols(trace))
    return figure


def _draw_goals(axes: Axes, row: int, robot: RobotTrace, duration_s: float) -> None:
    for k, goal in enumerate(robot.goals):
        length_s = goal_end_s(goal, robot) - goal.sent_s
        failed = goal.ended_s is not None and not goal.reached
        axes.barh(
            row,
            length_s,
            BAR,
            goal.sent_s,
            facecolor=(*colour(row), 0.85 - 0.35 * (k % 2)),
            edgecolor=ALARM if failed else "white",
            lw=1.6 if failed else 0.8,
            hatch="//" if not goal.reached else None,
        )
        if length_s > _NARROW * duration_s:
            axes.text(
                goal.sent_s + length_s / 2,
                row,
                str(goal.index + 1),
                ha="center",
                va="center_baseline",
                fontsize=8.5,
                fontweight="bold",
                color="white" if k % 2 == 0 else "black",
                clip_on=True,
                path_effects=[] if goal.reached else _halo(row, k),
            )


def _halo(row: int, k: int) -> List[Any]:
    """Return an effect that keeps the hatching away from a number."""
    return [withStroke(linewidth=4, foreground=colour(row) if k % 2 == 0 else "white")]


def _draw_states(axes: Axes, row: int, robot: RobotTrace, last_s: float) -> None:
    """Draw a strip above the bar while the navigator plans without moving or recovers."""
    for time_s, state, until_s in periods(robot, last_s):
        if state in STATE_COLOURS:
            axes.barh(
                row - BAR / 2 - STRIP / 2,
                until_s - time_s,
                STRIP,
                time_s,
                color=STATE_COLOURS[state],
            )


def periods(robot: RobotTrace, last_s: float) -> List[Tuple[float, State, float]]:
    """Return (begin, state, end) of each period between two changes of state."""
    ends = [*(time_s for time_s, _ in robot.states[1:]), last_s]
    return [(time_s, state, end) for (time_s, state), end in zip(robot.states, ends)]


def _symbols(trace: FlightTrace) -> List[Any]:
    """Return legend entries for what the picture shows."""
    robots = trace.robots
    found: List[Any] = []
    goals = [goal for robot in robots for goal in robot.goals]
    if any(goal.ended_s is None for goal in goals):
        found.append(Patch(facecolor=QUIET, edgecolor="white", hatch="//", label="not ended"))
    if any(goal.ended_s is not None and not goal.reached for goal in goals):
        found.append(Patch(facecolor=QUIET, edgecolor=ALARM, hatch="//", label="not reached"))
    if any(spins(robot) for robot in robots):
        found.append(Patch(color=_SPIN, label="turns in place"))
    if any(state is State.PLANNING for robot in robots for _, state in robot.states):
        found.append(Patch(color=STATE_COLOURS[State.PLANNING], label="planning"))
    if any(state is State.CLEARING for robot in robots for _, state in robot.states):
        found.append(Patch(color=STATE_COLOURS[State.CLEARING], label="recovering"))
    if any(robot.recoveries for robot in robots):
        found.append(Line2D([], [], ls="", label="recovery starts", **_RECOVERY))
    if trace.contacts:
        found.append(Line2D([], [], ls="", label="contact", **_CONTACT))
    return found
