"""Run the flights of a study or a sweep with a progress bar."""

from __future__ import annotations

import math
import sys
from typing import Callable, TypeVar

from rich.markup import escape

from quad_nav.cli import EXIT_INTERRUPTED
from quad_nav.cli.options import echo, raise_on_signals
from quad_nav.cli.progress import FlightPace, compile_kernels, flights_progress
from quad_nav.errors import printable
from quad_tune.courses import Course
from quad_tune.evaluation import StudyObserver
from quad_tune.flight_result import FlightResult
from quad_tune.parameter_files import base_configuration

T = TypeVar("T")


class FlightsBar(StudyObserver):
    """Shows the stage, the flights, their rate and the time left.

    Args:
        command: Name of the command, for its lines.
        processes: Flights at the same time.
        quiet: Show nothing.
    """

    def __init__(self, command: str, processes: int, quiet: bool) -> None:
        self._command, self._quiet = command, quiet
        self._pace = FlightPace(processes)
        self._is_announced = False
        self._progress = flights_progress(quiet)
        self._task = self._progress.add_task("starting", total=0.0, status="")
        self._best = math.inf
        self._candidates = 0
        self._expected = self._stored = 0
        self.flights = self.cached = self.failed = 0

    def __enter__(self) -> FlightsBar:
        return self

    def __exit__(self, *_: object) -> None:
        self._progress.stop()

    def start(self) -> None:
        """Start the clock of the rate."""
        self._pace.start()

    @property
    def text(self) -> str:
        """Summary of the flights."""
        cached = f"; {self.cached} from earlier runs" if self.cached else ""
        return (
            f"{self.flights} flights in {self._pace.wall_time_s:.0f} s, "
            f"{self._pace.per_minute:.1f} per minute{cached}"
        )

    def on_stored(self, flights: int) -> None:
        """Store the number of flights that take no time."""
        self._stored = flights

    def on_remaining(self, flights: int) -> None:
        """Update the number of expected flights."""
        self._expected = self.flights + self.cached + flights
        self._progress.update(self._task, total=self._expected)

    @property
    def left(self) -> int:
        """Estimate of the new flights still to come."""
        return self._expected - self.flights - max(self.cached, self._stored)

    def on_stage(self, name: str) -> None:
        """Show the stage."""
        self._progress.update(self._task, description=escape(printable(name)))

    def on_flight(self, flight: FlightResult, cached: bool) -> None:
        """Count a flight."""
        self.cached += cached
        self.flights += not cached
        self.failed += not cached and not flight.succeeded
        if not cached:
            self._pace.on_flight()
            self._announce()
        self._show()

    def on_candidates(self, candidates: int, best: float) -> None:
        """Show the number of candidates and the lowest cost."""
        self._candidates, self._best = candidates, best
        self._show()

    def on_problem(self, problem: str) -> None:
        """Print a fault that does not end the flights."""
        echo(problem, err=True)

    def _announce(self) -> None:
        """Print the expected time, once it is known."""
        if self._is_announced or not self._pace.is_known or self.left <= 0:
            return
        self._is_announced = True
        if not self._quiet:
            echo(f"{self._command}: {self._pace.estimate(self.left)}", err=True)

    def _show(self) -> None:
        parts = [f"{self._pace.per_minute:.1f} per minute", f"{self.failed} failed"]
        if self._pace.is_known:
            parts.append(f"{self._pace.left_text(max(self.left, 0))} left")
        if self._candidates:
            parts.insert(0, f"{self._candidates} candidates, best cost {self._best:.3f}")
        self._progress.update(
            self._task, completed=self.flights + self.cached, status="; ".join(parts)
        )
        if self.flights:
            self._progress.start()


def run_with_bar(
    command: str,
    processes: int,
    course: Course,
    run: Callable[[FlightsBar], T],
    interrupted: Callable[[FlightsBar], str],
    quiet: bool,
) -> T:
    """Compile the kernels, run the flights, and exit with 130 on Ctrl-C.

    Args:
        command: Name of the command, for the lines that it prints.
        processes: Flights at the same time.
        course: Course whose kernels are compiled once, instead of in every worker.
        run: Runs the flights and reports to the bar.
        interrupted: Returns the message after Ctrl-C.
        quiet: Show neither bar nor summary.
    """
    raise_on_signals()
    with FlightsBar(command, processes, quiet) as bar:
        try:
            compile_kernels([base_configuration(course.config, course.fixed)], quiet)
            bar.start()
            result = run(bar)
        except KeyboardInterrupt:
            bar.__exit__()
            echo(f"interrupted; {interrupted(bar)}", err=True)
            sys.exit(EXIT_INTERRUPTED)
    if not quiet:
        echo(bar.text, err=True)
    return result
