"""What `quad tune` and `quad sweep` have in common on the command line."""

from __future__ import annotations

import math
import sys
from contextlib import contextmanager
from itertools import zip_longest
from pathlib import Path
from typing import Any, Callable, Iterator, Optional, Sequence, Tuple, TypeVar, Union

import click

from quad_nav.barn.setup import BarnOptions
from quad_nav.cli import EXIT_BAD_INPUT, EXIT_FAILURE
from quad_nav.cli.options import parameter
from quad_nav.errors import InputError, QuadError
from quad_nav.files.shipped import config_folder, shipped
from quad_nav.offline.workers import LocalWorkers, RayWorkers, Workers
from quad_nav.scenario.warm_up import simulate, warm_up
from quad_nav.sim.lidar import LidarParams
from quad_nav.sim.simulation import SimulationParams
from quad_nav.tuning.courses import Mission, MissionOptions
from quad_nav.tuning.evaluation import Course
from quad_nav.tuning.parameter_files import base_configuration

F = TypeVar("F", bound=Callable[..., Any])

A_FILE = click.Path(dir_okay=False, path_type=Path)
A_FOLDER = click.Path(file_okay=False, path_type=Path)
POSITIVE = click.FloatRange(min=0.0, min_open=True)
AMOUNT = click.FloatRange(min=0.0)
COUNT = click.IntRange(min=1)

_FLOWN = (
    click.option(
        "--scene",
        "scenes",
        type=A_FILE,
        multiple=True,
        help="Walls, obstacles and start"
        " poses; repeatable, each with its --goals. [default: the arena that comes with"
        " quad]",
    ),
    click.option(
        "--goals",
        type=A_FOLDER,
        multiple=True,
        help="The folder with quad0_goals.json"
        " and so on; repeatable. [default: the one that comes with quad]",
    ),
    click.option(
        "--random",
        "is_random",
        is_flag=True,
        help="Missions at random too, another one for each seed.",
    ),
    click.option(
        "--worlds", type=A_FILE, help="Fly through BARN's worlds instead, from this .npz."
    ),
    click.option(
        "--config",
        metavar="NAME|FOLDER",
        help="The base: move_base's parameters. [default: 'default', with --worlds 'barn']",
    ),
    click.option(
        "--set",
        "parameters",
        multiple=True,
        metavar="PATH=VALUE",
        help="A parameter on top of the base, which stays as it is; repeatable.",
    ),
    click.option(
        "--robots",
        type=COUNT,
        metavar="N",
        help="How many quadcopters. [default: as many as there are goal files]",
    ),
    click.option(
        "--size",
        "size_m",
        type=AMOUNT,
        default=0.0,
        metavar="M",
        help="The side of a random mission's arena. [default: with room for all]",
    ),
    click.option(
        "--jitter",
        type=AMOUNT,
        default=0.3,
        show_default=True,
        metavar="M",
        help="How far the start positions are displaced at random.",
    ),
    click.option(
        "--time-limit",
        "time_limit_s",
        type=POSITIVE,
        default=300.0,
        show_default=True,
        metavar="S",
        help="A mission that takes longer has failed.",
    ),
    click.option(
        "--scan-range",
        type=POSITIVE,
        default=2 * math.pi,
        metavar="RAD",
        help="The LIDAR's field of view. [default: all around]",
    ),
    click.option(
        "--beams",
        type=click.IntRange(min=2),
        default=512,
        show_default=True,
        help="Beams of a scan.",
    ),
    click.option(
        "--lidar-rate",
        "scans_per_s",
        type=POSITIVE,
        default=20.0,
        show_default=True,
        metavar="HZ",
        help="Scans per simulated second.",
    ),
    click.option(
        "--range-noise",
        type=AMOUNT,
        default=0.0,
        metavar="M",
        help="Standard deviation of the LIDAR's ranges.",
    ),
    click.option(
        "--body-radius",
        "body_radius_m",
        default=0.20,
        show_default=True,
        metavar="M",
        type=POSITIVE,
        help="The quadcopter's in BARN's worlds.",
    ),
    click.option(
        "--seed",
        type=click.IntRange(min=0),
        default=0,
        show_default=True,
        help="The same seed gives the same figures.",
    ),
)
_WORKERS = (
    click.option(
        "--workers",
        type=COUNT,
        metavar="N",
        help="Flights at the same time. [default: as many as there are cores]",
    ),
    click.option(
        "--ray",
        "ray_address",
        metavar="ADDRESS",
        help="Fly on the Ray cluster there:"
        " needs pip install 'quad-nav[ray]', here and on the cluster.",
    ),
)


def flown_options(command: F) -> F:
    """Adds the options that say what is flown; ``course_of`` reads them."""
    for option in reversed(_FLOWN):
        command = option(command)
    return command


def worker_options(command: F) -> F:
    """Adds the options that say who flies; ``workers_of`` reads them."""
    for option in reversed(_WORKERS):
        command = option(command)
    return command


def course_of(
    scenes: Tuple[Path, ...],
    goals: Tuple[Path, ...],
    is_random: bool,
    worlds: Optional[Path],
    config: Optional[str],
    parameters: Tuple[str, ...],
    seed: int,
    body_radius_m: float,
    held_out: Tuple[Mission, ...] = (),
    **given: Any,
) -> Union[MissionOptions, BarnOptions]:
    """What is flown, not yet read.

    Raises:
        InputError: options that do not go together.
    """
    fixed = tuple(map(parameter, parameters))
    if worlds is not None:
        if scenes or goals or is_random or held_out or given["robots"]:
            raise InputError(
                [
                    "--worlds: goes without --scene, --goals, --random, --robots and "
                    "what is held out by name"
                ]
            )
        return BarnOptions(worlds, config or "barn", fixed, seed=seed, body_radius_m=body_radius_m)
    missions = missions_of(scenes, goals, "")
    if is_random:
        missions += (Mission(),)
    elif not missions:
        missions = (Mission(None, shipped("goals")),)
    return _mission_options(missions, held_out, config or "default", fixed, seed, **given)


def missions_of(scenes: Sequence[Path], goals: Sequence[Path], prefix: str) -> Tuple[Mission, ...]:
    """Scenes and goals in pairs; one alone goes with what comes with quad.

    Raises:
        InputError: there are several, and not as many of both.
    """
    if len(scenes) != len(goals) and min(len(scenes), len(goals)) > 0:
        raise InputError(
            [
                f"--{prefix}scene, --{prefix}goals: {len(scenes)} and {len(goals)} of "
                "them; expected a folder of goals for each scene"
            ]
        )
    return tuple(
        Mission(scene, folder or shipped("goals")) for scene, folder in zip_longest(scenes, goals)
    )


def workers_of(workers: Optional[int], ray_address: Optional[str]) -> Workers:
    """Who flies.

    Raises:
        InputError: there is no such cluster.
    """
    return LocalWorkers(workers) if ray_address is None else RayWorkers(ray_address, workers)


def compile_kernels(course: Course) -> None:
    """Once, and not in every worker at once."""
    warm_up(base_configuration(config_folder(course.config), course.fixed))
    simulate()


@contextmanager
def faults_told() -> Iterator[None]:
    """Ends the command with the right status for what went wrong, each fault on a line."""
    try:
        yield
    except InputError as error:
        click.echo("nothing is flown:\n  " + "\n  ".join(error.problems), err=True)
        sys.exit(EXIT_BAD_INPUT)
    except QuadError as error:
        click.echo(str(error), err=True)
        sys.exit(EXIT_FAILURE)


def _mission_options(
    missions: Tuple[Mission, ...],
    held_out: Tuple[Mission, ...],
    config: str,
    fixed: Tuple[Tuple[str, Any], ...],
    seed: int,
    scan_range: float,
    beams: int,
    range_noise: float,
    jitter: float,
    **given: Any,
) -> MissionOptions:
    lidar = LidarParams(scan_range, scan_range / beams, noise_std_m=range_noise)
    return MissionOptions(
        missions,
        held_out,
        config,
        fixed,
        seed=seed,
        **given,
        simulation=SimulationParams(lidar, jitter_m=jitter),
    )
