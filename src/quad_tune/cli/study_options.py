"""Options that ``quad tune`` and ``quad sweep`` share; ``study_course`` reads them."""

from __future__ import annotations

import math
from typing import Any, Callable, TypeVar

import click

from quad_nav.cli.options import (
    A_FILE,
    A_FOLDER,
    AMOUNT,
    CONFIGURATIONS,
    COUNT,
    POSITIVE,
    Integer,
)

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
        help=f"Base configuration of move_base: {CONFIGURATIONS}. [default: 'default', with"
        " --worlds 'barn']",
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
        type=Integer(min=2),
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
        type=Integer(min=0),
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
