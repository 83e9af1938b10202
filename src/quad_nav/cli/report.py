"""``quad report``: pictures and a page of recorded flights."""
from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import Optional, Tuple

import click

from quad_nav.cli import EXIT_BAD_INPUT
from quad_nav.errors import InputError


@click.command()
@click.argument("flights", nargs=-1, required=True, metavar="FLIGHT...",
                type=click.Path(path_type=Path))
@click.option("--output", "-o", type=click.Path(dir_okay=False, path_type=Path), metavar="FILE",
              default=Path("report.html"), show_default=True, help="The page.")
@click.option("--png", type=click.Path(file_okay=False, path_type=Path), metavar="FOLDER",
              help="Write every picture there as well.")
@click.option("--animate", type=click.Path(dir_okay=False, path_type=Path), metavar="FILE",
              help="Write an animation of the one FLIGHT: .gif, or .mp4 where there is ffmpeg.")
def report(flights: Tuple[Path, ...], output: Path, png: Optional[Path],
           animate: Optional[Path]) -> None:
    """Make a page with pictures of a recorded flight, or compare several.

    A FLIGHT is a bag, from quad fly --record or from rosbag record during roslaunch. The page is
    one HTML file that needs no network.

    Exit status: 0, or 2 for input that cannot be used.
    """
    from quad_nav.offline.bag_trace import read_trace
    from quad_nav.offline.report.animation import animate_flight, check_animation
    from quad_nav.offline.report.write import write_report

    problems = []
    traces = []
    try:
        if animate is not None:
            check_animation(animate, len(flights))
    except InputError as error:
        problems += error.problems
    for path in flights:
        try:
            traces.append(replace(read_trace(path), title=path.name))
        except InputError as error:
            problems += error.problems
    if problems:
        click.echo("no report:\n  " + "\n  ".join(problems), err=True)
        sys.exit(EXIT_BAD_INPUT)
    write_report(traces, output, png)
    click.echo(f"report: {output}")
    if animate is not None:
        animate_flight(traces[0], animate)
        click.echo(f"animation: {animate}")
