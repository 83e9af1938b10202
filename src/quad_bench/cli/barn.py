"""``quad barn``: BARN benchmark, offline."""

from __future__ import annotations

from typing import Any

import click

from quad_bench.cli.benchmark_options import body_radius_option, flight_options, world_options


@click.command()
@world_options("barn", config="barn")
@click.option("--sample", is_flag=True, help="Fly only the worlds of the official sample.")
@flight_options
@body_radius_option(0.20)
def barn(**given: Any) -> None:
    """Fly through the worlds of the BARN benchmark without ROS, several at once.

    A flight succeeds if it gets from (-2.25, 3) to within 1 m of (-2.25, 13) in 100 s without
    contact. Ctrl-C prints the results of the flights completed so far.

    Exit status: 0, 1 if workers die repeatedly or an output cannot be written, 2 for invalid input,
    130 after Ctrl-C.
    """
    # Imported here: the engine loads slowly, and --help does not need it.
    from quad_bench.cli.barn_benchmarks import fly_barn

    fly_barn(**given)
