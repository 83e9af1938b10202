"""Options that ``quad barn``, ``quad dynabarn`` and ``quad circle`` share."""

from __future__ import annotations

from typing import Any, Callable, TypeVar

import click

from quad_nav.cli.options import A_FILE, COUNT, OUTPUT, POSITIVE, Integer

F = TypeVar("F", bound=Callable[..., Any])

_CONFIGURATION = (
    click.option(
        "--set",
        "parameters",
        multiple=True,
        metavar="PATH=VALUE",
        help="Override a parameter, for example global_costmap/width=60; repeatable.",
    ),
)
_FLIGHTS = (
    click.option(
        "--runs",
        type=COUNT,
        default=1,
        show_default=True,
        metavar="N",
        help="Flights of each kind, with seeds counted up from --seed.",
    ),
    click.option(
        "--seed",
        type=Integer(min=0),
        default=0,
        show_default=True,
        help="Seed of what is random; equal seeds give equal results.",
    ),
    click.option(
        "--workers",
        "processes",
        type=COUNT,
        metavar="N",
        help="Flights at the same time.  [default: number of cores]",
    ),
    click.option(
        "--json",
        "json_path",
        type=OUTPUT,
        metavar="FILE",
        help="Write statistics and flights to this file; - is the terminal.",
    ),
    click.option(
        "--csv",
        "csv_path",
        type=OUTPUT,
        metavar="FILE",
        help="Write a row for each flight to this file.",
    ),
    click.option("--quiet", "-q", is_flag=True, help="Show neither progress bar nor table."),
)


def world_options(benchmark: str, config: str) -> Callable[[F], F]:
    """Return a decorator that adds the options of a benchmark with worlds.

    Args:
        benchmark: Its name, and that of its page in ``docs/``.
        config: Its default configuration.
    """
    options = (
        click.option(
            "--worlds",
            required=True,
            type=A_FILE,
            help=f"File with the worlds (.npz), see docs/{benchmark}.md.",
        ),
        click.option(
            "--config",
            default=config,
            show_default=True,
            metavar="NAME|FOLDER",
            help="move_base's parameters: a shipped configuration or a folder, as the challenge's.",
        ),
        click.option(
            "--only",
            metavar="NUMBERS",
            default="",
            help="Fly only these worlds, for example 0,6,12.",
        ),
        click.option("--per-world", is_flag=True, help="Print a row for each world."),
    )
    return lambda command: _with(command, options)


def flight_options(command: F) -> F:
    """Add the options of many flights with one configuration."""
    return _with(command, (*_CONFIGURATION, *_FLIGHTS))


def body_radius_option(radius_m: float) -> Callable[[F], F]:
    """Return the option of the quadcopters' radius, with this default."""
    return click.option(
        "--body-radius",
        "body_radius_m",
        default=radius_m,
        show_default=True,
        metavar="M",
        type=POSITIVE,
        help="Radius of the quadcopters.",
    )


def _with(command: F, options: Any) -> F:
    for option in reversed(options):
        command = option(command)
    return command
