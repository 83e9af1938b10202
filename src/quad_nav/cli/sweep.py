"""``quad sweep``: how flights change with a parameter or two, offline."""

from __future__ import annotations

import json
import signal
import sys
from pathlib import Path
from typing import Any, List, Optional, Sequence, TextIO, Tuple

import click
import yaml

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
    worker_options,
    workers_of,
)
from quad_nav.errors import InputError
from quad_nav.files import plain_yaml
from quad_nav.offline.workers import Workers
from quad_nav.tuning.flight_cache import FlightCache
from quad_nav.tuning.sweep import (
    Point,
    SweepOptions,
    SweepRow,
    SweepSetup,
    grid,
    read_points,
    read_sweep_setup,
    run_sweep,
)
from quad_nav.tuning.sweep_table import table, to_json, write_csv

_OUTPUT = click.File("w", encoding="utf-8", lazy=False)  # refused now, not after an hour


@click.command()
@click.option(
    "--over",
    multiple=True,
    metavar="PATH=A,B,...",
    help="Values of a parameter;"
    " repeatable for every combination. lidar/range, lidar/scan_range, lidar/beams and"
    " lidar/noise are the LIDAR's own.",
)
@click.option(
    "--points",
    type=A_FILE,
    metavar="FILE.csv",
    help="Points instead: paths in the first line, values in the others.",
)
@flown_options
@click.option(
    "--flights",
    type=COUNT,
    default=8,
    show_default=True,
    metavar="N",
    help="Flights of each point.",
)
@worker_options
@click.option(
    "--journal",
    type=A_FILE,
    metavar="FILE",
    help="Keep every flight there, and take from there what was flown before.",
)
@click.option(
    "--json",
    "json_file",
    type=_OUTPUT,
    metavar="FILE",
    help="Write points, figures and flights there; - is the terminal.",
)
@click.option(
    "--csv", "csv_file", type=_OUTPUT, metavar="FILE", help="Write a line for each point there."
)
@click.option("--report", type=A_FILE, metavar="FILE.html", help="Write a page with pictures.")
@click.option("--png", type=A_FOLDER, metavar="FOLDER", help="Write the pictures there.")
@click.option("--quiet", "-q", is_flag=True, help="No progress bar, no table.")
def sweep(
    over: Tuple[str, ...],
    points: Optional[Path],
    flights: int,
    workers: Optional[int],
    ray_address: Optional[str],
    journal: Optional[Path],
    quiet: bool,
    report: Optional[Path],
    png: Optional[Path],
    json_file: Optional[TextIO],
    csv_file: Optional[TextIO],
    **given: Any,
) -> None:
    """Fly with several values of some parameters, without ROS, and compare.

    Every point flies the same flights.

    Exit status: 0, 1 when workers die again and again, 2 for input that cannot be used, 130 after
    Ctrl-C.
    """
    with faults_told():
        options = SweepOptions(course_of(**given), _points(over, points), flights)
        setup = read_sweep_setup(options)
        processes = workers_of(workers, ray_address)
        if not quiet:
            for warning in setup.warnings:
                click.echo(warning, err=True)
            click.echo(
                f"{len(setup.points)} points, {flights} flights each, {processes.count} flights "
                "at a time",
                err=True,
            )
        rows = _run(setup, processes, FlightCache(journal), quiet)
    if not quiet:
        to_terminal = any(
            file is not None and file.name == "<stdout>" for file in (json_file, csv_file)
        )
        click.echo(table(rows), err=to_terminal)
    if json_file is not None:
        click.echo(json.dumps(to_json(setup, rows), indent=2, allow_nan=False), json_file)
    if csv_file is not None:
        write_csv(rows, csv_file)
    _draw(setup, rows, report, png)
    sys.exit(EXIT_SUCCESS)


def _run(setup: SweepSetup, workers: Workers, journal: FlightCache, quiet: bool) -> List[SweepRow]:
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background jobs ignore it
    with FlightsBar(quiet) as bar:
        try:
            compile_kernels(setup.course)
            bar.start()
            rows = run_sweep(setup, workers, journal, bar)
        except KeyboardInterrupt:
            bar.__exit__()
            click.echo("interrupted; with --journal, the same command goes on from here", err=True)
            sys.exit(EXIT_INTERRUPTED)
    if not quiet:
        click.echo(bar.words, err=True)
    return rows


def _points(over: Sequence[str], points: Optional[Path]) -> Tuple[Point, ...]:
    if (points is None) == (not over):
        raise InputError(["expected --over PATH=A,B,... or --points FILE.csv"])
    if points is not None:
        return read_points(points)
    axes = list(map(_axis, over))
    paths = [path for path, _ in axes]
    twice = sorted({path for path in paths if paths.count(path) > 1})
    if twice:
        raise InputError([f"--over {path}: given twice, expected once" for path in twice])
    return grid(axes)


def _axis(text: str) -> Tuple[str, List[Any]]:
    """A path and its values, each written as in YAML."""
    path, equals, words = text.partition("=")
    try:
        values = plain_yaml.load(f"[{words}]") if equals and path.strip("/") else []
    except yaml.YAMLError:
        values = []
    if not values or any(isinstance(value, (dict, list)) or value is None for value in values):
        raise InputError(
            [f"--over {text}: expected PATH=A,B,..., as TrajectoryPlannerROS/max_vel_x=0.2,0.3,0.5"]
        )
    if len({repr(value) for value in values}) < len(values):
        raise InputError([f"--over {text}: a value is there twice, expected each once"])
    return path, values


def _draw(
    setup: SweepSetup, rows: Sequence[SweepRow], report: Optional[Path], png: Optional[Path]
) -> None:
    """Imported here: who wants no pictures need not wait for them."""
    if report is None and png is None:
        return
    from quad_nav.tuning.report.sweep_page import write_sweep_report

    for path in write_sweep_report(setup, rows, report, png):
        click.echo(f"written: {path}", err=True)
