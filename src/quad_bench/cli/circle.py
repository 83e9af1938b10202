"""``quad circle``: robots on a circle swap sides, by our navigator and by ORCA."""

from __future__ import annotations

from typing import Any

import click

from quad_bench.cli.benchmark_options import body_radius_option, flight_options
from quad_nav.cli.options import A_FILE, AMOUNT, POSITIVE, Integer

# Those of quad_bench.circle.setup, and of the body; importing them would load the engine.
METHODS = ("quad", "orca", "orca-points")
BODY_RADIUS_M = 0.30


@click.command()
@click.option(
    "--robots",
    type=Integer(min=2),
    multiple=True,
    default=(8,),
    show_default=True,
    metavar="N",
    help="Number of robots; repeatable.",
)
@click.option(
    "--radius",
    "radius_m",
    type=AMOUNT,
    default=0.0,
    metavar="M",
    help="Radius of the circle. [default: 4 m for up to 16 robots, 8 m for more]",
)
@click.option(
    "--method",
    "methods",
    type=click.Choice(METHODS),
    multiple=True,
    default=METHODS,
    help="Our navigators, ORCA's velocities flown by our quadcopters, or ORCA's points; repeatable."
    " The last two need pip install 'quad-nav[orca]'. [default: all]",
)
@click.option(
    "--config",
    default="default",
    show_default=True,
    metavar="NAME|FOLDER",
    help="move_base's parameters: a shipped configuration or a folder.",
)
@click.option(
    "--jitter",
    "jitter_m",
    type=AMOUNT,
    default=0.1,
    show_default=True,
    metavar="M",
    help="Displace each start at random, by at most this distance.",
)
@click.option(
    "--time-limit",
    "time_limit_s",
    type=POSITIVE,
    default=300.0,
    show_default=True,
    metavar="S",
    help="End a flight after this simulated time.",
)
@click.option(
    "--orca-horizon",
    "orca_horizon_s",
    type=POSITIVE,
    default=10.0,
    show_default=True,
    metavar="S",
    help="Time for which ORCA's velocities are free of collisions.",
)
@flight_options
@body_radius_option(BODY_RADIUS_M)
@click.option(
    "--picture",
    type=A_FILE,
    metavar="FILE",
    help="Draw the paths of the first flight of each kind, as .png or .svg.",
)
def circle(**given: Any) -> None:
    """Let robots on a circle swap sides without ROS, by several methods, and compare them.

    A flight succeeds if every robot gets to within 0.4 m of the opposite point without contact.
    Ctrl-C prints the results of the flights completed so far.

    Exit status: 0, 1 if workers die repeatedly or an output cannot be written, 2 for invalid input,
    130 after Ctrl-C.
    """
    # Imported here: the engine loads slowly, and --help does not need it.
    from quad_bench.cli.circle_flights import fly_circle

    fly_circle(**given)
