"""Progress bars on stderr, shown only if that is a terminal."""

from __future__ import annotations

import contextlib
import time
from typing import Callable, Iterable, Iterator, Optional

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TaskID,
    TextColumn,
    TimeElapsedColumn,
)

from quad_nav.cli.options import echo
from quad_nav.config import Configuration
from quad_nav.files.kernel_cache import COMPILING, announced
from quad_nav.mission.actions import Action, GoalEnded
from quad_nav.offline.flight import Flight, FlightObserver
from quad_nav.scenario.warm_up import distinct, simulate, warm_up

_PERIOD_S = 0.1  # wall time between two updates
_SURE_AFTER_S = 10.0


def compile_kernels(configurations: Iterable[Configuration], quiet: bool) -> None:
    """Compile the kernels of flights before their clocks start, with a clock of its own.

    Raises:
        PluginError: A plugin has a mistake.
    """
    with contextlib.ExitStack() as shown:

        def announce() -> None:
            if not quiet:
                echo(COMPILING, err=True)
                shown.enter_context(clock("compiling", quiet))

        with announced(announce):
            simulate()
            for configuration in distinct(configurations):
                warm_up(configuration)


@contextlib.contextmanager
def clock(text: str, quiet: bool) -> Iterator[None]:
    """Show what is done inside, and for how long already; afterwards nothing of it is left."""
    console = Console(stderr=True)
    columns = (TextColumn(text), TimeElapsedColumn())
    hidden = quiet or not console.is_terminal
    with Progress(*columns, console=console, transient=True, disable=hidden) as shown:
        shown.add_task("")
        yield


def flights_progress(quiet: bool) -> Progress:
    """Create a bar for many flights.

    A task has a description, and a field ``status`` with text behind the count, which ends with the
    time left; rich's own estimate counts flights that were stored earlier as fast. Start the bar
    with the first completed flight: before that, the workers' libraries may print messages.
    """
    console = Console(stderr=True)
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(bar_width=24),
        MofNCompleteColumn(),
        TextColumn("{task.fields[status]}"),
        console=console,
        transient=True,
        disable=quiet or not console.is_terminal,
    )


class FlightPace:
    """Time that flights take, measured from those that ended, so many ``processes`` at a time.

    The first flight of each process does not count once others have ended: it also starts the
    process and loads libraries.
    """

    def __init__(self, processes: int, clock: Callable[[], float] = time.monotonic) -> None:
        self._processes = processes
        self._clock = clock
        self._first_s = self._last_s = 0.0
        self.start()

    def start(self) -> None:
        """Start the clock."""
        self._start_s = self._clock()
        self.flights = 0

    def on_flight(self) -> None:
        """Count a flight that ended now."""
        self.flights += 1
        self._last_s = self._clock()
        if self.flights <= self._processes:
            self._first_s = self._last_s

    @property
    def wall_time_s(self) -> float:
        """Time since the start."""
        return self._clock() - self._start_s

    @property
    def per_minute(self) -> float:
        """Rate of flights since the start."""
        return 60.0 * self.flights / max(self.wall_time_s, 1e-3)

    @property
    def flight_s(self) -> Optional[float]:
        """Time of a flight on one process, None before the first has ended."""
        if not self.flights:
            return None
        count = self.flights - self._processes
        if count > 0:
            return self._processes * (self._last_s - self._first_s) / count
        return self._last_s - self._start_s

    @property
    def is_known(self) -> bool:
        """True after two flights of each process, or ten seconds with at least one."""
        enough = self.flights >= 2 * self._processes
        return enough or (self.flights > 0 and self._last_s - self._start_s >= _SURE_AFTER_S)

    def left_text(self, flights: int) -> str:
        """Describe the time that further flights take: "about 14 minutes"."""
        return duration_text((self.flight_s or 0.0) * flights / self._processes)

    def estimate(self, flights: int) -> str:
        """Describe the time of a flight and of the flights that are left."""
        return f"{self.flight_s or 0.0:.1f} s per flight; {flights} left, {self.left_text(flights)}"


def processes_text(count: int) -> str:
    """Return "1 process" or "2 processes"."""
    return f"{count} process{'es' * (count != 1)}"


def duration_text(seconds: float) -> str:
    """Describe a duration to two digits: "about 14 minutes"."""
    for unit, name in ((3600.0, "hours"), (60.0, "minutes")):
        if seconds >= 2 * unit:
            count = seconds / unit
            return f"about {count:.0f} {name}" if count >= 10 else f"about {count:.1f} {name}"
    return f"about {max(round(seconds), 1)} second{'s' * (seconds >= 1.5)}"


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
        self._task = self._progress.add_task("", total=goals, sim="starting")
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
