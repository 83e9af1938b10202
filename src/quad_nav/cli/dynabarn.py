"""``quad dynabarn``: DynaBARN benchmark, offline."""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path
from typing import Any, List, Optional, Tuple

import click

from quad_nav.barn.dynamic import (
    PUBLISHED_SPEED_MPS,
    DynamicRun,
    DynamicSetup,
    fly_all,
    read_dynamic_setup,
)
from quad_nav.barn.dynamic_results import DynamicResults, text, to_csv, to_json
from quad_nav.barn.setup import BarnOptions
from quad_nav.cli import EXIT_INTERRUPTED, EXIT_SUCCESS
from quad_nav.cli.barn import OutcomesBar, world_numbers
from quad_nav.cli.options import (
    A_FILE,
    COUNT,
    OUTPUT,
    POSITIVE,
    echo,
    echo_lines,
    exit_on_faults,
    parameter,
    raise_on_signals,
    show_warnings,
)
from quad_nav.cli.outputs import Outputs
from quad_nav.cli.progress import processes_text
from quad_nav.offline.workers import LocalWorkers
from quad_nav.scenario.warm_up import simulate, warm_up
from quad_nav.sim.motion import INTERPOLATIONS, SPLINE


@click.command()
@click.option(
    "--worlds",
    required=True,
    type=A_FILE,
    help="File with the worlds (.npz), see docs/dynabarn.md.",
)
@click.option(
    "--config",
    default="barn",
    show_default=True,
    metavar="NAME|FOLDER",
    help="move_base's parameters: a shipped configuration or a folder, such as the challenge's.",
)
@click.option(
    "--set",
    "parameters",
    multiple=True,
    metavar="PATH=VALUE",
    help="Override a parameter, for example global_costmap/width=60; repeatable.",
)
@click.option(
    "--max-vel-x",
    "max_vel_x_mps",
    type=click.FloatRange(min=0.0),
    default=PUBLISHED_SPEED_MPS,
    show_default=True,
    metavar="M/S",
    help="The local planner's max_vel_x; 0 for that of the configuration.",
)
@click.option(
    "--interpolation",
    type=click.Choice(INTERPOLATIONS),
    default=SPLINE,
    show_default=True,
    help="Obstacles between keyframes: as Gazebo plays them, or as in the paper.",
)
@click.option("--only", metavar="NUMBERS", default="", help="Fly only these worlds, as in 0,6,12.")
@click.option(
    "--runs",
    type=COUNT,
    default=1,
    show_default=True,
    metavar="N",
    help="Flights through each world, with seeds counted up from --seed.",
)
@click.option(
    "--seed",
    type=click.IntRange(min=0),
    default=0,
    show_default=True,
    help="Seed of the obstacles' phase and the LIDAR's noise.",
)
@click.option(
    "--body-radius",
    "body_radius_m",
    default=0.20,
    show_default=True,
    metavar="M",
    type=POSITIVE,
    help="Radius of the quadcopter.",
)
@click.option(
    "--workers",
    type=COUNT,
    default=lambda: LocalWorkers().count,
    metavar="N",
    help="Flights at the same time.  [default: number of cores]",
)
@click.option("--per-world", is_flag=True, help="Print a row for each world.")
@click.option("--json", "json_path", type=OUTPUT, metavar="FILE", help="Write everything here.")
@click.option("--csv", "csv_path", type=OUTPUT, metavar="FILE", help="Write a row per flight here.")
@click.option("--quiet", "-q", is_flag=True, help="Show neither progress bar nor table.")
def dynabarn(
    workers: int,
    per_world: bool,
    json_path: Optional[Path],
    csv_path: Optional[Path],
    quiet: bool,
    **given: Any,
) -> None:
    """Fly among the moving obstacles of the DynaBARN benchmark without ROS, several at once.

    A flight succeeds if it gets from (11, 0) to within 1 m of (-9, 0) in 100 s without contact.
    Ctrl-C prints the results of the flights completed so far.

    Exit status: 0, 1 if workers die repeatedly or an output cannot be written, 2 for invalid input,
    130 after Ctrl-C.
    """
    with exit_on_faults():
        outputs = Outputs({"--json": json_path, "--csv": csv_path}, quiet=quiet)
        setup = _setup(**given)
        workers = min(workers, setup.wanted)
        if not quiet:
            show_warnings(setup.contestant.configuration.warnings)
            echo(f"dynabarn: {setup.wanted} flights on {processes_text(workers)}", err=True)
        results, interrupted = _fly(setup, workers, quiet)
    if not quiet:
        echo_lines(text(results, per_world), err=outputs.use_stdout)
    outputs.write("--json", json.dumps(to_json(results), indent=2, allow_nan=False))
    outputs.write("--csv", to_csv(results))
    sys.exit(EXIT_INTERRUPTED if interrupted else outputs.exit_status(EXIT_SUCCESS))


def _setup(
    parameters: Tuple[str, ...],
    only: str,
    interpolation: str,
    max_vel_x_mps: float,
    **given: Any,
) -> DynamicSetup:
    options = BarnOptions(
        **given, parameters=tuple(map(parameter, parameters)), only=world_numbers(only)
    )
    return read_dynamic_setup(options, interpolation, max_vel_x_mps)


def _fly(setup: DynamicSetup, workers: int, quiet: bool) -> Tuple[DynamicResults, bool]:
    """Return the results, and true if Ctrl-C interrupted the flights."""
    bar = OutcomesBar(setup.wanted, workers, quiet, "dynabarn")
    runs: List[DynamicRun] = []
    interrupted = False
    start_s = time.monotonic()
    raise_on_signals()
    try:
        with bar:
            warm_up(setup.contestant.configuration)  # compile once instead of in every worker
            simulate()
            bar.start()
            for run in fly_all(setup, workers):
                runs.append(run)
                bar.show(runs)
    except KeyboardInterrupt:
        interrupted = True
    runs.sort(key=lambda run: (run.world, run.run))
    wall_time_s = time.monotonic() - start_s
    return (
        DynamicResults(
            setup.contestant, setup.interpolation, tuple(runs), setup.wanted, wall_time_s
        ),
        interrupted,
    )
