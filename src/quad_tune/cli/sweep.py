"""``quad sweep``: compare flights over the values of some parameters, offline."""

from __future__ import annotations

from typing import Any

import click

from quad_nav.cli import add_ons
from quad_nav.cli.options import A_FILE, A_FOLDER, COUNT, OUTPUT
from quad_tune.cli.study_options import flown_options, worker_options


@click.command()
@click.option(
    "--over",
    multiple=True,
    metavar="PATH=A,B,...",
    help="Values of a parameter; repeatable, for every combination. lidar/range,"
    " lidar/scan_range, lidar/beams and lidar/noise set the LIDAR.",
)
@click.option(
    "--points",
    type=A_FILE,
    metavar="FILE.csv",
    help="Read points instead: paths in the first row, values in the others.",
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
    "--cache",
    type=A_FILE,
    metavar="FILE",
    help="Store the result of every flight in this file, and reuse stored results.",
)
@click.option(
    "--json",
    "json_path",
    type=OUTPUT,
    metavar="FILE",
    help="Write points, statistics and flights to this file; - is the terminal.",
)
@click.option(
    "--csv",
    "csv_path",
    type=OUTPUT,
    metavar="FILE",
    help="Write a row for each point to this file.",
)
@click.option(
    "--report", type=A_FILE, metavar="FILE.html", help="Write a report with plots to this file."
)
@click.option(
    "--pictures",
    "--png",
    "pictures",
    type=A_FOLDER,
    metavar="FOLDER",
    help="Write the pictures to this folder as PNG and SVG files.",
)
@click.option("--quiet", "-q", is_flag=True, help="Show neither progress bar nor table.")
def sweep(**given: Any) -> None:
    """Fly with several values of some parameters, without ROS, and compare them.

    Every point flies the same flights.

    Exit status: 0, 1 if workers die repeatedly or flights cannot be stored in --cache, 2 for
    invalid input, 130 after Ctrl-C.
    """
    # Imported here: the engine loads slowly, and --help does not need it.
    add_ons.load("quad_tune.cli.sweep_flights", "quad sweep").fly_sweep(**given)
