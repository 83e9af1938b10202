"""The progress of many flights in the terminal."""

from __future__ import annotations

import math
import time

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from quad_nav.tuning.evaluation import Watcher
from quad_nav.tuning.flight_result import FlightResult


class FlightsBar(Watcher):
    """What is done, flights, rate and time left; on stderr, and only where that is a terminal.

    It begins with the first flight that is over: until then the workers' libraries may say
    something of their own.
    """

    def __init__(self, quiet: bool) -> None:
        console = Console(stderr=True)
        self._progress = Progress(
            TextColumn("{task.description}"),
            BarColumn(bar_width=24),
            MofNCompleteColumn(),
            TextColumn("{task.fields[told]}"),
            TimeRemainingColumn(elapsed_when_finished=True),
            TextColumn("left"),
            console=console,
            transient=True,
            speed_estimate_period=300.0,
            disable=quiet or not console.is_terminal,
        )
        self._task = self._progress.add_task("starting", total=0.0, told="")
        self._best = math.inf
        self._candidates = 0
        self._start_s = time.monotonic()
        self._expected = 0
        self.flights = self.kept = self.failed = 0

    def __enter__(self) -> FlightsBar:
        return self

    def __exit__(self, *_: object) -> None:
        self._progress.stop()

    def start(self) -> None:
        """The clock of the rate starts now."""
        self._start_s = time.monotonic()

    @property
    def wall_time_s(self) -> float:
        return time.monotonic() - self._start_s

    @property
    def per_minute(self) -> float:
        """Flights flown now, not those kept from before."""
        return 60.0 * self.flights / max(self.wall_time_s, 1e-3)

    @property
    def words(self) -> str:
        """What was flown, for the end."""
        kept = f"; {self.kept} were there already" if self.kept else ""
        return (
            f"{self.flights} flights in {self.wall_time_s:.0f} s, {self.per_minute:.1f} a "
            f"minute{kept}"
        )

    def expect(self, flights: int) -> None:
        self._expected += flights
        self._progress.update(self._task, total=self._expected)

    def stage(self, name: str) -> None:
        self._progress.update(self._task, description=name)

    def flown(self, flight: FlightResult, kept: bool) -> None:
        self.kept += kept
        self.flights += not kept
        self.failed += not kept and not flight.succeeded
        self._show()

    def told(self, candidates: int, best: float) -> None:
        self._candidates, self._best = candidates, best
        self._show()

    def _show(self) -> None:
        words = [f"{self.per_minute:.1f} a minute", f"{self.failed} failed"]
        if self._candidates:
            words.insert(0, f"{self._candidates} candidates, best {self._best:.3f}")
        self._progress.update(self._task, completed=self.flights + self.kept, told="; ".join(words))
        if self.flights:
            self._progress.start()
