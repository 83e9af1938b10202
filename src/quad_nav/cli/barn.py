"""``quad barn``: BARN benchmark, offline."""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path
from typing import Any, List, Optional, Sequence, Tuple

import click

from quad_nav.barn.protocol import Outcome, Run
from quad_nav.barn.results import Results, text, to_csv, to_json
from quad_nav.barn.runs import fly_all
from quad_nav.barn.setup import BarnOptions, BarnSetup, read_barn_setup
from quad_nav.cli import EXIT_INTERRUPTED, EXIT_SUCCESS
from quad_nav.cli.options import (
    A_FILE,
    COUNT,
    OUTPUT,
    POSITIVE,
    echo,
    echo_lines,
    exit_on_faults,
    parameter,
    raise_on_signals,
    show_warnings,
)
from quad_nav.cli.outputs import Outputs
from quad_nav.cli.progress import FlightPace, flights_progress, processes_text
from quad_nav.errors import InputError
from quad_nav.offline.workers import LocalWorkers
from quad_nav.scenario.warm_up import simulate, warm_up


@click.command()
@click.option(
    "--worlds",
    required=True,
    type=A_FILE,
    help="File with the worlds (.npz), see docs/barn.md.",
)
@click.option(
    "--config",
    default="barn",
    show_default=True,
    metavar="NAME|FOLDER",
    help="move_base's parameters: a shipped configuration or a folder, such as the challenge's.",
)
@click.option(
    "--set",
    "parameters",
    multiple=True,
    metavar="PATH=VALUE",
    help="Override a parameter, for example global_costmap/width=60; repeatable.",
)
@click.option(
    "--only", metavar="NUMBERS", default="", help="Fly only these worlds, for example 0,6,12."
)
@click.option("--sample", is_flag=True, help="Fly only the worlds of the official sample.")
@click.option(
    "--runs",
    type=COUNT,
    default=1,
    show_default=True,
    metavar="N",
    help="Flights through each world, with seeds counted up from --seed.",
)
@click.option(
    "--seed",
    type=click.IntRange(min=0),
    default=0,
    show_default=True,
    help="Seed of the LIDAR's noise; equal seeds give equal results.",
)
@click.option(
    "--body-radius",
    "body_radius_m",
    default=0.20,
    show_default=True,
    metavar="M",
    type=POSITIVE,
    help="Radius of the quadcopter.",
)
@click.option(
    "--workers",
    type=COUNT,
    default=lambda: LocalWorkers().count,
    metavar="N",
    help="Flights at the same time.  [default: number of cores]",
)
@click.option("--per-world", is_flag=True, help="Print a row for each world.")
@click.option(
    "--json",
    "json_path",
    type=OUTPUT,
    metavar="FILE",
    help="Write statistics and flights to this file; - is the terminal.",
)
@click.option(
    "--csv",
    "csv_path",
    type=OUTPUT,
    metavar="FILE",
    help="Write a row for each flight to this file.",
)
@click.option("--quiet", "-q", is_flag=True, help="Show neither progress bar nor table.")
def barn(
    workers: int,
    per_world: bool,
    json_path: Optional[Path],
    csv_path: Optional[Path],
    quiet: bool,
    **given: Any,
) -> None:
    """Fly through the worlds of the BARN benchmark without ROS, several at once.

    A flight succeeds if it gets from (-2.25, 3) to within 1 m of (-2.25, 13) in 100 s without
    contact. Ctrl-C prints the results of the flights completed so far.

    Exit status: 0, 1 if workers die repeatedly or an output cannot be written, 2 for invalid input,
    130 after Ctrl-C.
    """
    with exit_on_faults():
        outputs = Outputs({"--json": json_path, "--csv": csv_path}, quiet=quiet)
        setup = read_barn_setup(_options(**given))
        workers = min(workers, setup.wanted)
        if not quiet:
            show_warnings(setup.warnings)
            echo(f"barn: {setup.wanted} flights on {processes_text(workers)}", err=True)
        results, interrupted = _fly(setup, workers, quiet)
    if not quiet:
        echo_lines(text(results, per_world), err=outputs.use_stdout)
    outputs.write("--json", json.dumps(to_json(results), indent=2, allow_nan=False))
    outputs.write("--csv", to_csv(results))
    sys.exit(EXIT_INTERRUPTED if interrupted else outputs.exit_status(EXIT_SUCCESS))


def _options(parameters: Tuple[str, ...], only: str, **given: Any) -> BarnOptions:
    return BarnOptions(
        **given, parameters=tuple(map(parameter, parameters)), only=world_numbers(only)
    )


def world_numbers(text: str) -> Tuple[int, ...]:
    """Parse the value of --only.

    Raises:
        InputError: It is not a list of numbers.
    """
    try:
        return tuple(int(word) for word in text.split(",") if word.strip())
    except ValueError as error:
        raise InputError(
            [f"--only {text}: expected numbers of worlds, for example 0,6,12"]
        ) from error


def _fly(setup: BarnSetup, workers: int, quiet: bool) -> Tuple[Results, bool]:
    """Return the results, and true if Ctrl-C interrupted the flights."""
    bar = OutcomesBar(setup.wanted, workers, quiet)
    runs: List[Run] = []
    interrupted = False
    start_s = time.monotonic()
    raise_on_signals()
    try:
        with bar:
            warm_up(setup.contestant.configuration)  # compile once instead of in every worker
            simulate()
            bar.start()
            for run in fly_all(setup, workers):
                runs.append(run)
                bar.show(runs)
    except KeyboardInterrupt:
        interrupted = True
    runs.sort(key=lambda run: (run.world, run.run))
    wall_time_s = time.monotonic() - start_s
    return Results(setup.contestant, tuple(runs), setup.wanted, wall_time_s), interrupted


class OutcomesBar:
    """Progress bar with counts of outcomes and the rate of flights."""

    def __init__(self, wanted: int, workers: int, quiet: bool, name: str = "barn") -> None:
        self._progress = flights_progress(quiet)
        self._task = self._progress.add_task("flights", total=wanted, status="")
        self._wanted = wanted
        self._name = name
        self._pace = FlightPace(workers)
        self._is_announced = quiet

    def __enter__(self) -> OutcomesBar:
        return self

    def __exit__(self, *_: object) -> None:
        self._progress.stop()

    def start(self) -> None:
        """Start the clock of the rate."""
        self._pace.start()

    def show(self, runs: Sequence[Run]) -> None:
        """Count a flight and update the bar."""
        self._pace.on_flight()
        left = self._wanted - len(runs)
        parts = [
            f"{sum(run.outcome is outcome for run in runs)} {outcome.value}" for outcome in Outcome
        ]
        status = f"{', '.join(parts)}; {self._pace.per_minute:.1f} per minute"
        if self._pace.is_known:
            status += f"; {self._pace.left_text(left)} left"
            if not self._is_announced and left:
                self._is_announced = True
                echo(f"{self._name}: {self._pace.estimate(left)}", err=True)
        self._progress.update(self._task, completed=len(runs), status=status)
        self._progress.start()
