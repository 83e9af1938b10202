"""Tables instead of a search: every combination of a few values, or a list of them."""

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
from quad_nav.files.shipped import config_folder
from quad_nav.files.user_files import read_text
from quad_nav.offline.workers import Workers
from quad_nav.tuning.courses import LIDAR, Case, identity_text
from quad_nav.tuning.evaluation import Course, Evaluation, Watcher, task_of
from quad_nav.tuning.flight_cache import FlightCache
from quad_nav.tuning.flight_result import FlightResult
from quad_nav.tuning.space import Dimension, SearchSpace
from quad_nav.tuning.statistics import FlightStatistics, flight_statistics
from quad_nav.tuning.study_input import CourseOptions, parameter_faults, read_course
from quad_nav.versions import versions

_BASE = "base"
_NAME = "sweep"

Point = Dict[str, Any]
"""Path -> value."""


@dataclass(frozen=True)
class SweepOptions:
    """What a person asks for: ``points``, and how many ``flights`` each flies."""

    course: CourseOptions
    points: Tuple[Point, ...]
    flights: int = 8


@dataclass(frozen=True)
class SweepSetup:
    """A sweep that can be flown."""

    course: Course
    points: Tuple[Point, ...]
    flights: int
    warnings: Tuple[str, ...]

    @property
    def paths(self) -> Tuple[str, ...]:
        return tuple(self.points[0])

    @property
    def cases(self) -> Tuple[Case, ...]:
        """The flights of every point."""
        return self.course.search_cases(self.flights)

    @property
    def base(self) -> str:
        """A digest of what flights depend on besides the point and the case."""
        text = identity_text({**self.course.identity(), "versions": versions()})
        return hashlib.sha256(text.encode()).hexdigest()[:16]


@dataclass(frozen=True)
class SweepRow:
    """A point and its flights."""

    point: Point
    flights: Tuple[FlightResult, ...]

    @property
    def statistics(self) -> FlightStatistics:
        return flight_statistics(self.flights)


def grid(axes: Sequence[Tuple[str, Sequence[Any]]]) -> Tuple[Point, ...]:
    """Every combination, the last axis first."""
    names = [path for path, _ in axes]
    return tuple(
        dict(zip(names, values)) for values in itertools.product(*(values for _, values in axes))
    )


def read_points(path: Path) -> Tuple[Point, ...]:
    """Points from a CSV: paths in its first line, a point in each other one.

    Raises:
        InputError: it is not such a file.
    """
    try:
        text = io.StringIO(read_text(path, plain_yaml.MAX_BYTES), newline="")
        lines = [line for line in csv.reader(text, skipinitialspace=True) if line]
    except csv.Error as error:
        raise InputError([f"{path}: cannot be read: {error}"]) from error
    if len(lines) < 2:
        raise InputError([f"{path}: expected a line of parameters' paths, and one for each point"])
    paths, *rows = lines
    problems = [
        f"{path}: row {number}: {len(row)} values, expected {len(paths)}"
        for number, row in enumerate(rows, start=2)
        if len(row) != len(paths)
    ]
    if len(set(paths)) < len(paths):
        problems.append(f"{path}: a path is there twice, expected each once")
    if problems:
        raise InputError(problems)
    try:
        return tuple(
            {name: plain_yaml.load(word) for name, word in zip(paths, row)} for row in rows
        )
    except yaml.YAMLError as error:
        raise InputError([f"{path}: a value is not YAML: {error}"]) from error


def read_sweep_setup(options: SweepOptions) -> SweepSetup:
    """Reads and checks everything, every point included.

    Raises:
        InputError: every fault.
    """
    course, warnings = read_course(options.course)
    space = space_of(options.points)
    folder = config_folder(course.config)
    (case,) = course.search_cases(1)
    problems: List[str] = []
    for point in options.points:
        assignments = space.assignments(point)
        refused = task_of(course, case, assignments).refused
        problems += (
            [f"{_words(point)}: {refused}"]
            if refused
            else parameter_faults(
                [pair for pair in assignments if not pair[0].startswith(f"{LIDAR}/")], folder, _NAME
            )
        )
    if problems:
        raise InputError(list(dict.fromkeys(problems)))
    return SweepSetup(course, options.points, options.flights, tuple(warnings))


def space_of(points: Sequence[Point]) -> SearchSpace:
    """The points' paths."""
    return SearchSpace(_NAME, tuple(Dimension(path) for path in points[0]))


def run_sweep(
    setup: SweepSetup, workers: Workers, journal: FlightCache, watcher: Watcher
) -> List[SweepRow]:
    """Flies all points, each flight of all before the next one of any."""
    evaluation = Evaluation(
        setup.course, space_of(setup.points), workers, journal, watcher, {_BASE: setup.base}
    )
    watcher.expect(len(setup.points) * setup.flights)
    watcher.stage("sweeping")
    flights = evaluation.flown(setup.points, setup.cases)
    return [SweepRow(point, tuple(own)) for point, own in zip(setup.points, flights)]


def _words(point: Point) -> str:
    return ", ".join(f"{path}={value}" for path, value in point.items())
