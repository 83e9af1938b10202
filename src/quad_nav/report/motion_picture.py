"""Picture of each robot's speed, turn rate and tilt beside its commands."""

from __future__ import annotations

from typing import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from quad_nav.recording.trace import FlightTrace, RobotTrace
from quad_nav.report.measures import tilt_rad
from quad_nav.report.style import QUIET, colour, new_figure, robot_legend, time_axis

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
    robot_legend(
        figure,
        (),
        [
            Line2D([], [], color=QUIET, lw=2, label="flown"),
            Line2D([], [], color=_COMMAND, lw=0.8, label="commanded"),
        ],
    )
    return figure


def _draw_robot(row: Sequence[Axes], number: int, robot: RobotTrace) -> None:
    for axes, part in ((row[0], 0), (row[1], 2)):
        axes.plot(robot.times_s, robot.velocities[:, part], color=(*colour(number), 0.6), lw=2.4)
        _draw_commands(axes, robot, part)
    row[2].plot(
        robot.times_s, np.degrees(tilt_rad(robot.quaternions)), color=colour(number), lw=1.2
    )
    row[2].set_ylim(bottom=0.0)
    row[0].set_ylabel(robot.name, color=colour(number), fontweight="bold")


def _draw_commands(axes: Axes, robot: RobotTrace, part: int) -> None:
    """Draw the commands as steps: each holds until the next one."""
    if len(robot.command_times_s):
        axes.step(
            robot.command_times_s, robot.commands[:, part], where="post", color=_COMMAND, lw=0.7
        )
