"""``quad tune``: better parameters by many flights, offline."""

from __future__ import annotations

import shlex
import signal
import sys
from pathlib import Path
from typing import Any, Optional, Tuple

import click

from quad_nav.cli import EXIT_INTERRUPTED, EXIT_SUCCESS
from quad_nav.cli.flights_bar import FlightsBar
from quad_nav.cli.study_options import (
    A_FILE,
    A_FOLDER,
    COUNT,
    compile_kernels,
    course_of,
    faults_told,
    flown_options,
    missions_of,
    worker_options,
    workers_of,
)
from quad_nav.offline.workers import Workers
from quad_nav.tuning.search import SearchOptions
from quad_nav.tuning.study_files import write_result
from quad_nav.tuning.study_text import text
from quad_nav.tuning.tune import TuneOptions, TuneResult, TuneSetup, read_tune_setup, run_tune


@click.command()
@flown_options
@click.option(
    "--held-out-scene",
    "held_out_scenes",
    type=A_FILE,
    multiple=True,
    help="A scene that the search never sees; repeatable, each with its goals. [default:"
    " the search's scenes with other seeds; of BARN the official sample]",
)
@click.option("--held-out-goals", type=A_FOLDER, multiple=True, help="The goals for it.")
@click.option(
    "--space",
    type=A_FILE,
    help="Which parameters are searched, and between what."
    " [default: spaces/default.yaml of quad, or barn.yaml, or dwa.yaml]",
)
@click.option(
    "--candidates",
    type=COUNT,
    default=60,
    show_default=True,
    metavar="N",
    help="Sets of parameters to try. A study can be continued with more.",
)
@click.option(
    "--flights",
    type=COUNT,
    default=8,
    show_default=True,
    metavar="N",
    help="Flights of each that is not dropped before.",
)
@click.option(
    "--finalists",
    type=COUNT,
    default=4,
    show_default=True,
    metavar="N",
    help="The best so many fly --final-flights.",
)
@click.option(
    "--final-flights",
    type=COUNT,
    default=16,
    show_default=True,
    metavar="N",
    help="Flights that decide between them.",
)
@click.option(
    "--held-out",
    type=COUNT,
    metavar="N",
    help="Flights with seeds that the search never"
    " sees, for the figures. [default: 20, of BARN 50]",
)
@click.option(
    "--against",
    multiple=True,
    metavar="NAME|FOLDER",
    help="Fly these parameters too, as they are, where the search never was; repeatable.",
)
@click.option(
    "--generation",
    type=COUNT,
    default=8,
    show_default=True,
    metavar="N",
    help="Candidates at a time. It changes what is found; --workers does not.",
)
@worker_options
@click.option(
    "--output",
    "-o",
    type=A_FOLDER,
    default=Path("tuned"),
    show_default=True,
    metavar="FOLDER",
    help="For the parameters, the study and the report.",
)
@click.option("--quiet", "-q", is_flag=True, help="No progress bar, no table.")
def tune(
    workers: Optional[int], ray_address: Optional[str], output: Path, quiet: bool, **given: Any
) -> None:
    """Search for parameters that fly better, without ROS.

    Every candidate flies the same flights. What is found is written to --output as move_base's
    files, with the study and a report. The same command again goes on where it ended, also after
    Ctrl-C or a crash; no flight is flown twice.

    Exit status: 0, 1 when workers die again and again, 2 for input that cannot be used, 130 after
    Ctrl-C.
    """
    with faults_told():
        setup = read_tune_setup(_options(output, **given))
        processes = workers_of(workers, ray_address)
        if not quiet:
            _announce(setup, processes)
        result = _run(setup, processes, quiet)
        for path in write_result(result, shlex.join(["quad", *sys.argv[1:]])):
            if not quiet:
                click.echo(f"written: {path}", err=True)
    if not quiet:
        click.echo(text(result))
    sys.exit(EXIT_SUCCESS)


def _options(
    output: Path,
    space: Optional[Path],
    candidates: int,
    flights: int,
    finalists: int,
    final_flights: int,
    held_out: Optional[int],
    against: Tuple[str, ...],
    generation: int,
    held_out_scenes: Tuple[Path, ...],
    held_out_goals: Tuple[Path, ...],
    **given: Any,
) -> TuneOptions:
    course = course_of(**given, held_out=missions_of(held_out_scenes, held_out_goals, "held-out-"))
    default = 20 if given["worlds"] is None else 50
    return TuneOptions(
        course,
        output,
        space,
        SearchOptions(candidates, flights, generation, given["seed"]),
        finalists,
        final_flights,
        held_out or default,
        against,
    )


def _announce(setup: TuneSetup, workers: Workers) -> None:
    for warning in setup.warnings:
        click.echo(warning, err=True)
    search = setup.options.search
    click.echo(
        f"{search.candidates} candidates of up to {search.flights} flights, "
        f"{len(setup.space.dimensions)} parameters, {workers.count} flights at a time",
        err=True,
    )


def _run(setup: TuneSetup, workers: Workers, quiet: bool) -> TuneResult:
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background jobs ignore it
    with FlightsBar(quiet) as bar:
        try:
            compile_kernels(setup.course)
            bar.start()
            result = run_tune(setup, workers, bar)
        except KeyboardInterrupt:
            bar.__exit__()
            click.echo(
                f"interrupted; {bar.flights + bar.kept} flights are kept, the same command "
                "goes on from here",
                err=True,
            )
            sys.exit(EXIT_INTERRUPTED)
    if not quiet:
        click.echo(bar.words, err=True)
    return result
