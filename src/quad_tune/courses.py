"""Missions that candidates fly, in the search and held out from it."""

from __future__ import annotations

import hashlib
import json
import math
from abc import ABC, abstractmethod
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, ClassVar, Dict, List, Mapping, Optional, Protocol, Sequence, Tuple

from quad_nav.config.sources import source_paths
from quad_nav.errors import InputError
from quad_nav.mission.robot_goals import WatchedGoalFile
from quad_nav.scenario import RANDOM
from quad_nav.scenario.flight_setup import FlightOptions, FlightSetup, read_setup
from quad_nav.sim.simulation_params import SimulationParams
from quad_tune.flight_result import FlightResult
from quad_tune.space import Assignments, costmap_paths

HELD_OUT_SEED = 1_000_000
"""Offset of the seeds of held-out flights."""
LIDAR = "lidar"
_LIDAR_FIELDS = {"range": "range_max_m", "noise": "noise_std_m"}


@dataclass(frozen=True)
class Case:
    """Flight that every candidate flies: a mission, by number and name, and a seed."""

    course: int
    name: str
    seed: int


@dataclass(frozen=True)
class ProtocolStatistics:
    """Statistics of flights by the protocol of a benchmark.

    Attributes:
        benchmark: Its name.
        columns: Headings.
        cells: A row of the table, a cell for each column.
        data: The same as plain JSON.
    """

    benchmark: str
    columns: Tuple[str, ...]
    cells: Tuple[str, ...]
    data: Dict[str, Any]


class Course(ABC):
    """Set of flights that every candidate flies.

    Attributes:
        ends_at_contact: Whether a flight ends at its first contact.
        config: Name or folder of the base configuration.
        fixed: Parameters on top of the base.
    """

    ends_at_contact = False

    def __init__(self, config: str, fixed: Tuple[Tuple[str, Any], ...]) -> None:
        self.config, self.fixed = config, fixed

    @abstractmethod
    def search_cases(self, count: int) -> Tuple[Case, ...]:
        """Return the first flights of the search."""

    @abstractmethod
    def held_out_cases(self, count: int) -> Tuple[Case, ...]:
        """Return flights that the search never flies."""

    @abstractmethod
    def setup(self, case: Case, assignments: Assignments) -> FlightSetup:
        """Build a flight with parameters on top of the base.

        Raises:
            InputError: The parameters are invalid.
        """

    @abstractmethod
    def identity(self) -> Dict[str, Any]:
        """Return what flights depend on besides candidate and case, as plain JSON."""

    def protocol_statistics(
        self, cases: Sequence[Case], flights: Sequence[FlightResult]
    ) -> Optional[ProtocolStatistics]:
        """Return statistics by the course's own protocol, None if it has none."""
        return None


class CourseOptions(Protocol):
    """Options of a course, not yet checked: a dataclass with these fields at least."""

    @property
    def config(self) -> str:
        """Name or folder of the base configuration."""

    @property
    def parameters(self) -> Tuple[Tuple[str, Any], ...]:
        """(path, value) pairs on top of the base."""

    @property
    def space(self) -> str:
        """File in ``spaces/`` with the parameters that a search changes by default."""

    def with_config(self, name: str) -> CourseOptions:
        """Return the same course with another base and no parameters on top."""

    def read(self) -> Tuple[Course, Sequence[str]]:
        """Create the course and return it with its warnings.

        Raises:
            InputError: Lists every fault.
        """


@dataclass(frozen=True)
class Mission:
    """Scene with goals. Without both, a random mission, another one for each seed."""

    scene: Optional[Path] = None
    goals: Optional[Path] = None

    @property
    def is_random(self) -> bool:
        """True for random missions."""
        return self.scene is None and self.goals is None

    @property
    def name(self) -> str:
        """Files of the mission, or "random"."""
        if self.is_random:
            return RANDOM
        return " + ".join(str(path) for path in (self.scene, self.goals) if path is not None)


@dataclass(frozen=True)
class MissionOptions:
    """Options of a course of missions.

    Attributes:
        missions: Missions of the search.
        held_out: Missions that the search never flies; if empty, those of the search, with other
            seeds.
        config: Name or folder of the base configuration.
        parameters: (path, value) pairs on top of the base, not searched.
        robots: Number of robots, or None for as many as there are goal files.
        size_m: Side of a random mission's arena, 0 for automatic.
        seed: First seed.
        time_limit_s: Time limit of a flight.
        scans_per_s: Scans per simulated second.
        simulation: Parameters of the simulation.
    """

    missions: Tuple[Mission, ...]
    held_out: Tuple[Mission, ...] = ()
    config: str = "default"
    parameters: Tuple[Tuple[str, Any], ...] = ()
    robots: Optional[int] = None
    size_m: float = 0.0
    seed: int = 0
    time_limit_s: float = 300.0
    scans_per_s: float = 20.0
    simulation: SimulationParams = SimulationParams(jitter_m=0.3)

    space: ClassVar[str] = "default.yaml"

    def with_config(self, name: str) -> MissionOptions:
        """Return the same course with another base and no parameters on top."""
        return replace(self, config=name, parameters=())

    def read(self) -> Tuple[MissionCourse, List[str]]:
        """Check every mission; return the course and its warnings.

        Raises:
            InputError: Lists every fault.
        """
        return MissionCourse(self), check_missions(self)


class MissionCourse(Course):
    """Missions with start positions and noise from the seed, equal for every candidate."""

    def __init__(self, options: MissionOptions) -> None:
        super().__init__(options.config, options.parameters)
        self.options = options
        self._missions = (*options.missions, *options.held_out)

    def search_cases(self, count: int) -> Tuple[Case, ...]:
        """Return this many flights, in turn through the missions of the search."""
        return _cases(self._missions, range(len(self.options.missions)), self.options.seed, count)

    def held_out_cases(self, count: int) -> Tuple[Case, ...]:
        """Return this many flights with seeds, and missions if given, held out."""
        first = len(self.options.missions) if self.options.held_out else 0
        last = len(self._missions)
        return _cases(self._missions, range(first, last), self.options.seed + HELD_OUT_SEED, count)

    def setup(self, case: Case, assignments: Assignments) -> FlightSetup:
        """Read a flight from its files.

        Raises:
            InputError: The parameters are invalid, or the files cannot be read.
        """
        mission, given = self._missions[case.course], self.options
        world, parameters = _split(assignments)
        options = FlightOptions(
            mission.scene,
            mission.goals,
            given.config,
            (*_single(given.parameters), *parameters),
            given.robots,
            case.seed,
            given.size_m,
            given.time_limit_s,
            given.scans_per_s,
            _simulation(given.simulation, world),
            strict=not assignments,  # a candidate may choose a planner, and set another one's
        )
        return _without_files(read_setup(options))

    def identity(self) -> Dict[str, Any]:
        """Return what flights depend on besides candidate and case, as plain JSON."""
        given = self.options
        return {
            "config": {"name": given.config, "files": files_digest(*source_paths(given.config))},
            "parameters": dict(given.parameters),
            "missions": [_described(mission) for mission in given.missions],
            "held_out": [_described(mission) for mission in given.held_out],
            "robots": given.robots,
            "size_m": given.size_m,
            "time_limit_s": given.time_limit_s,
            "scans_per_s": given.scans_per_s,
            "simulation": asdict(given.simulation),
        }


def check_missions(options: MissionOptions) -> List[str]:
    """Check the files and parameters of all missions and return the warnings.

    Raises:
        InputError: Lists every fault.
    """
    course = MissionCourse(options)
    problems: List[str] = []
    warnings: List[str] = []
    twice = set(options.missions) & set(options.held_out)
    problems += [
        f"held out: {mission.name} is also a mission of the search; expected another mission"
        for mission in twice
        if not mission.is_random
    ]
    if options.seed >= HELD_OUT_SEED:
        problems.append(
            f"seed: {options.seed}, expected less than {HELD_OUT_SEED}, the first held-out seed"
        )
    cases = [
        *course.search_cases(len(options.missions)),
        *course.held_out_cases(max(len(options.held_out), 1)),
    ]
    for case in cases:
        try:
            warnings += course.setup(case, ()).warnings
        except InputError as error:
            problems += error.problems
    if problems:
        raise InputError(list(dict.fromkeys(problems)))
    return list(dict.fromkeys(warnings))


def files_digest(*paths: Path) -> str:
    """Return a digest of files, or of the YAML and JSON files in folders, with names."""
    digest = hashlib.sha256()
    for path in paths:
        files = (
            [path]
            if path.is_file()
            else sorted(entry for pattern in ("*.yaml", "*.json") for entry in path.glob(pattern))
        )
        for file in files:
            digest.update(file.name.encode() + b"\0" + file.read_bytes() + b"\0")
    return digest.hexdigest()[:16]


def _cases(
    missions: Sequence[Mission], numbers: Sequence[int], seed: int, count: int
) -> Tuple[Case, ...]:
    among = len(numbers)
    return tuple(
        Case(numbers[k % among], missions[numbers[k % among]].name, seed + k // among)
        for k in range(count)
    )


def _described(mission: Mission) -> Dict[str, str]:
    paths = [path for path in (mission.scene, mission.goals) if path is not None]
    return {"name": mission.name, "files": files_digest(*paths)}


def _split(assignments: Assignments) -> Tuple[Dict[str, Any], Assignments]:
    """Split assignments into values of the LIDAR, by name, and parameters of move_base."""
    world = {
        path.split("/", 1)[1]: value for path, value in assignments if path.startswith(f"{LIDAR}/")
    }
    return world, tuple(pair for pair in assignments if not pair[0].startswith(f"{LIDAR}/"))


def _single(parameters: Sequence[Tuple[str, Any]]) -> Assignments:
    return tuple((single, value) for path, value in parameters for single in costmap_paths(path))


def _simulation(simulation: SimulationParams, world: Mapping[str, Any]) -> SimulationParams:
    """Replace the LIDAR's values.

    ``lidar/range`` and ``lidar/noise`` are in metres, ``lidar/scan_range`` in radians.
    """
    lidar = simulation.lidar
    for name, value in world.items():
        if name not in (*_LIDAR_FIELDS, "scan_range", "beams"):
            raise InputError(
                [
                    f"{LIDAR}/{name}: unknown; expected {LIDAR}/range, {LIDAR}/noise, "
                    f"{LIDAR}/scan_range or {LIDAR}/beams"
                ]
            )
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise InputError([f"{LIDAR}/{name}: {value!r}, expected a number"])
        if not (value > 0 or name == "noise") or not math.isfinite(value):
            raise InputError([f"{LIDAR}/{name}: {value!r}, expected more than 0"])
        if name in _LIDAR_FIELDS:
            lidar = replace(lidar, **{_LIDAR_FIELDS[name]: float(value)})
    scan_range = float(world.get("scan_range", lidar.scan_range_rad))
    beams = round(world.get("beams", lidar.beam_count))
    return replace(
        simulation,
        lidar=replace(lidar, scan_range_rad=scan_range, step_size_rad=scan_range / beams),
    )


def _without_files(setup: FlightSetup) -> FlightSetup:
    """Detach the goals from their files, which may not exist on the worker's machine."""
    robots = tuple(
        replace(robot, file=WatchedGoalFile(Path(robot.file.path).name)) for robot in setup.robots
    )
    return replace(setup, robots=robots)


def identity_text(identity: Mapping[str, Any]) -> str:
    """Serialize an identity with sorted keys."""
    return json.dumps(identity, sort_keys=True, default=str)
