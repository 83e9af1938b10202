"""Fly the many flights of a benchmark with a progress bar, and write the results."""

from __future__ import annotations

import json
import sys
import time
from dataclasses import dataclass
from typing import Any, Callable, Generic, Iterator, List, Mapping, Optional, Sequence, TypeVar

from quad_nav.cli import EXIT_INTERRUPTED, EXIT_SUCCESS
from quad_nav.cli.options import echo, echo_lines, raise_on_signals, show_warnings
from quad_nav.cli.outputs import Outputs
from quad_nav.cli.progress import (
    FlightPace,
    compile_kernels,
    flights_progress,
    processes_text,
)
from quad_nav.config import Configuration
from quad_nav.offline.workers import LocalWorkers

R = TypeVar("R")


@dataclass(frozen=True)
class Benchmark(Generic[R]):
    """Many flights.

    Attributes:
        name: Name of the command, for its lines.
        wanted: Number of flights.
        configuration: Configuration whose kernels are compiled once, instead of in every worker.
        fly: Returns the flights as they end, flown by so many workers.
        outcomes: Outcomes that the bar counts.
        outcome: Returns the outcome of a flight.
    """

    name: str
    wanted: int
    configuration: Configuration
    fly: Callable[[int], Iterator[R]]
    outcomes: Sequence[str]
    outcome: Callable[[R], str]


@dataclass(frozen=True)
class Flown(Generic[R]):
    """Flights that ended, in any order, and the wall time of all."""

    runs: Sequence[R]
    interrupted: bool
    wall_time_s: float


def run_benchmark(benchmark: Benchmark[R], processes: Optional[int], quiet: bool) -> Flown[R]:
    """Fly all flights, or those that end before Ctrl-C.

    Raises:
        WorkersLost: Workers died repeatedly.
    """
    workers = min(processes or LocalWorkers().count, benchmark.wanted)
    if not quiet:
        show_warnings(benchmark.configuration.warnings)
        flights = f"{benchmark.wanted} flights on {processes_text(workers)}"
        echo(f"{benchmark.name}: {flights}", err=True)
    bar = _OutcomesBar(benchmark, workers, quiet)
    runs: List[R] = []
    interrupted = False
    start_s = time.monotonic()
    raise_on_signals()
    try:
        with bar:
            compile_kernels([benchmark.configuration], quiet)  # once instead of in every worker
            bar.start()
            start_s = time.monotonic()
            for run in benchmark.fly(workers):
                runs.append(run)
                bar.show(runs)
    except KeyboardInterrupt:
        interrupted = True
    return Flown(runs, interrupted, time.monotonic() - start_s)


def write_results(
    outputs: Outputs, overview: str, figures: Mapping[str, Any], rows: str, quiet: bool
) -> None:
    """Print the overview, and write the figures as JSON and the rows as CSV where wanted."""
    if not quiet:
        echo_lines(overview, err=outputs.use_stdout)
    outputs.write("--json", json.dumps(figures, indent=2, allow_nan=False))
    outputs.write("--csv", rows)


def exit_benchmark(outputs: Outputs, interrupted: bool) -> None:
    """Exit with the status of the benchmark."""
    sys.exit(EXIT_INTERRUPTED if interrupted else outputs.exit_status(EXIT_SUCCESS))


class _OutcomesBar(Generic[R]):
    """Progress bar with counts of outcomes and the rate of flights."""

    def __init__(self, benchmark: Benchmark[R], workers: int, quiet: bool) -> None:
        self._benchmark = benchmark
        self._progress = flights_progress(quiet)
        self._task = self._progress.add_task("flights", total=benchmark.wanted, status="")
        self._pace = FlightPace(workers)
        self._is_announced = quiet

    def __enter__(self) -> _OutcomesBar[R]:
        return self

    def __exit__(self, *_: object) -> None:
        self._progress.stop()

    def start(self) -> None:
        """Start the clock of the rate."""
        self._pace.start()

    def show(self, runs: Sequence[R]) -> None:
        """Count a flight and update the bar."""
        self._pace.on_flight()
        left = self._benchmark.wanted - len(runs)
        found = [self._benchmark.outcome(run) for run in runs]
        parts = [f"{found.count(name)} {name}" for name in self._benchmark.outcomes]
        status = f"{', '.join(parts)}; {self._pace.per_minute:.1f} per minute"
        if self._pace.is_known:
            status += f"; {self._pace.left_text(left)} left"
            if not self._is_announced and left:
                self._is_announced = True
                echo(f"{self._benchmark.name}: {self._pace.estimate(left)}", err=True)
        self._progress.update(self._task, completed=len(runs), status=status)
        self._progress.start()
