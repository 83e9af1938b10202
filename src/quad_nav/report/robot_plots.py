"""Plots of each robot over time: its motion, its localization and its control cycles."""

from __future__ import annotations

import math
from typing import Any, List, Sequence, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.recording.trace import FlightTrace, RobotTrace
from quad_nav.report.measures import tilt_rad, trace_span_s
from quad_nav.report.panels import Panel, panel_plot
from quad_nav.report.plot import (
    INK,
    QUIET,
    Json,
    Plot,
    axis,
    lines,
    numbers,
    plot_text,
    rgb,
    sample,
    smallest_samples,
)

_PANEL_PX, _CYCLES_PX = 120, 260
_MARGIN = 0.05  # of the range of an axis, in parts of the values' range
_LEAST_TOP = 0.01  # m or rad, of an axis of errors
_TAIL = 0.001  # smallest part of the cycles that the distribution shows
_TAIL_POINTS = 200


def motion_plot(trace: FlightTrace, shown: Sequence[int]) -> Plot:
    """Draw one row for each robot number in ``shown``; a column has a common range."""
    rows = [_motion(trace.robots[number], number, row == 0) for row, number in enumerate(shown)]
    panels: List[Panel] = []
    for row, number in zip(rows, shown):
        for column, (quantity, traces) in enumerate(row):
            limits = _limits([one for other in rows for one in other[column][1]])
            name = plot_text(trace.robots[number].name)
            title = f"{name}: {quantity}"
            time = axis("time (s)" if row is rows[-1] else "", range=list(trace_span_s(trace)))
            if panels:
                time["matches"] = "x"  # all show the same period
            panels.append(Panel(title, traces, time, axis("", range=limits)))
    alt = "Speed, turn rate and tilt over time"
    return panel_plot("motion", alt, panels, 3, _PANEL_PX, legend=True)


def _motion(robot: RobotTrace, number: int, is_first: bool) -> List[Tuple[str, List[Json]]]:
    """Return the quantities of a robot, each with its traces."""
    own = {"line": {"color": rgb(number, 0.7), "width": 3}, "legendgroup": "flown", "name": "flown"}
    given = {
        "line": {"color": INK, "width": 1, "shape": "hv"},  # each holds until the next one
        "legendgroup": "commanded",
        "name": "commanded",
    }
    found = []
    for quantity, part in (("forward speed (m/s)", 0), ("turn rate (rad/s)", 2)):
        legend = {"showlegend": is_first and part == 0}
        traces = [_line(robot.times_s, robot.velocities[:, part], **own, **legend)]
        if len(robot.command_times_s):
            traces.append(_line(robot.command_times_s, robot.commands[:, part], **given, **legend))
        found.append((quantity, traces))
    tilts_deg = np.degrees(tilt_rad(robot.quaternions))
    found.append(("tilt (degrees)", [_line(robot.times_s, tilts_deg, **own, showlegend=False)]))
    return found


def _line(times_s: NDArray[np.float64], values: NDArray[np.float64], **more: Any) -> Json:
    shown = sample(len(values), 1)
    return lines(times_s[shown], values[shown], (2, 3), **more)


def _limits(traces: Sequence[Json]) -> List[float]:
    """Return the range of an axis that shows all values, and 0."""
    values = [0.0, *(value for one in traces for value in one["y"] if value is not None)]
    low, high = min(values), max(values)
    margin = _MARGIN * max(high - low, 0.1)
    return [low - margin, high + margin]


def localization_plot(trace: FlightTrace, shown: Sequence[int]) -> Plot:
    """Draw the errors of some robots' believed poses, over twice the standard deviations."""
    columns = [
        [_errors(trace.robots[number], number, part, number == shown[0]) for number in shown]
        for part in (0, 1)
    ]
    tops = [max(top for top, _ in column) for column in columns]
    panels: List[Panel] = []
    for row, number in enumerate(shown):
        for part, quantity in enumerate(("position error (m)", "yaw error (rad)")):
            name = plot_text(trace.robots[number].name)
            time = axis("time (s)" if number == shown[-1] else "", range=list(trace_span_s(trace)))
            if panels:
                time["matches"] = "x"
            up = axis("", range=[0.0, (1.0 + _MARGIN) * tops[part]])
            panels.append(Panel(f"{name}: {quantity}", columns[part][row][1], time, up))
    alt = "Errors of the believed poses over time"
    return panel_plot("localization", alt, panels, 2, _PANEL_PX, legend=True)


def _errors(robot: RobotTrace, number: int, part: int, is_first: bool) -> Tuple[float, List[Json]]:
    """Return where the axis of an error ends, and its traces: 0 is that of the position, 1 yaw.

    The axis shows what most deviations reach, so that a spread at the start hides no error.
    """
    legend = {"showlegend": is_first and part == 0}
    top, traces = _LEAST_TOP, []
    if len(robot.covariances):
        x, y, yaw = robot.covariances[:, [0, 1, 2], [0, 1, 2]].T
        variances = yaw if part else x + y
        believed = 2.0 * np.sqrt(np.where(variances >= 0.0, variances, np.nan))
        known = believed[np.isfinite(believed)]
        top = max(top, float(np.percentile(known, 95)) if len(known) else 0.0)
        line = {"color": rgb(number, 0.35), "width": 1, "shape": "hv"}
        band = {"fill": "tozeroy", "fillcolor": rgb(number, 0.15), "line": line}
        group = {"name": "2σ as believed", "legendgroup": "believed"}
        traces.append(_line(robot.times_s, believed, **band, **group, **legend))
    if len(robot.errors):
        error = robot.errors[:, part]
        worst = smallest_samples(-error, 1)
        line = {"color": rgb(number), "width": 1.5}
        group = {"name": "error", "legendgroup": "error"}
        traces.append(
            lines(robot.times_s[worst], error[worst], (2, 4), line=line, **group, **legend)
        )
        top = max(top, float(error.max()))
    return top, traces


def cycle_plot(trace: FlightTrace) -> Plot:
    """Draw the wall times of cycles if measured, otherwise the time between cycles."""
    measured = has_wall_times(trace)
    times: List[Json] = []
    shares: List[Json] = []
    for number, robot in enumerate(trace.robots):
        times_s, values_ms = _values(robot, measured)
        if not len(values_ms):
            continue
        name = {"name": plot_text(robot.name), "legendgroup": f"robot{number}"}
        shown = smallest_samples(-values_ms, len(trace.robots))  # the slowest ones
        dots = lines(times_s[shown], values_ms[shown], (2, 3), **name, showlegend=False)
        dots.update(mode="markers", marker={"color": rgb(number), "size": 4, "opacity": 0.6})
        times.append(dots)
        shares.append(_distribution(values_ms, line={"color": rgb(number), "width": 2}, **name))
    first_s, last_s = trace_span_s(trace)
    for period_ms in _periods_ms(trace):
        line = {"color": QUIET, "width": 1, "dash": "dash"}
        group: Json = {"name": "control period", "legendgroup": "period", "line": line}
        times.append(lines([first_s, last_s], [period_ms] * 2, **group, showlegend=False))
        shares.append(lines([_TAIL, 1.0], [period_ms] * 2, **group))
    marks = ((0.001, "0.1 %"), (0.01, "1 %"), (0.1, "10 %"), (1.0, "100 %"))
    labels = {"tickvals": [value for value, _ in marks], "ticktext": [text for _, text in marks]}
    share = axis("", type="log", range=[math.log10(_TAIL), 0.0], **labels)
    y = axis("time (ms)", type="log") if measured else axis("time (ms)", rangemode="tozero")
    title = "Wall time of each control cycle" if measured else "Time between control cycles"
    panels = [
        Panel(title, times, axis("time (s)"), y),
        Panel("Share of cycles that take longer", shares, share, {**y, "matches": "y"}),
    ]
    return panel_plot("cycles", "Times of control cycles", panels, 2, _CYCLES_PX, legend=True)


def _distribution(values_ms: NDArray[np.float64], **more: Any) -> Json:
    """Return the line of the shares of values that are larger; denser where they are few."""
    ranks = np.unique(np.geomspace(1, len(values_ms), _TAIL_POINTS).round().astype(np.int64))
    slowest_ms = np.sort(values_ms)[::-1]
    return {
        "type": "scatter",
        "mode": "lines",
        "x": numbers(ranks / len(values_ms), 6),
        "y": numbers(slowest_ms[ranks - 1]),
        **more,
    }


def has_wall_times(trace: FlightTrace) -> bool:
    """Return true if the trace has wall times of cycles."""
    return any(len(robot.cycle_walls_s) for robot in trace.robots)


def _values(robot: RobotTrace, measured: bool) -> Tuple[NDArray[np.float64], NDArray[np.float64]]:
    if measured:
        return robot.cycle_times_s[: len(robot.cycle_walls_s)], 1e3 * robot.cycle_walls_s
    return robot.cycle_times_s[1:], 1e3 * np.diff(robot.cycle_times_s)


def _periods_ms(trace: FlightTrace) -> List[float]:
    rates: Sequence[float] = [
        robot.parameters["controller_frequency"]
        for robot in trace.robots
        if robot.parameters.get("controller_frequency", 0) > 0
    ]
    return sorted({1e3 / rate for rate in rates})
