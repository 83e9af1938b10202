"""``quad fly``: the mission offline."""

from __future__ import annotations

import json
import math
import shutil
import signal
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any, Dict, List, Optional, Sequence, Tuple

import click

from quad_nav.cli import EXIT_BAD_INPUT, EXIT_INTERRUPTED
from quad_nav.cli.options import parameter
from quad_nav.cli.pictures import FlightPictures
from quad_nav.cli.progress import ProgressBar
from quad_nav.errors import InputError
from quad_nav.files.shipped import shipped
from quad_nav.mission.flight_log import INTERRUPTED
from quad_nav.mission.summary import to_json, write_json
from quad_nav.mission.summary_table import DEFAULT_WIDTH, table
from quad_nav.offline.flight import FlightObserver
from quad_nav.offline.run import fly as fly_setup
from quad_nav.offline.worker_process import processes_for
from quad_nav.scenario.flight_setup import FlightOptions, FlightSetup, read_setup
from quad_nav.sim.lidar import LidarParams
from quad_nav.sim.simulation import LIDAR_CASTERS, SimulationParams

_TUTORIAL_ROBOTS = 2
_A_FILE = click.Path(dir_okay=False, path_type=Path)
_LIVE = "live"
_POSITIVE = click.FloatRange(min=0.0, min_open=True)
_AMOUNT = click.FloatRange(min=0.0)


@click.command()
@click.option(
    "--scene",
    type=_A_FILE,
    help="Walls, obstacles and start poses. [default: the arena that comes with quad]",
)
@click.option(
    "--goals",
    type=click.Path(file_okay=False, path_type=Path),
    help="The folder with quad0_goals.json and so on. [default: the one that comes with quad]",
)
@click.option(
    "--config",
    default="default",
    show_default=True,
    metavar="NAME|FOLDER",
    help="move_base's parameters: 'default', 'tutorial' or a folder of yours.",
)
@click.option(
    "--set",
    "parameters",
    multiple=True,
    metavar="PATH=VALUE",
    help="A parameter on top of the folder's, as global_costmap/width=60; repeatable.",
)
@click.option(
    "--robots",
    type=click.IntRange(min=1),
    metavar="N",
    help="How many quadcopters. More than two, without --scene and --goals, get a mission"
    " at random. [default: as many as there are goal files]",
)
@click.option(
    "--size",
    "size_m",
    type=_AMOUNT,
    default=0.0,
    metavar="M",
    help="The side of a random mission's arena. [default: with room for all]",
)
@click.option(
    "--seed",
    type=click.IntRange(min=0),
    default=0,
    show_default=True,
    help="For the jitter and the noise; the same seed gives the same flight.",
)
@click.option(
    "--jitter",
    type=_AMOUNT,
    default=0.0,
    metavar="M",
    help="How far the start positions are displaced at random.",
)
@click.option(
    "--time-limit",
    "time_limit_s",
    type=_POSITIVE,
    default=math.inf,
    metavar="S",
    help="End after so many simulated seconds.",
)
@click.option(
    "--scan-range",
    type=_POSITIVE,
    default=2 * math.pi,
    metavar="RAD",
    help="The LIDAR's field of view. [default: all around]",
)
@click.option(
    "--beams", type=click.IntRange(min=2), default=512, show_default=True, help="Beams of a scan."
)
@click.option(
    "--lidar-rate",
    "scans_per_s",
    type=_POSITIVE,
    default=20.0,
    show_default=True,
    metavar="HZ",
    help="Scans per simulated second.",
)
@click.option(
    "--range-noise",
    type=_AMOUNT,
    default=0.0,
    metavar="M",
    help="Standard deviation of the LIDAR's ranges.",
)
@click.option(
    "--lidar",
    type=click.Choice(LIDAR_CASTERS),
    default="kernel",
    show_default=True,
    help="Who casts the beams: our kernel, or the physics engine.",
)
@click.option(
    "--processes",
    type=click.IntRange(min=1),
    metavar="N",
    help="Processes that share the navigators; the flight is the same. [default: one for"
    " ten quadcopters, as many as there are cores]",
)
@click.option(
    "--json",
    "json_path",
    type=click.Path(dir_okay=False, allow_dash=True),
    metavar="FILE",
    help="Write the summary there; - is the terminal.",
)
@click.option(
    "--record",
    type=_A_FILE,
    metavar="FILE.bag|FILE.mcap",
    help="Record the topics of the ROS face, for rosbag play and RViz.",
)
@click.option(
    "--view",
    is_flag=False,
    flag_value=_LIVE,
    metavar="[FILE.rrd]",
    help="Show the flight in rerun's 3D viewer as it is flown, or save it for that.",
)
@click.option(
    "--report", type=_A_FILE, metavar="FILE.html", help="Write a page with pictures of the flight."
)
@click.option(
    "--animate",
    type=_A_FILE,
    metavar="FILE",
    help="Write an animation: .gif, or .mp4 where there is ffmpeg.",
)
@click.option("--quiet", "-q", is_flag=True, help="No progress bar, no table.")
def fly(
    json_path: Optional[str],
    record: Optional[Path],
    view: Optional[str],
    report: Optional[Path],
    animate: Optional[Path],
    quiet: bool,
    processes: Optional[int],
    **given: Any,
) -> None:
    """Fly a mission without ROS, as fast as the machine can.

    Ctrl-C ends the flight and keeps what was flown.

    Exit status: 0 when every goal was reached and nothing touched, 1 otherwise, 2 for input that
    cannot be used, 130 after Ctrl-C.
    """
    try:
        setup = read_setup(_options(**given))
        pictures = FlightPictures(setup, report, animate)
        watchers = _watchers(record, view)
    except InputError as error:
        click.echo("nothing is flown:\n  " + "\n  ".join(error.problems), err=True)
        sys.exit(EXIT_BAD_INPUT)
    if not quiet:
        for warning in setup.warnings:
            click.echo(warning, err=True)
    processes = processes or processes_for(len(setup.robots))
    sys.exit(_fly(setup, watchers, json_path, pictures, quiet, processes))


def _options(
    scan_range: float,
    beams: int,
    range_noise: float,
    jitter: float,
    lidar: str,
    parameters: Tuple[str, ...],
    **given: Any,
) -> FlightOptions:
    """The options as a person gives them."""
    beam_params = LidarParams(scan_range, scan_range / beams, noise_std_m=range_noise)
    options = FlightOptions(
        **given,
        parameters=tuple(map(parameter, parameters)),
        simulation=SimulationParams(beam_params, jitter_m=jitter, lidar_caster=lidar),
    )
    few = (options.robots or 0) <= _TUTORIAL_ROBOTS and not options.size_m
    if few and options.scene is None and options.goals is None:
        return replace(options, goals=shipped("goals"))
    return options


def _watchers(record: Optional[Path], view: Optional[str]) -> List[FlightObserver]:
    """Imported here: who neither records nor looks need not wait for it."""
    watchers: List[FlightObserver] = []
    if record is not None:
        from quad_nav.recording.recorder import Recorder

        watchers.append(Recorder(record))
    if view is not None:
        from quad_nav.recording.viewer import View

        watchers.append(View(None if view == _LIVE else Path(view)))
    return watchers


def _fly(
    setup: FlightSetup,
    watchers: Sequence[FlightObserver],
    json_path: Optional[str],
    pictures: FlightPictures,
    quiet: bool,
    processes: int,
) -> int:
    observers = [*watchers, *pictures.observers]
    if not quiet:
        observers.append(ProgressBar())
    with _StopOnSignal() as stop:
        summary = fly_setup(setup, [*observers, stop], processes)
    to_terminal = json_path == "-"
    if not quiet:
        width = shutil.get_terminal_size((DEFAULT_WIDTH, 24)).columns
        click.echo(table(summary, width), err=to_terminal)
    if to_terminal:
        click.echo(json.dumps(to_json(summary), indent=2, allow_nan=False))
    elif json_path is not None:
        write_json(summary, json_path)
    for line in pictures.write(summary):
        click.echo(line, err=True)
    return EXIT_INTERRUPTED if summary.reason == INTERRUPTED else summary.exit_status


class _StopOnSignal(FlightObserver):
    """Stops the flight at SIGINT (Ctrl-C) or SIGTERM; a second signal ends the process."""

    def __init__(self) -> None:
        self._received = False
        self._handlers: Dict[int, Any] = {}

    @property
    def stop_reason(self) -> str:
        return INTERRUPTED if self._received else ""

    def __enter__(self) -> _StopOnSignal:
        for number in (signal.SIGINT, signal.SIGTERM):
            self._handlers[number] = signal.signal(number, self._receive)
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._handlers.items():
            signal.signal(number, handler)

    def _receive(self, number: int, _frame: object) -> None:
        self._received = True
        signal.signal(number, self._handlers[number])
