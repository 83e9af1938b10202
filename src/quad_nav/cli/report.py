"""``quad report``: pictures and a page of recorded flights."""

from __future__ import annotations

import sys
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Callable, List, Optional, Sequence, Tuple, TypeVar

import click
from rich.console import Console
from rich.progress import track

from quad_nav.cli import EXIT_BAD_INPUT, EXIT_SUCCESS, add_ons
from quad_nav.cli.options import echo, echo_lines
from quad_nav.cli.outputs import HTML, Outputs
from quad_nav.errors import InputError
from quad_nav.recording.trace import FlightTrace

T = TypeVar("T")


@click.command()
@click.argument(
    "flights", nargs=-1, required=True, metavar="FLIGHT...", type=click.Path(path_type=Path)
)
@click.option(
    "--output",
    "-o",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    default=Path("report.html"),
    show_default=True,
    help="Write the report to this file.",
)
@click.option(
    "--pictures",
    "--png",
    "pictures",
    type=click.Path(file_okay=False, path_type=Path),
    metavar="FOLDER",
    help="Also write every picture to this folder, as a PNG and an SVG file.",
)
@click.option(
    "--animate",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Write an animation: .gif, or .mp4 (requires ffmpeg). Takes exactly one FLIGHT.",
)
def report(
    flights: Tuple[Path, ...], output: Path, pictures: Optional[Path], animate: Optional[Path]
) -> None:
    """Write a report of a recorded flight, or compare several flights.

    A FLIGHT is a bag from quad fly --record or rosbag record. The
    report is a single HTML file that needs no network.

    Exit status: 0, 1 if something cannot be written, 2 for invalid input.
    """
    # Imported here, because matplotlib loads slowly.
    page = add_ons.load("quad_nav.report.page", "quad report")
    from quad_nav.report import animation
    from quad_nav.report.compared_flight import compared_flight
    from quad_nav.report.comparison import comparison_page
    from quad_nav.report.flight_page import flight_page

    try:
        names = {"--output": output}, {"--animate": animate}, {"--pictures": pictures}
        outputs = Outputs(*names, suffixes={"--output": HTML})
        faults = animation.animation_faults(animate, len(flights)) if animate is not None else []
        if len(flights) == 1:
            (trace,) = _read(flights, lambda trace: trace, faults)
            content = flight_page(trace)
        else:
            content = comparison_page(_read(flights, compared_flight, faults))
    except InputError as error:
        echo_lines("no report written:\n  " + "\n  ".join(error.problems), err=True)
        sys.exit(EXIT_BAD_INPUT)
    writers = {
        "--output": partial(page.write_page, content),
        "--pictures": partial(page.write_pictures, content),
    }
    if animate is not None:
        writers["--animate"] = partial(animation.animate_flight, trace)
    for option, write in writers.items():
        for line in outputs.save(option, write):
            echo(line)
    sys.exit(outputs.exit_status(EXIT_SUCCESS))


def _read(
    flights: Sequence[Path], reduce: Callable[[FlightTrace], T], faults: Sequence[str]
) -> List[T]:
    """Read each flight and reduce its trace at once: many whole traces do not fit in memory.

    Raises:
        InputError: Lists ``faults``, found before, and every flight that cannot be read.
    """
    from quad_nav.recording.bag_trace import read_trace

    console = Console(stderr=True)
    reduced: List[T] = []
    problems = list(faults)
    for path in track(
        flights, "reading", console=console, transient=True, disable=not console.is_terminal
    ):
        try:
            reduced.append(reduce(replace(read_trace(path), title=path.name)))
        except InputError as error:
            problems += error.problems
    if problems:
        raise InputError(problems)
    return reduced
