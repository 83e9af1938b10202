"""``quad report``: pictures and a page of recorded flights."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Callable, List, Optional, Sequence, Tuple, TypeVar

import click
from rich.console import Console
from rich.progress import track

from quad_nav.cli import EXIT_BAD_INPUT
from quad_nav.errors import InputError

if TYPE_CHECKING:
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
    help="The page.",
)
@click.option(
    "--png",
    type=click.Path(file_okay=False, path_type=Path),
    metavar="FOLDER",
    help="Write every picture there as well.",
)
@click.option(
    "--animate",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Write an animation of the one FLIGHT: .gif, or .mp4 where there is ffmpeg.",
)
def report(
    flights: Tuple[Path, ...], output: Path, png: Optional[Path], animate: Optional[Path]
) -> None:
    """Make a page with pictures of a recorded flight, or compare several.

    A FLIGHT is a bag or MCAP of quad fly --record, or a bag of rosbag record during roslaunch. The
    page is one HTML file that needs no network.

    Exit status: 0, or 2 for input that cannot be used.
    """
    from quad_nav.report.animation import animate_flight, animation_faults
    from quad_nav.report.figures import figures
    from quad_nav.report.write import write_comparison, write_report

    try:
        faults = animation_faults(animate, len(flights)) if animate is not None else []
        if len(flights) == 1:
            (trace,) = _read(flights, lambda trace: trace, faults)
            write_report(trace, output, png)
        else:
            write_comparison(_read(flights, figures, faults), output, png)
    except InputError as error:
        click.echo("no report:\n  " + "\n  ".join(error.problems), err=True)
        sys.exit(EXIT_BAD_INPUT)
    click.echo(f"report: {output}")
    if animate is not None:
        animate_flight(trace, animate)
        click.echo(f"animation: {animate}")


def _read(
    flights: Sequence[Path], reduce: Callable[[FlightTrace], T], faults: Sequence[str]
) -> List[T]:
    """What ``reduce`` makes of each flight's trace; traces of many would fill the memory.

    Raises:
        InputError: the ``faults`` that were known before, and a line for every flight that cannot
            be read.
    """
    from quad_nav.recording.bag_trace import read_trace

    console = Console(stderr=True)
    found: List[T] = []
    problems = list(faults)
    for path in track(
        flights, "reading", console=console, transient=True, disable=not console.is_terminal
    ):
        try:
            found.append(reduce(replace(read_trace(path), title=path.name)))
        except InputError as error:
            problems += error.problems
    if problems:
        raise InputError(problems)
    return found
