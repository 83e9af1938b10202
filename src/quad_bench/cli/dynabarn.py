"""``quad dynabarn``: DynaBARN benchmark, offline."""

from __future__ import annotations

from typing import Any

import click

from quad_bench.cli.benchmark_options import body_radius_option, flight_options, world_options
from quad_nav.cli.options import AMOUNT

# Those of quad_nav.sim.motion and quad_bench.barn.dynamic; importing them would load the engine.
INTERPOLATIONS = ("linear", "spline")
PUBLISHED_SPEED_MPS = 0.5


@click.command()
@world_options("dynabarn", config="moving")
@click.option(
    "--max-vel-x",
    "max_vel_x_mps",
    type=AMOUNT,
    default=PUBLISHED_SPEED_MPS,
    show_default=True,
    metavar="M/S",
    help="The local planner's max_vel_x; 0 for that of the configuration.",
)
@click.option(
    "--interpolation",
    type=click.Choice(INTERPOLATIONS),
    default="spline",
    show_default=True,
    help="Obstacles between keyframes: as Gazebo plays them, or as in the paper.",
)
@flight_options
@body_radius_option(0.20)
def dynabarn(**given: Any) -> None:
    """Fly among the moving obstacles of the DynaBARN benchmark without ROS, several at once.

    A flight succeeds if it gets from (11, 0) to within 1 m of (-9, 0) in 100 s without contact.
    Ctrl-C prints the results of the flights completed so far.

    Exit status: 0, 1 if workers die repeatedly or an output cannot be written, 2 for invalid input,
    130 after Ctrl-C.
    """
    # Imported here: the engine loads slowly, and --help does not need it.
    from quad_bench.cli.barn_benchmarks import fly_dynabarn

    fly_dynabarn(**given)
