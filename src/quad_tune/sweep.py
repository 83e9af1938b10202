"""Sweeps: fly every combination of a few values, or a list of points."""

from __future__ import annotations

import csv
import hashlib
import io
import itertools
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Dict, List, Sequence, Tuple

import yaml

from quad_nav.errors import InputError
from quad_nav.files import plain_yaml
from quad_nav.files.document import yaml_fault
from quad_nav.files.user_files import read_text
from quad_nav.offline.workers import Workers
from quad_nav.versions import versions
from quad_tune.courses import LIDAR, Case, Course, CourseOptions, identity_text
from quad_tune.evaluation import Evaluation, StudyObserver, task_of
from quad_tune.flight_cache import FlightCache
from quad_tune.flight_result import FlightResult
from quad_tune.space import Dimension, SearchSpace
from quad_tune.statistics import FlightStatistics, flight_statistics
from quad_tune.study_database import NotStored
from quad_tune.study_input import parameter_faults

_BASE = "base"
_NAME = "sweep"

Point = Dict[str, Any]
"""Path -> value."""


@dataclass(frozen=True)
class SweepOptions:
    """Options of a sweep: its points, and the number of flights of each."""

    course: CourseOptions
    points: Tuple[Point, ...]
    flights: int = 8


@dataclass(frozen=True)
class SweepSetup:
    """Checked sweep."""

    course: Course
    points: Tuple[Point, ...]
    flights: int
    warnings: Tuple[str, ...]

    @property
    def paths(self) -> Tuple[str, ...]:
        """Paths of the swept parameters."""
        return tuple(self.points[0])

    @property
    def cases(self) -> Tuple[Case, ...]:
        """Flights of every point."""
        return self.course.search_cases(self.flights)

    @property
    def base(self) -> str:
        """Digest of what flights depend on besides point and case."""
        text = identity_text({**self.course.identity(), "versions": versions()})
        return hashlib.sha256(text.encode()).hexdigest()[:16]


@dataclass(frozen=True)
class SweepRow:
    """Point and its flights."""

    point: Point
    flights: Tuple[FlightResult, ...]

    @property
    def statistics(self) -> FlightStatistics:
        """Statistics of the flights."""
        return flight_statistics(self.flights)


def grid(axes: Sequence[Tuple[str, Sequence[Any]]]) -> Tuple[Point, ...]:
    """Return every combination; the last axis varies fastest."""
    names = [path for path, _ in axes]
    return tuple(
        dict(zip(names, values)) for values in itertools.product(*(values for _, values in axes))
    )


def read_points(path: Path) -> Tuple[Point, ...]:
    """Read points from a CSV file: paths in the first row, one point per further row.

    Raises:
        InputError: Lists every fault of the file.
    """
    try:
        text = io.StringIO(read_text(path, plain_yaml.MAX_BYTES), newline="")
        lines = [line for line in csv.reader(text, skipinitialspace=True) if line]
    except csv.Error as error:
        raise InputError([f"{path}: cannot read: {error}"]) from error
    if len(lines) < 2:
        raise InputError([f"{path}: expected a row of parameter paths, and a row for each point"])
    paths, *rows = lines
    problems = [
        f"{path}: row {number}: {len(row)} values, expected {len(paths)}"
        for number, row in enumerate(rows, start=2)
        if len(row) != len(paths)
    ]
    if len(set(paths)) < len(paths):
        problems.append(f"{path}: duplicate path, expected each once")
    if problems:
        raise InputError(problems)
    try:
        return tuple(
            {name: plain_yaml.load(word) for name, word in zip(paths, row)} for row in rows
        )
    except yaml.YAMLError as error:
        raise InputError([f"{path}: a value is not YAML: {yaml_fault(error)}"]) from error


def read_sweep_setup(options: SweepOptions) -> SweepSetup:
    """Read and check a sweep, every point included.

    Raises:
        InputError: Lists every fault.
    """
    course, warnings = options.course.read()
    space = space_of(options.points)
    (case,) = course.search_cases(1)
    problems: List[str] = []
    for point in options.points:
        assignments = space.assignments(point)
        refused = task_of(course, case, assignments).refused
        problems += (
            [f"{_point_text(point)}: {refused}"]
            if refused
            else parameter_faults(
                [pair for pair in assignments if not pair[0].startswith(f"{LIDAR}/")],
                course.config,
                _NAME,
            )
        )
    if problems:
        raise InputError(list(dict.fromkeys(problems)))
    return SweepSetup(course, options.points, options.flights, tuple(warnings))


def space_of(points: Sequence[Point]) -> SearchSpace:
    """Return the space of the points' paths."""
    return SearchSpace(_NAME, tuple(Dimension(path) for path in points[0]))


def run_sweep(
    setup: SweepSetup, workers: Workers, journal: FlightCache, observer: StudyObserver
) -> List[SweepRow]:
    """Fly all points; each case of all points before the next case.

    If a flight cannot be stored, the sweep continues without storing, and the observer is told.
    """
    evaluation = Evaluation(
        setup.course, space_of(setup.points), workers, journal, observer, {_BASE: setup.base}
    )
    evaluation.expect(len(setup.points) * setup.flights)
    observer.on_stage("sweep")
    try:
        flights = evaluation.evaluate(setup.points, setup.cases)
    except NotStored as error:
        observer.on_problem(f"{error}; the sweep continues without storing its flights")
        journal.keep_in_memory()
        flights = evaluation.evaluate(setup.points, setup.cases)
    return [SweepRow(point, tuple(own)) for point, own in zip(setup.points, flights)]


def _point_text(point: Point) -> str:
    return ", ".join(f"{path}={value}" for path, value in point.items())
