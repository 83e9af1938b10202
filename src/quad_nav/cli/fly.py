"""``quad fly``: fly a mission offline."""

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

from quad_nav.cli import EXIT_INTERRUPTED
from quad_nav.cli.options import echo, echo_lines, exit_on_faults, parameter, show_warnings
from quad_nav.cli.outputs import OUTPUT, Outputs
from quad_nav.cli.pictures import FlightPictures
from quad_nav.cli.progress import ProgressBar
from quad_nav.files.shipped import shipped
from quad_nav.mission.flight_log import INTERRUPTED
from quad_nav.mission.summary import to_json
from quad_nav.mission.summary_table import DEFAULT_WIDTH, table
from quad_nav.offline.flight import FlightObserver
from quad_nav.offline.run import fly as fly_setup
from quad_nav.offline.worker_process import processes_for
from quad_nav.scenario.flight_setup import FlightOptions, FlightSetup, read_setup
from quad_nav.sim.lidar import LidarParams
from quad_nav.sim.odometry import MAX_DRIFT, OdomDrift
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
    help="Scene file: walls, obstacles and start poses. [default: the shipped arena]",
)
@click.option(
    "--goals",
    type=click.Path(file_okay=False, path_type=Path),
    help="Folder with quad0_goals.json and so on. [default: the shipped goals]",
)
@click.option(
    "--config",
    default="default",
    show_default=True,
    metavar="NAME|FOLDER",
    help="Configuration of move_base: 'default', 'tutorial' or a folder of YAML files.",
)
@click.option(
    "--set",
    "parameters",
    multiple=True,
    metavar="PATH=VALUE",
    help="Set a parameter on top of --config, as global_costmap/width=60; repeatable.",
)
@click.option(
    "--robots",
    type=click.IntRange(min=1),
    metavar="N",
    help="Number of quadcopters. More than two without --scene and --goals fly a random mission."
    " [default: one for each goal file]",
)
@click.option(
    "--size",
    "size_m",
    type=_AMOUNT,
    default=0.0,
    metavar="M",
    help="Side of a random mission's arena. [default: large enough for all quadcopters]",
)
@click.option(
    "--seed",
    type=click.IntRange(min=0),
    default=0,
    show_default=True,
    help="Seed of jitter, noise, drift and random missions; the same seed gives the same flight.",
)
@click.option(
    "--jitter",
    type=_AMOUNT,
    default=0.0,
    metavar="M",
    help="Displace each start position at random, by at most this distance.",
)
@click.option(
    "--time-limit",
    "time_limit_s",
    type=_POSITIVE,
    default=math.inf,
    metavar="S",
    help="End the flight after this simulated time.",
)
@click.option(
    "--scan-range",
    type=_POSITIVE,
    default=2 * math.pi,
    metavar="RAD",
    help="Field of view of the LIDARs. [default: 2 pi]",
)
@click.option(
    "--beams", type=click.IntRange(min=2), default=512, show_default=True, help="Beams per scan."
)
@click.option(
    "--lidar-rate",
    "scans_per_s",
    type=_POSITIVE,
    default=20.0,
    show_default=True,
    metavar="HZ",
    help="Scan rate, in simulated time.",
)
@click.option(
    "--range-noise",
    type=_AMOUNT,
    default=0.0,
    metavar="M",
    help="Standard deviation of the LIDARs' range noise.",
)
@click.option(
    "--odom-drift",
    nargs=2,
    type=click.FloatRange(0.0, MAX_DRIFT),
    default=(0.0, 0.0),
    metavar="M/S RAD/S",
    help="Speeds at which each robot's frame odom{i} drifts and turns in map. [default: none]",
)
@click.option(
    "--lidar",
    type=click.Choice(LIDAR_CASTERS),
    default="kernel",
    show_default=True,
    help="Cast the beams with the numba kernel or with the physics engine.",
)
@click.option(
    "--processes",
    type=click.IntRange(min=1),
    metavar="N",
    help="Processes that share the navigators; the flight does not depend on it. [default: one"
    " for each ten quadcopters, at most one per core]",
)
@click.option(
    "--json",
    "json_path",
    type=OUTPUT,
    metavar="FILE",
    help="Write the summary as JSON; - is standard output.",
)
@click.option(
    "--record",
    type=_A_FILE,
    metavar="FILE.bag|FILE.mcap",
    help="Record the ROS topics, for rosbag play and RViz.",
)
@click.option(
    "--view",
    is_flag=False,
    flag_value=_LIVE,
    metavar="[FILE.rrd]",
    help="Show the flight live in rerun's 3D viewer, or save it for the viewer.",
)
@click.option(
    "--report",
    type=_A_FILE,
    metavar="FILE.html",
    help="Write a report with pictures of the flight.",
)
@click.option(
    "--animate",
    type=_A_FILE,
    metavar="FILE",
    help="Write an animation: .gif, or .mp4 if ffmpeg is installed.",
)
@click.option("--quiet", "-q", is_flag=True, help="Show no progress bar and no table.")
def fly(
    json_path: Optional[Path],
    record: Optional[Path],
    view: Optional[str],
    report: Optional[Path],
    animate: Optional[Path],
    quiet: bool,
    processes: Optional[int],
    **given: Any,
) -> None:
    """Fly a mission without ROS, as fast as the machine allows.

    Ctrl-C ends the flight; summary, recording and report cover the part that was flown.

    Exit status: 0 if every goal was reached without a contact, 1 otherwise, 2 for faulty input,
    130 after Ctrl-C.
    """
    with exit_on_faults():
        saved_view = None if view in (None, _LIVE) else Path(view)
        outputs = Outputs(
            {"--json": json_path, "--report": report},
            {"--record": record, "--view": saved_view, "--animate": animate},
        )
        setup = read_setup(_options(**given))
        pictures = FlightPictures(setup, report, animate)
        observers = _observers(record, view)
    if not quiet:
        show_warnings(setup.warnings)
    processes = processes or processes_for(len(setup.robots))
    sys.exit(_fly(setup, observers, outputs, pictures, quiet, processes))


def _options(
    scan_range: float,
    beams: int,
    range_noise: float,
    jitter: float,
    lidar: str,
    odom_drift: Tuple[float, float],
    parameters: Tuple[str, ...],
    **given: Any,
) -> FlightOptions:
    """Translate the command line's options."""
    beam_params = LidarParams(scan_range, scan_range / beams, noise_std_m=range_noise)
    options = FlightOptions(
        **given,
        parameters=tuple(map(parameter, parameters)),
        simulation=SimulationParams(
            beam_params, jitter_m=jitter, lidar_caster=lidar, odom_drift=OdomDrift(*odom_drift)
        ),
    )
    few = (options.robots or 0) <= _TUTORIAL_ROBOTS and not options.size_m
    if few and options.scene is None and options.goals is None:
        return replace(options, goals=shipped("goals"))
    return options


def _observers(record: Optional[Path], view: Optional[str]) -> List[FlightObserver]:
    """Create recorder and viewer; imported here, because both load slowly."""
    observers: List[FlightObserver] = []
    if view is not None:
        from quad_nav.recording.viewer import View

        observers.append(View(None if view == _LIVE else Path(view)))
    if record is not None:  # last: it leaves an unfinished file if another cannot be created
        from quad_nav.recording.recorder import Recorder

        observers.append(Recorder(record))
    return observers


def _fly(
    setup: FlightSetup,
    observers: Sequence[FlightObserver],
    outputs: Outputs,
    pictures: FlightPictures,
    quiet: bool,
    processes: int,
) -> int:
    bar = [] if quiet else [ProgressBar()]
    with _StopOnSignal() as stop:
        summary = fly_setup(setup, [*observers, *pictures.observers, *bar, stop], processes)
    width = shutil.get_terminal_size((DEFAULT_WIDTH, 24)).columns
    overview = table(summary, width)
    if not quiet:
        echo_lines(overview, err=outputs.use_stdout)
    else:  # the table has the reason to end early, such as a recording on a full disk
        for line in filter(None, (observer.stop_reason for observer in observers)):
            echo(line, err=True)
    outputs.write("--json", json.dumps(to_json(summary), indent=2, allow_nan=False))
    for line in pictures.write(summary, outputs, overview if quiet else ""):
        echo(line, err=True)
    if summary.reason == INTERRUPTED:
        return EXIT_INTERRUPTED
    return outputs.exit_status(summary.exit_status)


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
