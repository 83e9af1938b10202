"""``quad barn``: the benchmark of narrow worlds, offline."""

from __future__ import annotations

import json
import signal
import sys
import time
from pathlib import Path
from typing import Any, List, Optional, TextIO, Tuple

import click
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from quad_nav.barn.protocol import Outcome, Run
from quad_nav.barn.results import Results, text, to_json, write_csv
from quad_nav.barn.runs import fly_all
from quad_nav.barn.setup import BarnOptions, BarnSetup, read_barn_setup
from quad_nav.cli import EXIT_BAD_INPUT, EXIT_INTERRUPTED, EXIT_SUCCESS
from quad_nav.cli.parameters import parameter
from quad_nav.errors import InputError
from quad_nav.offline.workers import LocalWorkers
from quad_nav.scenario.warm_up import simulate, warm_up

_OUTPUT = click.File("w", encoding="utf-8", lazy=False)  # refused now, not after an hour


@click.command()
@click.option(
    "--worlds",
    required=True,
    type=click.Path(dir_okay=False, path_type=Path),
    help="The .npz with the worlds; docs/barn.md says what is in it.",
)
@click.option(
    "--params",
    default="barn",
    show_default=True,
    metavar="NAME|FOLDER",
    help="move_base's parameters: the challenge's own folder, one that comes with quad, or yours.",
)
@click.option(
    "--set",
    "parameters",
    multiple=True,
    metavar="PATH=VALUE",
    help="A parameter on top of the folder's, as global_costmap/width=60; repeatable.",
)
@click.option("--only", metavar="NUMBERS", default="", help="These worlds, as 0,6,12.")
@click.option("--sample", is_flag=True, help="The worlds of the official sample.")
@click.option(
    "--runs",
    type=click.IntRange(min=1),
    default=1,
    show_default=True,
    metavar="N",
    help="Flights through each world; the seed counts up from --seed.",
)
@click.option(
    "--seed",
    type=click.IntRange(min=0),
    default=0,
    show_default=True,
    help="For the LIDAR's noise; the same seed gives the same figures.",
)
@click.option(
    "--body-radius",
    "body_radius_m",
    default=0.20,
    show_default=True,
    metavar="M",
    type=click.FloatRange(min=0.0, min_open=True),
    help="The quadcopter's.",
)
@click.option(
    "--workers",
    type=click.IntRange(min=1),
    default=lambda: LocalWorkers().count,
    metavar="N",
    help="Flights at the same time.  [default: as many as there are cores]",
)
@click.option("--per-world", is_flag=True, help="A row for each world.")
@click.option(
    "--json",
    "json_file",
    type=_OUTPUT,
    metavar="FILE",
    help="Write figures and flights there; - is the terminal.",
)
@click.option(
    "--csv", "csv_file", type=_OUTPUT, metavar="FILE", help="Write a line for each flight there."
)
@click.option("--quiet", "-q", is_flag=True, help="No progress bar, no table.")
def barn(
    workers: int,
    per_world: bool,
    json_file: Optional[TextIO],
    csv_file: Optional[TextIO],
    quiet: bool,
    **given: Any,
) -> None:
    """Fly through the worlds of the BARN benchmark without ROS, several at once.

    From (-2.25, 3) to within 1 m of (-2.25, 13), in 100 s, without any contact. Ctrl-C ends it
    with the figures of the flights that were over.

    Exit status: 0, or 2 for input that cannot be used, or 130 after Ctrl-C.
    """
    try:
        setup = read_barn_setup(_options(**given))
    except InputError as error:
        click.echo("nothing is flown:\n  " + "\n  ".join(error.problems), err=True)
        sys.exit(EXIT_BAD_INPUT)
    workers = min(workers, setup.wanted)
    if not quiet:
        for warning in setup.warnings:
            click.echo(warning, err=True)
        click.echo(f"{setup.wanted} flights, {workers} at a time", err=True)
    results, interrupted = _fly(setup, workers, quiet)
    if not quiet:
        click.echo(text(results, per_world), err=_is_terminal(json_file) or _is_terminal(csv_file))
    if json_file is not None:
        click.echo(json.dumps(to_json(results), indent=2, allow_nan=False), json_file)
    if csv_file is not None:
        write_csv(results, csv_file)
    sys.exit(EXIT_INTERRUPTED if interrupted else EXIT_SUCCESS)


def _is_terminal(file: Optional[TextIO]) -> bool:
    return file is not None and file.name == "<stdout>"


def _options(parameters: Tuple[str, ...], only: str, **given: Any) -> BarnOptions:
    return BarnOptions(**given, parameters=tuple(map(parameter, parameters)), only=_numbers(only))


def _numbers(text: str) -> Tuple[int, ...]:
    try:
        return tuple(int(word) for word in text.split(",") if word.strip())
    except ValueError as error:
        raise InputError([f"--only {text}: expected numbers of worlds, as 0,6,12"]) from error


def _fly(setup: BarnSetup, workers: int, quiet: bool) -> Tuple[Results, bool]:
    """The results, and whether Ctrl-C has cut them short."""
    bar = _Bar(setup.wanted, quiet)
    runs: List[Run] = []
    interrupted = False
    start_s = time.monotonic()
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background jobs ignore it
    try:
        with bar:
            warm_up(setup.contestant.configuration)  # once, and not in every worker at once
            simulate()
            for run in fly_all(setup, workers):
                runs.append(run)
                bar.show(runs)
    except KeyboardInterrupt:
        interrupted = True
    runs.sort(key=lambda run: (run.world, run.run))
    wall_time_s = time.monotonic() - start_s
    return Results(setup.contestant, tuple(runs), setup.wanted, wall_time_s), interrupted


class _Bar:
    """Flights, rate and time left; on stderr, and only where that is a terminal.

    It begins with the first flight that is over: until then the workers' libraries may say
    something of their own.
    """

    def __init__(self, wanted: int, quiet: bool) -> None:
        console = Console(stderr=True)
        self._progress = Progress(
            TextColumn("flights"),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("{task.fields[told]}"),
            TimeRemainingColumn(elapsed_when_finished=True),
            TextColumn("left"),
            console=console,
            transient=True,
            speed_estimate_period=300.0,
            disable=quiet or not console.is_terminal,
        )
        self._task = self._progress.add_task("", total=wanted, told="")
        self._start_s = time.monotonic()

    def __enter__(self) -> _Bar:
        return self

    def __exit__(self, *_: object) -> None:
        self._progress.stop()

    def show(self, runs: List[Run]) -> None:
        counts = [
            f"{sum(run.outcome is outcome for run in runs)} {outcome.value}" for outcome in Outcome
        ]
        per_minute = 60.0 * len(runs) / max(time.monotonic() - self._start_s, 1e-3)
        self._progress.update(
            self._task, completed=len(runs), told=f"{', '.join(counts)}; {per_minute:.1f} a minute"
        )
        self._progress.start()
