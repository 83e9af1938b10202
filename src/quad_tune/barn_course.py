"""BARN's worlds as a course; the search flies worlds outside of the official sample."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, ClassVar, Dict, List, Sequence, Tuple

from quad_bench.barn.protocol import SAMPLE_STEP, TIME_LIMIT_S, Outcome, Run, metric
from quad_bench.barn.setup import BarnOptions, Contestant, flight_setup, read_barn_setup
from quad_bench.barn.statistics import barn_statistics
from quad_bench.barn.worlds import BarnWorld
from quad_nav.config.sources import source_paths
from quad_nav.errors import InputError
from quad_nav.report.results import interval_text, number_text, percent
from quad_nav.scenario.flight_setup import FlightSetup
from quad_tune.courses import (
    HELD_OUT_SEED,
    LIDAR,
    Case,
    Course,
    ProtocolStatistics,
    files_digest,
)
from quad_tune.flight_result import FlightResult
from quad_tune.space import Assignments

COLUMNS = (
    "flights",
    "success\n(%)",
    "95 %\ninterval",
    "collision\n(%)",
    "time-out\n(%)",
    "mean\ntime (s)",
    "metric",
)


@dataclass(frozen=True)
class BarnCourseOptions(BarnOptions):
    """Options of BARN's worlds as a course."""

    space: ClassVar[str] = "barn.yaml"

    def with_config(self, name: str) -> BarnCourseOptions:
        """Return the same course with another base and no parameters on top."""
        return replace(self, config=name, parameters=())

    def read(self) -> Tuple[BarnCourse, List[str]]:
        """Read the worlds; return the course and its warnings.

        Raises:
            InputError: The worlds or the parameters are invalid.
        """
        course = BarnCourse(self)
        return course, course.warnings


class BarnCourse(Course):
    """One flight through each world, with the same seed for every candidate.

    The search flies through worlds spread evenly over those outside of the official sample. The
    sample's worlds are held out.

    Raises:
        InputError: The worlds or the parameters are invalid.
    """

    ends_at_contact = True

    def __init__(self, options: BarnOptions) -> None:
        super().__init__(options.config, options.parameters)
        self.options = options
        setup = read_barn_setup(options)
        self.warnings: List[str] = list(setup.warnings)
        self._worlds = setup.worlds
        self._contestants: Dict[Assignments, Contestant] = {(): setup.contestant}
        rest = [k for k, world in enumerate(self._worlds) if world.number % SAMPLE_STEP]
        sample = [k for k, world in enumerate(self._worlds) if not world.number % SAMPLE_STEP]
        problems = [
            f"{options.worlds}: no world {what}; expected some"
            for what, found in (
                ("outside of the official sample", rest),
                ("of the official sample", sample),
            )
            if not found
        ]
        if options.seed >= HELD_OUT_SEED:
            problems.append(f"seed: {options.seed}, expected less than {HELD_OUT_SEED}")
        if problems:
            raise InputError(problems)
        self._rest, self._sample = _spread(rest), sample

    def search_cases(self, count: int) -> Tuple[Case, ...]:
        """Return this many flights through worlds outside of the sample."""
        return self._cases(self._rest, self.options.seed, count)

    def held_out_cases(self, count: int) -> Tuple[Case, ...]:
        """Return this many flights through the sample; 50 fly each world once."""
        return self._cases(self._sample, self.options.seed + HELD_OUT_SEED, count)

    def setup(self, case: Case, assignments: Assignments) -> FlightSetup:
        """Build a flight; the parameters are checked once for all worlds.

        Raises:
            InputError: The parameters are invalid.
        """
        of_world = [path for path, _ in assignments if path.startswith(f"{LIDAR}/")]
        if of_world:
            raise InputError(
                [
                    f"{path}: the benchmark defines the LIDAR; expected a parameter of move_base"
                    for path in of_world
                ]
            )
        if assignments not in self._contestants:
            options = replace(
                self.options,
                only=(self._worlds[case.course].number,),
                parameters=(*self.options.parameters, *assignments),
                strict=False,  # a candidate may choose a planner, and set another one's
            )
            self._contestants[assignments] = read_barn_setup(options).contestant
        contestant = replace(self._contestants[assignments], seed=case.seed)
        return flight_setup(contestant, self._worlds[case.course], 0)

    def identity(self) -> Dict[str, Any]:
        """Return what flights depend on besides candidate and case, as plain JSON."""
        given = self.options
        return {
            "config": {"name": given.config, "files": files_digest(*source_paths(given.config))},
            "parameters": dict(given.parameters),
            "worlds": {"name": Path(given.worlds).name, "files": files_digest(Path(given.worlds))},
            "body_radius_m": given.body_radius_m,
        }

    def protocol_statistics(
        self, cases: Sequence[Case], flights: Sequence[FlightResult]
    ) -> ProtocolStatistics:
        """Compute the benchmark's statistics of flights."""
        found = barn_statistics(
            [
                run_of(self._worlds[case.course], case, flight)
                for case, flight in zip(cases, flights)
            ]
        )
        cells = (
            str(found.runs),
            percent(found.successes, found.runs),
            interval_text(found.success_interval),
            percent(found.collisions, found.runs),
            percent(found.time_outs, found.runs),
            number_text(found.mean_time_s),
            f"{found.metric:.3f}",
        )
        return ProtocolStatistics("barn", COLUMNS, cells, asdict(found))

    def _cases(self, numbers: Sequence[int], seed: int, count: int) -> Tuple[Case, ...]:
        return tuple(
            Case(number, f"BARN world {self._worlds[number].number}", seed + k // len(numbers))
            for k, number in ((k, numbers[k % len(numbers)]) for k in range(count))
        )


def run_of(world: BarnWorld, case: Case, flight: FlightResult) -> Run:
    """Score a flight by the benchmark's protocol, as ``barn.runs.judge`` does."""
    outcome = (
        Outcome.COLLISION
        if flight.contacts
        else Outcome.SUCCESS
        if flight.completed
        else Outcome.TIME_OUT
    )
    time_s = TIME_LIMIT_S if outcome is Outcome.TIME_OUT else flight.time_s
    return Run(
        world.number,
        0,
        case.seed,
        outcome,
        time_s,
        metric(outcome, time_s, world.path_length_m),
        0.0,
        flight.clearance_m or 0.0,
        flight.recoveries,
    )


def _spread(numbers: Sequence[int]) -> List[int]:
    """Reorder numbers so that any first few of them are spread evenly."""
    order = sorted(range(len(numbers)), key=_reversed_bits)
    return [numbers[k] for k in order]


def _reversed_bits(number: int) -> int:
    """Reverse the bits of a number: the base-2 van der Corput sequence."""
    return int(f"{number:016b}"[::-1], 2)
