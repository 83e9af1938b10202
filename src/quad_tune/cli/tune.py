"""``quad tune``: search for better parameters by many flights, offline."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from quad_nav.cli import add_ons
from quad_nav.cli.options import A_FILE, A_FOLDER, COUNT
from quad_tune.cli.study_options import flown_options, worker_options


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
def tune(**given: Any) -> None:
    """Search for parameters that fly better, without ROS.

    Every candidate flies the same flights. The best parameters are written to --output as
    move_base's files, with the study and a report. The same command resumes an interrupted study.

    Exit status: 0, 1 if workers die repeatedly or an output cannot be written, 2 for invalid input,
    130 after Ctrl-C.
    """
    # Imported here: the engine loads slowly, and --help does not need it.
    add_ons.load("quad_tune.cli.tune_study", "quad tune").run_study(**given)
