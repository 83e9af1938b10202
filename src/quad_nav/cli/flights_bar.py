"""Run the flights of a study or a sweep with a progress bar."""

from __future__ import annotations

import math
import sys
import time
from typing import Callable, TypeVar

from rich.markup import escape

from quad_nav.cli import EXIT_INTERRUPTED
from quad_nav.cli.options import echo, raise_on_signals
from quad_nav.cli.progress import flights_progress
from quad_nav.errors import printable
from quad_nav.files.shipped import config_folder
from quad_nav.scenario.warm_up import simulate, warm_up
from quad_nav.tuning.evaluation import Course, StudyObserver
from quad_nav.tuning.flight_result import FlightResult
from quad_nav.tuning.parameter_files import base_configuration

T = TypeVar("T")


class FlightsBar(StudyObserver):
    """Shows the stage, the flights, their rate and the time left."""

    def __init__(self, quiet: bool) -> None:
        self._progress = flights_progress(quiet)
        self._task = self._progress.add_task("starting", total=0.0, status="")
        self._best = math.inf
        self._candidates = 0
        self._start_s = time.monotonic()
        self._expected = 0
        self.flights = self.cached = self.failed = 0

    def __enter__(self) -> FlightsBar:
        return self

    def __exit__(self, *_: object) -> None:
        self._progress.stop()

    def start(self) -> None:
        """Start the clock of the rate."""
        self._start_s = time.monotonic()

    @property
    def wall_time_s(self) -> float:
        """Time since the start."""
        return time.monotonic() - self._start_s

    @property
    def per_minute(self) -> float:
        """Rate of new flights."""
        return 60.0 * self.flights / max(self.wall_time_s, 1e-3)

    @property
    def text(self) -> str:
        """Summary of the flights."""
        cached = f"; {self.cached} from earlier runs" if self.cached else ""
        return (
            f"{self.flights} flights in {self.wall_time_s:.0f} s, {self.per_minute:.1f} per "
            f"minute{cached}"
        )

    def on_expected(self, flights: int) -> None:
        """Update the number of expected flights."""
        self._expected += flights
        self._progress.update(self._task, total=self._expected)

    def on_stage(self, name: str) -> None:
        """Show the stage."""
        self._progress.update(self._task, description=escape(printable(name)))

    def on_flight(self, flight: FlightResult, cached: bool) -> None:
        """Count a flight."""
        self.cached += cached
        self.flights += not cached
        self.failed += not cached and not flight.succeeded
        self._show()

    def on_candidates(self, candidates: int, best: float) -> None:
        """Show the number of candidates and the lowest cost."""
        self._candidates, self._best = candidates, best
        self._show()

    def on_problem(self, problem: str) -> None:
        """Print a fault that does not end the flights."""
        echo(problem, err=True)

    def _show(self) -> None:
        parts = [f"{self.per_minute:.1f} per minute", f"{self.failed} failed"]
        if self._candidates:
            parts.insert(0, f"{self._candidates} candidates, best cost {self._best:.3f}")
        self._progress.update(
            self._task, completed=self.flights + self.cached, status="; ".join(parts)
        )
        if self.flights:
            self._progress.start()


def run_with_bar(
    course: Course,
    run: Callable[[FlightsBar], T],
    interrupted: Callable[[FlightsBar], str],
    quiet: bool,
) -> T:
    """Compile the kernels, run the flights, and exit with 130 on Ctrl-C.

    Args:
        course: Course whose kernels are compiled once, instead of in every worker.
        run: Runs the flights and reports to the bar.
        interrupted: Returns the message after Ctrl-C.
        quiet: Show neither bar nor summary.
    """
    raise_on_signals()
    with FlightsBar(quiet) as bar:
        try:
            warm_up(base_configuration(config_folder(course.config), course.fixed))
            simulate()
            bar.start()
            result = run(bar)
        except KeyboardInterrupt:
            bar.__exit__()
            echo(f"interrupted; {interrupted(bar)}", err=True)
            sys.exit(EXIT_INTERRUPTED)
    if not quiet:
        echo(bar.text, err=True)
    return result
