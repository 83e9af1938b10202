"""Progress bars on stderr, shown only if that is a terminal."""

from __future__ import annotations

import time
from typing import Optional

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TaskID,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from quad_nav.mission.sequencer import Action, GoalEnded
from quad_nav.offline.flight import Flight, FlightObserver

_PERIOD_S = 0.1  # wall time between two updates

_STARTING = "starting (the first flight after an installation compiles kernels for 30 s)"


def flights_progress(quiet: bool) -> Progress:
    """Create a bar for many flights, with the time left.

    A task has a description, and a field ``status`` with text behind the count. Start the bar
    with the first completed flight: before that, the workers' libraries may print messages.
    """
    console = Console(stderr=True)
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(bar_width=24),
        MofNCompleteColumn(),
        TextColumn("{task.fields[status]}"),
        TimeRemainingColumn(elapsed_when_finished=True),
        TextColumn("left"),
        console=console,
        transient=True,
        speed_estimate_period=300.0,
        disable=quiet or not console.is_terminal,
    )


class ProgressBar(FlightObserver):
    """Shows the goals, the simulated time and the speed of a flight."""

    def __init__(self) -> None:
        console = Console(stderr=True)
        self._progress = Progress(
            TextColumn("goals"),
            BarColumn(),
            TextColumn("{task.completed:.0f}/{task.total:.0f}"),
            TextColumn("{task.fields[sim]}"),
            TimeElapsedColumn(),
            console=console,
            auto_refresh=False,
            transient=True,
            disable=not console.is_terminal,
        )
        self._task: Optional[TaskID] = None
        self._ended = 0
        self._start_s = self._shown_s = 0.0

    def on_start(self, flight: Flight) -> None:
        """Show the bar."""
        self._start_s = time.monotonic()
        goals = sum(len(robot.sequencer.sequence.goals) for robot in flight.robots)
        self._task = self._progress.add_task("", total=goals, sim=_STARTING)
        self._progress.start()
        self._progress.refresh()

    def on_action(self, robot: int, now_s: float, action: Action) -> None:
        """Count goals that ended."""
        self._ended += isinstance(action, GoalEnded)

    def on_move(self, flight: Flight) -> None:
        """Update the bar ten times a second."""
        wall_s = time.monotonic()
        if wall_s - self._shown_s < _PERIOD_S:
            return
        self._shown_s = wall_s
        assert self._task is not None
        speed = flight.now_s / max(wall_s - self._start_s, 1e-3)
        self._progress.update(
            self._task,
            completed=self._ended,
            refresh=True,
            sim=f"{flight.now_s:.1f} s simulated, {speed:.0f}x real time",
        )

    def on_end(self, flight: Flight) -> None:
        """Hide the bar."""
        self._progress.stop()
