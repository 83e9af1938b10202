"""Options that ``quad tune`` and ``quad sweep`` share."""

from __future__ import annotations

import math
from itertools import zip_longest
from pathlib import Path
from typing import Any, Callable, Optional, Sequence, Tuple, TypeVar, Union

import click

from quad_nav.barn.setup import BarnOptions
from quad_nav.cli.options import A_FILE, A_FOLDER, AMOUNT, COUNT, POSITIVE, parameter
from quad_nav.errors import InputError
from quad_nav.files.shipped import shipped
from quad_nav.offline.workers import LocalWorkers, RayWorkers, Workers
from quad_nav.sim.lidar import LidarParams
from quad_nav.sim.simulation import SimulationParams
from quad_nav.tuning.courses import Mission, MissionOptions

F = TypeVar("F", bound=Callable[..., Any])


_FLOWN = (
    click.option(
        "--scene",
        "scenes",
        type=A_FILE,
        multiple=True,
        help="Scene with walls, obstacles and start poses; repeatable, each with its --goals."
        " [default: the shipped arena]",
    ),
    click.option(
        "--goals",
        type=A_FOLDER,
        multiple=True,
        help="Folder with quad0_goals.json, ...; repeatable. [default: the shipped goals]",
    ),
    click.option(
        "--random",
        "is_random",
        is_flag=True,
        help="Also fly random missions, another one for each seed.",
    ),
    click.option(
        "--worlds", type=A_FILE, help="Fly through BARN's worlds from this .npz file instead."
    ),
    click.option(
        "--config",
        metavar="NAME|FOLDER",
        help="Base configuration: move_base's parameters. [default: 'default', with --worlds"
        " 'barn']",
    ),
    click.option(
        "--set",
        "parameters",
        multiple=True,
        metavar="PATH=VALUE",
        help="Override a parameter of the base; it is not searched; repeatable.",
    ),
    click.option(
        "--robots",
        type=COUNT,
        metavar="N",
        help="Number of quadcopters. [default: number of goal files]",
    ),
    click.option(
        "--size",
        "size_m",
        type=AMOUNT,
        default=0.0,
        metavar="M",
        help="Side of a random mission's arena. [default: chosen by the number of robots]",
    ),
    click.option(
        "--jitter",
        type=AMOUNT,
        default=0.3,
        show_default=True,
        metavar="M",
        help="Maximum random displacement of the start positions.",
    ),
    click.option(
        "--time-limit",
        "time_limit_s",
        type=POSITIVE,
        default=300.0,
        show_default=True,
        metavar="S",
        help="Simulated time after which a mission fails.",
    ),
    click.option(
        "--scan-range",
        type=POSITIVE,
        default=2 * math.pi,
        metavar="RAD",
        help="Field of view of the LIDAR. [default: 2 pi]",
    ),
    click.option(
        "--beams",
        type=click.IntRange(min=2),
        default=512,
        show_default=True,
        help="Number of beams of a scan.",
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
        help="Standard deviation of the LIDAR's noise.",
    ),
    click.option(
        "--body-radius",
        "body_radius_m",
        default=0.20,
        show_default=True,
        metavar="M",
        type=POSITIVE,
        help="Radius of the quadcopter in BARN's worlds.",
    ),
    click.option(
        "--seed",
        type=click.IntRange(min=0),
        default=0,
        show_default=True,
        help="Random seed; equal seeds give equal results.",
    ),
)
_WORKERS = (
    click.option(
        "--workers",
        type=COUNT,
        metavar="N",
        help="Flights at the same time. [default: number of cores]",
    ),
    click.option(
        "--ray",
        "ray_address",
        metavar="ADDRESS",
        help="Fly on the Ray cluster at this address. Needs pip install 'quad-nav[ray]' here and"
        " on the cluster.",
    ),
)


def flown_options(command: F) -> F:
    """Add the options of the flights to a command; ``course_of`` reads them."""
    for option in reversed(_FLOWN):
        command = option(command)
    return command


def worker_options(command: F) -> F:
    """Add the options of the workers to a command; ``workers_of`` reads them."""
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
    """Convert the options to a course, without reading its files.

    Raises:
        InputError: The options cannot be combined.
    """
    fixed = tuple(map(parameter, parameters))
    if worlds is not None:
        if scenes or goals or is_random or held_out or given["robots"]:
            raise InputError(
                [
                    "--worlds: cannot be combined with --scene, --goals, --random, --robots and "
                    "held-out missions"
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
    """Pair scenes and goals; a single one is paired with the shipped counterpart.

    Raises:
        InputError: The numbers of scenes and goals differ.
    """
    if len(scenes) != len(goals) and min(len(scenes), len(goals)) > 0:
        raise InputError(
            [
                f"--{prefix}scene, --{prefix}goals: {len(scenes)} scenes and {len(goals)} "
                "folders of goals; expected a folder of goals for each scene"
            ]
        )
    return tuple(
        Mission(scene, folder or shipped("goals")) for scene, folder in zip_longest(scenes, goals)
    )


def workers_of(workers: Optional[int], ray_address: Optional[str]) -> Workers:
    """Create the workers.

    Raises:
        InputError: The Ray cluster does not exist.
    """
    return LocalWorkers(workers) if ray_address is None else RayWorkers(ray_address, workers)


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
