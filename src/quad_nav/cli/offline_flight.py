"""Flight of ``quad fly``: set up, fly with a progress bar, print the table, write the outputs."""

from __future__ import annotations

import contextlib
import json
import shutil
import signal
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any, Callable, Dict, List, Mapping, Optional, Protocol, Sequence, Tuple

import yaml

from quad_nav.cli import EXIT_INTERRUPTED, add_ons
from quad_nav.cli.options import echo, echo_lines, exit_on_faults, parameter, show_warnings
from quad_nav.cli.outputs import HTML, Outputs
from quad_nav.cli.pictures import FlightPictures
from quad_nav.cli.progress import ProgressBar, clock, compile_kernels
from quad_nav.errors import InputError, PluginError
from quad_nav.files import plain_yaml
from quad_nav.files.shipped import shipped
from quad_nav.loop.worker_process import processes_for
from quad_nav.mission.flight_log import INTERRUPTED
from quad_nav.mission.summary import MissionSummary, to_json
from quad_nav.mission.summary_table import DEFAULT_WIDTH, table
from quad_nav.offline.flight import FlightObserver
from quad_nav.offline.run import fly as fly_setup
from quad_nav.scenario.flight_facts import offline_facts
from quad_nav.scenario.flight_setup import FlightOptions, FlightSetup, read_setup
from quad_nav.scenario.goal_plans import unreachable_goals
from quad_nav.scenario.rules import RULES, SIMULATOR
from quad_nav.sim.flight import AIRFRAMES
from quad_nav.sim.lidar import LidarParams
from quad_nav.sim.localization import LocalizationMaker
from quad_nav.sim.odometry import ERROR_NAMES, MAX_ERROR, OdometryErrors
from quad_nav.sim.simulation_params import SimulationParams

_TUTORIAL_ROBOTS = 2
_PAGE_OPTIONS = ("address", "port", "rate", "open_it")


class FlightPage(Protocol):
    """The page of an add-on that shows and steers flights."""

    interventions: List[str]

    def observer(self) -> FlightObserver:
        """Return what shows the next flight."""

    def show_result(self, summary: MissionSummary, report: Optional[Path]) -> None:
        """Show how the last flight has ended, and its report."""

    def wants_flight(self, is_interrupted: Callable[[], bool]) -> bool:
        """Wait until people want another flight; false if there will be none."""

    def close(self) -> None:
        """End the page."""


def fly_mission(
    json_path: Optional[Path],
    record: Optional[Path],
    report: Optional[Path],
    pictures: Optional[Path],
    animate: Optional[Path],
    quiet: bool,
    processes: Optional[int],
    web: bool,
    **given: Any,
) -> None:
    """Fly with the options of ``quad fly`` and exit with its status."""
    served, localization = {k: given.pop(k) for k in _PAGE_OPTIONS}, given.pop("localization")
    with exit_on_faults():
        outputs = Outputs(
            {"--json": json_path, "--report": report},
            {"--record": record, "--animate": animate},
            {"--pictures": pictures},
            quiet=quiet,
            suffixes={"--report": HTML},
        )
        options = replace(_options(**given), localization=_localization(localization))
        with clock("reading the mission", quiet):
            setup = read_setup(options)
        page = _page(served) if web else None
    _compile(setup, quiet)
    while True:
        with exit_on_faults():
            drawn = FlightPictures(setup, outputs)
            observers = _observers(record, localization)
            _show_warnings(setup, quiet)
            facts = offline_facts(options, setup, ["quad", *sys.argv[1:]])
            status = _fly(setup, facts, observers, outputs, drawn, quiet, processes, page)
        if page is None or status == EXIT_INTERRUPTED or not _is_wanted_again(page):
            break
        with exit_on_faults():
            setup = read_setup(options)  # the goal files may have changed
    _close(page)
    sys.exit(status)


def _close(page: Optional[FlightPage]) -> None:
    if page is not None:
        page.close()


def _show_warnings(setup: FlightSetup, quiet: bool) -> None:
    if quiet:
        return
    with clock("looking for plans", quiet=False):
        unreachable = unreachable_goals(setup)
    show_warnings((*setup.warnings, *unreachable))


def _compile(setup: FlightSetup, quiet: bool) -> None:
    """Compile the kernels; a plugin's mistake ends the flight later."""
    with contextlib.suppress(PluginError):
        compile_kernels(setup.configurations, quiet)


def _page(options: Mapping[str, Any]) -> FlightPage:
    page: FlightPage = add_ons.load("quad_web.cli.flight_page", "--web").FlightPage(**options)
    return page


def _is_wanted_again(page: FlightPage) -> bool:
    """Keep the page until Ctrl-C; return true if people want the flight again."""
    with _StopOnSignal() as stop:
        return page.wants_flight(lambda: bool(stop.stop_reason))


def _options(
    scan_range: float,
    beams: int,
    range_noise: float,
    jitter: float,
    lidar: str,
    airframe: str,
    odom_drift: str,
    **given: Any,
) -> FlightOptions:
    """Translate the command line's options."""
    beam_params = LidarParams(scan_range, scan_range / beams, noise_std_m=range_noise)
    simulation = SimulationParams(
        beam_params,
        airframe=AIRFRAMES[airframe],
        jitter_m=jitter,
        lidar_caster=lidar,
        odom_drift=_odometry_errors(odom_drift),
    )
    return mission_options(simulation=simulation, **given)


def _odometry_errors(text: str) -> OdometryErrors:
    """Parse "per_m=0.05,per_rad=0.05".

    Raises:
        InputError: The text has another form, or a value is out of range.
    """
    rule = RULES["odom_drift"]
    values: Any = None
    with contextlib.suppress(yaml.YAMLError):
        values = plain_yaml.load("{" + text.replace("=", ": ") + "}")
    if not rule.accepts(values):
        names = ", ".join(f"{name}=" for name in ERROR_NAMES)
        raise InputError(
            [
                f"--odom-drift {text}: expected any of {names} each with a number from 0 to"
                f" {MAX_ERROR:g}, such as per_m=0.05,per_rad=0.05"
            ]
        )
    return OdometryErrors.of(values)


def mission_options(parameters: Tuple[str, ...], **given: Any) -> FlightOptions:
    """Translate the options that ``quad fly`` and ``quad preview`` share.

    Without scene and goals, few quadcopters fly the shipped goals, and more a random mission.
    """
    options = FlightOptions(**given, parameters=tuple(map(parameter, parameters)))
    few = (options.robots or 0) <= _TUTORIAL_ROBOTS and not options.size_m
    if few and options.scene is None and options.goals is None:
        return replace(options, goals=shipped("goals"))
    return options


def _localization(name: str) -> Optional[LocalizationMaker]:
    """Return what finds the robots' places; None for the simulator, which knows them."""
    if name == SIMULATOR:
        return None
    maker: LocalizationMaker = _localizations().MAKERS[name]
    return maker


def _localizations() -> Any:
    return add_ons.load("quad_localization.offline", "--localization")


def _observers(record: Optional[Path], localization: str) -> List[FlightObserver]:
    """Create the recorder, which loads slowly, and what measures the errors of a localization."""
    observers: List[FlightObserver] = []
    if localization != SIMULATOR:
        observers.append(_localizations().LocalizationErrors())
    if record is not None:
        from quad_nav.recording.recorder import Recorder

        observers.append(Recorder(record))
    return observers


def _fly(
    setup: FlightSetup,
    facts: Mapping[str, Any],
    observers: Sequence[FlightObserver],
    outputs: Outputs,
    pictures: FlightPictures,
    quiet: bool,
    processes: Optional[int],
    page: Optional[FlightPage],
) -> int:
    processes = processes or processes_for(len(setup.robots))
    bar: List[FlightObserver] = [] if quiet else [ProgressBar()]
    bar += [] if page is None else [page.observer()]
    with _StopOnSignal() as stop:
        flown = _summary(setup, [*observers, *pictures.observers, *bar, stop], processes, quiet)
    interventions = () if page is None else tuple(page.interventions)
    for observer in observers:
        facts = {**facts, **observer.facts}
    summary = replace(flown, facts=facts, interventions=interventions)
    width = shutil.get_terminal_size((DEFAULT_WIDTH, 24)).columns
    overview = table(summary, width)
    if not quiet:
        echo_lines(overview, err=outputs.use_stdout)
    else:  # the table has the reason to end early, such as a recording on a full disk
        for line in filter(None, (observer.stop_reason for observer in observers)):
            echo(line, err=True)
    outputs.write("--json", json.dumps(to_json(summary), indent=2, allow_nan=False))
    for line in pictures.write(summary, overview if quiet else ""):
        if not quiet:
            echo(line, err=True)
    if page is not None:
        page.show_result(summary, outputs.path("--report"))
    if not any(observer.stop_reason for observer in observers):
        outputs.announce_file("--record")
    if summary.reason == INTERRUPTED:
        return EXIT_INTERRUPTED
    return outputs.exit_status(summary.exit_status)


def _summary(
    setup: FlightSetup, observers: Sequence[FlightObserver], processes: int, quiet: bool
) -> MissionSummary:
    """Fly; a plugin's mistake is the reason of the summary, and printed if no table is."""
    try:
        return fly_setup(setup, observers, processes)
    except PluginError as error:
        if error.summary is None:  # it cannot even be made
            raise
        if quiet:
            echo(error, err=True)
        summary: MissionSummary = error.summary
        return summary


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
