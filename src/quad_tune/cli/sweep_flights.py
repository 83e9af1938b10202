"""Flights of ``quad sweep``: set up, fly with a progress bar, write the outputs."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any, List, Optional, Sequence, Tuple

import yaml

from quad_nav.cli import EXIT_FAILURE, EXIT_SUCCESS
from quad_nav.cli.options import (
    echo,
    echo_lines,
    exit_on_faults,
    show_warnings,
)
from quad_nav.cli.outputs import HTML, Outputs
from quad_nav.cli.progress import processes_text
from quad_nav.errors import InputError
from quad_nav.files import plain_yaml
from quad_tune.cli.flights_bar import run_with_bar
from quad_tune.cli.study_course import course_of, workers_of
from quad_tune.flight_cache import FlightCache
from quad_tune.sweep import (
    Point,
    SweepOptions,
    SweepRow,
    SweepSetup,
    grid,
    read_points,
    read_sweep_setup,
    run_sweep,
)
from quad_tune.sweep_table import table, to_csv, to_json


def fly_sweep(
    json_path: Optional[Path],
    csv_path: Optional[Path],
    report: Optional[Path],
    pictures: Optional[Path],
    quiet: bool,
    **given: Any,
) -> None:
    """Fly with the options of ``quad sweep`` and exit with its status."""
    with exit_on_faults("sweep not started"):
        outputs = Outputs(
            {"--json": json_path, "--csv": csv_path, "--report": report},
            folders={"--pictures": pictures},
            quiet=quiet,
            suffixes={"--report": HTML},
        )
        setup, rows, is_stored = _fly(quiet=quiet, **given)
    if not quiet:
        echo_lines(table(rows), err=outputs.use_stdout)
    outputs.write("--json", json.dumps(to_json(setup, rows), indent=2, allow_nan=False))
    outputs.write("--csv", to_csv(rows))
    _draw(setup, rows, report, pictures, outputs)
    sys.exit(outputs.exit_status(EXIT_SUCCESS if is_stored else EXIT_FAILURE))


def _fly(
    over: Tuple[str, ...],
    points: Optional[Path],
    flights: int,
    workers: Optional[int],
    ray_address: Optional[str],
    cache: Optional[Path],
    quiet: bool,
    **given: Any,
) -> Tuple[SweepSetup, List[SweepRow], bool]:
    setup = read_sweep_setup(SweepOptions(course_of(**given), _points(over, points), flights))
    pool = workers_of(workers, ray_address)
    if not quiet:
        show_warnings(setup.warnings)
        echo(
            f"sweep: {len(setup.points)} points x {flights} flights = "
            f"{len(setup.points) * flights} flights on {processes_text(pool.count)}",
            err=True,
        )
    flight_cache = FlightCache(cache)
    rows = run_with_bar(
        "sweep",
        pool.count,
        setup.course,
        lambda bar: run_sweep(setup, pool, flight_cache, bar),
        lambda _: "with --cache, the same command resumes the sweep",
        quiet,
    )
    return setup, rows, not flight_cache.is_broken


def _points(over: Sequence[str], points: Optional[Path]) -> Tuple[Point, ...]:
    if (points is None) == (not over):
        raise InputError(["expected --over PATH=A,B,... or --points FILE.csv"])
    if points is not None:
        return read_points(points)
    axes = list(map(_axis, over))
    paths = [path for path, _ in axes]
    twice = sorted({path for path in paths if paths.count(path) > 1})
    if twice:
        raise InputError([f"--over {path}: duplicate path, expected once" for path in twice])
    return grid(axes)


def _axis(text: str) -> Tuple[str, List[Any]]:
    """Parse a path and its YAML values."""
    path, equals, words = text.partition("=")
    try:
        values = plain_yaml.load(f"[{words}]") if equals and path.strip("/") else []
    except yaml.YAMLError:
        values = []
    if not values or any(isinstance(value, (dict, list)) or value is None for value in values):
        example = "TrajectoryPlannerROS/max_vel_x=0.2,0.3,0.5"
        raise InputError([f"--over {text}: expected PATH=A,B,..., for example {example}"])
    if len({repr(value) for value in values}) < len(values):
        raise InputError([f"--over {text}: duplicate value, expected each once"])
    return path, values


def _draw(
    setup: SweepSetup,
    rows: Sequence[SweepRow],
    report: Optional[Path],
    pictures: Optional[Path],
    outputs: Outputs,
) -> None:
    """Write report and pictures; the import is local because matplotlib loads slowly."""
    if report is None and pictures is None:
        return
    from quad_nav.report.page import write_page, write_pictures
    from quad_tune.report.sweep_page import sweep_page

    page = sweep_page(setup, rows)
    if report is not None:
        with outputs.attempt("--report", report):
            write_page(page, report)
            outputs.announce("report", report)
    if pictures is not None:
        with outputs.attempt("--pictures", pictures):
            write_pictures(page, pictures)
            outputs.announce("pictures", pictures)
