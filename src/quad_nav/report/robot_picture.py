"""Pictures of each robot over time: its motion, and its control cycles."""

from __future__ import annotations

from typing import List, Sequence, Tuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from quad_nav.recording.trace import FlightTrace, RobotTrace
from quad_nav.report.measures import tilt_rad
from quad_nav.report.style import QUIET, colour, label_log, new_figure, robot_legend, time_axis

_COMMAND = "#202428"


def motion_picture(trace: FlightTrace, shown: Sequence[int]) -> Figure:
    """Draw one row for each robot number in ``shown``."""
    rows = max(len(shown), 1)
    figure = new_figure(0.7 + max(0.95, 1.5 - 0.15 * rows) * rows)
    grid = figure.subplots(rows, 3, sharex=True, sharey="col", squeeze=False)
    for row, number in zip(grid, shown):
        _draw_robot(row, number, trace.robots[number])
    for axes, title in zip(grid[0], ("Forward speed (m/s)", "Turn rate (rad/s)", "Tilt (degrees)")):
        axes.set_title(title)
    for axes in grid[-1]:
        time_axis(axes)
    flown = Line2D([], [], color=QUIET, lw=2, label="flown")
    robot_legend(figure, (), [flown, Line2D([], [], color=_COMMAND, lw=0.8, label="commanded")])
    return figure


def _draw_robot(row: Sequence[Axes], number: int, robot: RobotTrace) -> None:
    for axes, part in ((row[0], 0), (row[1], 2)):
        axes.plot(robot.times_s, robot.velocities[:, part], color=(*colour(number), 0.6), lw=2.4)
        if len(robot.command_times_s):  # each holds until the next one
            values = robot.commands[:, part]
            axes.step(robot.command_times_s, values, where="post", color=_COMMAND, lw=0.7)
    tilts_deg = np.degrees(tilt_rad(robot.quaternions))
    row[2].plot(robot.times_s, tilts_deg, color=colour(number), lw=1.2)
    row[2].set_ylim(bottom=0.0)
    row[0].set_ylabel(robot.name, color=colour(number), fontweight="bold")


_TAIL = 0.001  # smallest part of the cycles that the distribution shows


def cycle_picture(trace: FlightTrace) -> Figure:
    """Draw the wall times of cycles if measured, otherwise the time between cycles."""
    measured = has_wall_times(trace)
    figure = new_figure(3.3)
    left, right = figure.subplots(1, 2, width_ratios=(3, 2), sharey=True)
    for k, robot in enumerate(trace.robots):
        times_s, values_ms = _values(robot, measured)
        left.plot(times_s, values_ms, ".", ms=2.2, color=colour(k), alpha=0.6)
        _draw_distribution(right, k, values_ms)
    _draw_periods((left, right), _periods_ms(trace))
    left.set(
        title="Wall time of each control cycle" if measured else "Time between control cycles",
        ylabel="time (ms)",
    )
    if measured:
        left.set_yscale("log")
        label_log(left.yaxis)
    else:
        left.set_ylim(0.0, 1.1 * left.get_ylim()[1])
    right.set(
        title="Share of cycles that take longer",
        xscale="log",
        xlim=(_TAIL, 1.0),
        xticks=[0.001, 0.01, 0.1, 1.0],
        xticklabels=["0.1 %", "1 %", "10 %", "100 %"],
    )
    right.get_xticklabels()[0].set_horizontalalignment("left")
    time_axis(left)
    robot_legend(figure, [robot.name for robot in trace.robots])
    return figure


def _draw_periods(panels: Sequence[Axes], periods_ms: Sequence[float]) -> None:
    for period_ms in periods_ms:
        for axes in panels:
            axes.axhline(period_ms, color=QUIET, lw=0.9, ls="--")
    if periods_ms:
        panels[-1].annotate(
            "control period",
            (1.0, min(periods_ms)),
            (-2, 3),
            ha="right",
            textcoords="offset points",
            fontsize=8,
            color=QUIET,
            xycoords=("axes fraction", "data"),
        )


def has_wall_times(trace: FlightTrace) -> bool:
    """Return true if the trace has wall times of cycles."""
    return any(len(robot.cycle_walls_s) for robot in trace.robots)


def _values(robot: RobotTrace, measured: bool) -> Tuple[NDArray[np.float64], NDArray[np.float64]]:
    if measured:
        return robot.cycle_times_s[: len(robot.cycle_walls_s)], 1e3 * robot.cycle_walls_s
    return robot.cycle_times_s[1:], 1e3 * np.diff(robot.cycle_times_s)


def _draw_distribution(axes: Axes, number: int, values_ms: NDArray[np.float64]) -> None:
    if len(values_ms):
        above = 1.0 - np.arange(len(values_ms)) / len(values_ms)
        axes.step(above, np.sort(values_ms), color=colour(number), where="pre")


def _periods_ms(trace: FlightTrace) -> List[float]:
    rates: Sequence[float] = [
        robot.parameters["controller_frequency"]
        for robot in trace.robots
        if robot.parameters.get("controller_frequency", 0) > 0
    ]
    return sorted({1e3 / rate for rate in rates})
