"""``quad tune``: search for better parameters by many flights, offline."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path
from typing import Any, Optional, Tuple

import click

from quad_nav.cli import EXIT_SUCCESS
from quad_nav.cli.flights_bar import run_with_bar
from quad_nav.cli.options import (
    A_FILE,
    A_FOLDER,
    COUNT,
    echo,
    echo_lines,
    exit_on_faults,
    show_warnings,
)
from quad_nav.cli.outputs import Outputs
from quad_nav.cli.progress import processes_text
from quad_nav.cli.study_options import (
    course_of,
    flown_options,
    missions_of,
    worker_options,
    workers_of,
)
from quad_nav.offline.workers import Workers
from quad_nav.tuning.search import SearchOptions
from quad_nav.tuning.study_files import write_result
from quad_nav.tuning.study_text import format_value, text
from quad_nav.tuning.tune import TuneOptions, TuneSetup, read_tune_setup, run_tune


@click.command()
@flown_options
@click.option(
    "--held-out-scene",
    "held_out_scenes",
    type=A_FILE,
    multiple=True,
    help="Held-out scene, never flown by the search; repeatable, each with its goals."
    " [default: the search's scenes with other seeds; for BARN the official sample]",
)
@click.option("--held-out-goals", type=A_FOLDER, multiple=True, help="Goals for a held-out scene.")
@click.option(
    "--space",
    type=A_FILE,
    help="Searched parameters with their ranges. [default: the shipped spaces/default.yaml,"
    " barn.yaml or dwa.yaml]",
)
@click.option(
    "--free-speed",
    is_flag=True,
    help="Also search the robot's limits, its speeds and accelerations, where the space has them."
    " Without it they keep the values of the base.",
)
@click.option(
    "--candidates",
    type=COUNT,
    default=60,
    show_default=True,
    metavar="N",
    help="Number of parameter sets to try. A study can be resumed with more.",
)
@click.option(
    "--flights",
    type=COUNT,
    default=8,
    show_default=True,
    metavar="N",
    help="Flights of each candidate that is not pruned.",
)
@click.option(
    "--finalists",
    type=COUNT,
    default=4,
    show_default=True,
    metavar="N",
    help="Number of best candidates that fly --final-flights.",
)
@click.option(
    "--final-flights",
    type=COUNT,
    default=16,
    show_default=True,
    metavar="N",
    help="Flights that select the best finalist.",
)
@click.option(
    "--held-out",
    type=COUNT,
    metavar="N",
    help="Held-out flights that compare base and tuned parameters. [default: 20, for BARN 50]",
)
@click.option(
    "--against",
    multiple=True,
    metavar="NAME|FOLDER",
    help="Also fly the held-out flights with this configuration, unchanged; repeatable.",
)
@click.option(
    "--generation",
    type=COUNT,
    default=8,
    show_default=True,
    metavar="N",
    help="Candidates per generation. Changes the result; --workers does not.",
)
@worker_options
@click.option(
    "--output",
    "-o",
    type=A_FOLDER,
    default=Path("tuned"),
    show_default=True,
    metavar="FOLDER",
    help="Folder of the parameters, the study and the report.",
)
@click.option(
    "--pictures",
    type=A_FOLDER,
    metavar="FOLDER",
    help="Also write the report's pictures to this folder as PNG and SVG files.",
)
@click.option("--quiet", "-q", is_flag=True, help="Show neither progress bar nor table.")
def tune(
    workers: Optional[int],
    ray_address: Optional[str],
    output: Path,
    pictures: Optional[Path],
    quiet: bool,
    **given: Any,
) -> None:
    """Search for parameters that fly better, without ROS.

    Every candidate flies the same flights. The best parameters are written to --output as
    move_base's files, with the study and a report. The same command resumes an interrupted study.

    Exit status: 0, 1 if workers die repeatedly or an output cannot be written, 2 for invalid input,
    130 after Ctrl-C.
    """
    with exit_on_faults():
        outputs = Outputs({}, folders={"--output": output, "--pictures": pictures})
        setup = read_tune_setup(_options(output, **given))
        pool = workers_of(workers, ray_address)
        if not quiet:
            _announce(setup, pool)
        result = run_with_bar(
            "tune",
            pool.count,
            setup.course,
            lambda bar: run_tune(setup, pool, bar),
            lambda bar: (
                f"{bar.flights + bar.cached} flights are stored, the same command resumes the study"
            ),
            quiet,
        )
        overview = text(result)
        with outputs.attempt("--output", output, overview if quiet else ""):
            for path in write_result(result, shlex.join(["quad", *sys.argv[1:]]), pictures):
                if not quiet:
                    echo(f"written: {path}", err=True)
    if not quiet:
        echo_lines(overview)
    sys.exit(outputs.exit_status(EXIT_SUCCESS))


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
    free_speed: bool,
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
        free_speed,
    )


def _announce(setup: TuneSetup, workers: Workers) -> None:
    show_warnings(setup.warnings)
    search = setup.options.search
    if setup.held:
        values = ", ".join(f"{path} {format_value(value)}" for path, value in setup.held.items())
        echo(
            f"tune: the robot's limits stay as in {setup.course.config}: {values}; --free-speed "
            "searches them",
            err=True,
        )
    echo(
        f"tune: {search.candidates} candidates x up to {search.flights} flights, "
        f"{len(setup.space.dimensions)} parameters; with finalists and held-out flights up to "
        f"about {setup.planned_flights} flights on {processes_text(workers.count)}",
        err=True,
    )
