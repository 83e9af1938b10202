"""Study of ``quad tune``: set up, search with a progress bar, write the result."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path
from typing import Any, Optional, Tuple

from quad_nav.cli import EXIT_SUCCESS
from quad_nav.cli.options import echo, echo_lines, exit_on_faults, show_warnings
from quad_nav.cli.outputs import Outputs
from quad_nav.cli.progress import processes_text
from quad_nav.offline.workers import Workers
from quad_tune.cli.flights_bar import run_with_bar
from quad_tune.cli.study_course import course_of, missions_of, workers_of
from quad_tune.search import SearchOptions
from quad_tune.study_files import write_result
from quad_tune.study_text import format_value, text
from quad_tune.tune import TuneOptions, TuneSetup, read_tune_setup, run_tune


def run_study(
    workers: Optional[int],
    ray_address: Optional[str],
    output: Path,
    pictures: Optional[Path],
    quiet: bool,
    **given: Any,
) -> None:
    """Search with the options of ``quad tune`` and exit with its status."""
    with exit_on_faults("study not started"):
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
