"""Whole study: search, refinement and held-out flights."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Dict, Mapping, Optional, Sequence, Tuple

import optuna
from optuna.trial import FrozenTrial

from quad_nav import config
from quad_nav.config.plugins import plugin_name
from quad_nav.errors import InputError, QuadError
from quad_nav.files.shipped import shipped
from quad_nav.offline.workers import Workers
from quad_nav.versions import versions
from quad_tune.courses import Case, Course, CourseOptions
from quad_tune.evaluation import Evaluation, StudyObserver
from quad_tune.flight_result import FlightResult
from quad_tune.parameter_files import base_configuration, base_value
from quad_tune.refinement import BASE, Refinement, refine, refinement_flights
from quad_tune.robot_limits import hold_limits, protected_faults
from quad_tune.search import SearchOptions, best_first, search
from quad_tune.space import Assignments, SearchSpace, load_space
from quad_tune.statistics import Comparison, compare
from quad_tune.study import TuneStudy, open_study
from quad_tune.study_database import NotStored
from quad_tune.study_input import parameter_faults

TUNED = "tuned"
_DWA = "DWAPlannerROS"


class StudyStopped(QuadError):
    """The study's file cannot be written any more; the message ends with the best candidate."""


@dataclass(frozen=True)
class TuneOptions:
    """Options of a study.

    Attributes:
        course: Flown missions or worlds.
        output: Folder of the study.
        space: Search space; None for the shipped one of the course and the local planner.
        search: Size of the search.
        finalists: Number of best candidates that fly ``final_flights`` each before one is selected.
        final_flights: Flights of each finalist.
        held_out: Flights that the search never flies, with base and tuned parameters.
        against: Further configurations that fly the held-out flights unchanged.
        free_speed: Search the robot's limits too, where the space has them; otherwise they stay.
    """

    course: CourseOptions
    output: Path
    space: Optional[Path] = None
    search: SearchOptions = SearchOptions()
    finalists: int = 4
    final_flights: int = 16
    held_out: int = 20
    against: Tuple[str, ...] = ()
    free_speed: bool = False


@dataclass(frozen=True)
class TuneSetup:
    """Checked study.

    Attributes:
        options: Options of the study.
        course: Flights of every candidate.
        space: Searched parameters.
        base: Base's value of each searched parameter.
        held: Limits of the robot that the space's file has and that keep the base's value.
        against: Compared configurations by name.
        warnings: Lines to show before the study starts.
    """

    options: TuneOptions
    course: Course
    space: SearchSpace
    base: Mapping[str, Any]
    held: Mapping[str, Any]
    against: Tuple[Tuple[str, Course], ...]
    warnings: Tuple[str, ...]

    @property
    def base_source(self) -> str:
        """The base configuration, as the user names it."""
        return self.course.config

    @property
    def planned_flights(self) -> int:
        """Estimate of the study's flights, as if no candidate were pruned."""
        options = self.options
        few = options.search.flights
        many = max(options.final_flights, few)
        finalists = min(options.finalists, options.search.candidates)
        return (
            (1 + options.search.candidates) * few
            + (1 + finalists) * (many - few)
            + refinement_flights(len(self.space.dimensions), few, many)
            + (2 + len(options.against)) * options.held_out
        )

    @property
    def identity(self) -> Dict[str, Any]:
        """Everything that the study depends on; a study resumes only if it is equal."""
        search = self.options.search
        return {
            **self.course.identity(),
            "space": asdict(self.space)["dimensions"],
            "flights": search.flights,
            "generation": search.generation,
            "seed": search.seed,
            "versions": all_versions(),
        }


@dataclass(frozen=True)
class HeldOut:
    """Held-out flights of the base and of the tuned parameters, case by case.

    ``others`` holds those of further configurations, by name.
    """

    cases: Tuple[Case, ...]
    base: Tuple[FlightResult, ...]
    tuned: Tuple[FlightResult, ...]
    others: Tuple[Tuple[str, Tuple[FlightResult, ...]], ...] = ()

    def sets(self, base: str) -> Tuple[Tuple[str, Tuple[FlightResult, ...]], ...]:
        """Return all flights by name; ``base`` is the name of the base."""
        return (*self.others, (base, self.base), (TUNED, self.tuned))

    def comparisons(self, base: str) -> Tuple[Tuple[str, Comparison], ...]:
        """Return the tuned flights compared to each other set, by its name."""
        *others, _ = self.sets(base)
        return tuple((name, compare(self.tuned, flights)) for name, flights in others)


@dataclass(frozen=True)
class TuneResult:
    """Outcome of a study; ``reference`` holds the base's flights of the search."""

    setup: TuneSetup
    trials: Tuple[FrozenTrial, ...]
    reference: Tuple[FlightResult, ...]
    refined: Refinement
    held_out: HeldOut

    @property
    def assignments(self) -> Assignments:
        """Changes of the tuned parameters, with move_base's names."""
        return self.setup.space.assignments(self.refined.values)


def read_tune_setup(options: TuneOptions) -> TuneSetup:
    """Read and check everything that a study needs.

    Raises:
        InputError: Lists every fault.
    """
    course, warnings = options.course.read()
    against = tuple((name, options.course.with_config(name).read()[0]) for name in options.against)
    configuration = base_configuration(course.config, course.fixed)
    given = load_space(options.space or _shipped_space(options.course, configuration)).without(
        [path for path, _ in course.fixed]
    )
    space, held = (given, ()) if options.free_speed else hold_limits(given)
    problems = protected_faults(given) + [
        line
        for values in given.corners()
        for line in parameter_faults(
            (*course.fixed, *given.assignments(values)), course.config, given.name
        )
    ]
    if not space.dimensions:
        problems.append(_nothing_to_search(given))
    if problems:
        raise InputError(list(dict.fromkeys(problems)))
    tree = configuration.to_tree()
    return TuneSetup(
        options,
        course,
        space,
        {path: base_value(tree, path) for path in space.paths},
        {path: base_value(tree, path) for path in held},
        against,
        tuple(warnings),
    )


def _nothing_to_search(given: SearchSpace) -> str:
    if given.dimensions:
        return (
            f"{given.name}: every parameter is a limit of the robot, which is searched only with "
            "--free-speed; expected another parameter, or --free-speed"
        )
    return f"{given.name}: every parameter is fixed by --set; expected at least one to search"


def all_versions() -> Dict[str, str]:
    """Return the versions of everything that computes a study."""
    return {**versions(), "optuna": optuna.__version__}


def run_tune(setup: TuneSetup, workers: Workers, observer: StudyObserver) -> TuneResult:
    """Run or resume a study.

    Raises:
        InputError: The folder holds another study, or another process works on it.
        StudyStopped: The study's file cannot be written any more.
        WorkersLost: Workers died repeatedly.
    """
    with open_study(setup.options.output, setup.identity, setup.space) as study:
        evaluation = Evaluation(setup.course, setup.space, workers, study.journal, observer)
        try:
            result = _run(setup, evaluation, study)
            others = tuple(
                (name, _fly_other(name, course, result, evaluation))
                for name, course in setup.against
            )
        except NotStored as error:
            raise StudyStopped(f"study stopped: {error}\n{_best_text(study)}") from error
        return replace(result, held_out=replace(result.held_out, others=others))


def _best_text(study: TuneStudy) -> str:
    """Describe the best candidate so far."""
    best = best_first(study.trials)[:1]
    if not best:
        return f"no best candidate yet: 0 of {len(study.trials)} candidates flew all flights"
    (trial,) = best
    lines = [
        f"best so far: candidate {trial.number} of {len(study.trials)}, cost {trial.value:.3f}"
    ]
    return "\n  ".join([*lines, *(f"{path}: {value}" for path, value in trial.params.items())])


def _run(setup: TuneSetup, evaluation: Evaluation, study: TuneStudy) -> TuneResult:
    options, course, observer = setup.options, setup.course, evaluation.observer
    plan = setup.planned_flights
    observer.on_stored(study.journal.known_at_start)
    few = course.search_cases(options.search.flights)
    evaluation.later = plan - len(few)
    evaluation.expect(len(few))
    observer.on_stage("base")
    (reference,) = evaluation.evaluate([BASE], few)
    if not any(flight.completed for flight in reference):
        observer.on_problem(_none_completed(course.config, reference))
    evaluation.later -= options.search.candidates * len(few)
    search(evaluation, study, start_values(setup.space, setup.base), options.search)
    trials = study.trials[: options.search.candidates]
    finalists = [trial.params for trial in best_first(trials)[: options.finalists]]
    many = course.search_cases(max(options.final_flights, len(few)))
    evaluation.later = held_flights = (2 + len(setup.against)) * options.held_out
    refined = refine(evaluation, finalists, setup.base, few, many)
    held_out = course.held_out_cases(options.held_out)
    evaluation.later = held_flights - 2 * len(held_out)
    evaluation.expect((2 if refined.values else 1) * len(held_out))
    observer.on_stage("held-out flights")
    base, tuned = evaluation.evaluate([BASE, refined.values], held_out)
    return TuneResult(
        setup,
        tuple(trials),
        tuple(reference),
        refined,
        HeldOut(held_out, tuple(base), tuple(tuned)),
    )


def _none_completed(config: str, flights: Sequence[FlightResult]) -> str:
    """Warn that the base never reaches every goal."""
    reached, goals = sum(one.reached for one in flights), sum(one.goals for one in flights)
    reason = next((f" ({one.reason})" for one in flights if one.reason), "")
    return (
        f"tune: the base {config} completed none of {len(flights)} flights{reason} and reached "
        f"{reached} of {goals} goals; a search from a base that flies the mission finds more"
    )


def _fly_other(
    name: str, course: Course, result: TuneResult, evaluation: Evaluation
) -> Tuple[FlightResult, ...]:
    """Fly the held-out flights with another configuration."""
    evaluation.observer.on_stage(f"held-out flights of {name}")
    other = evaluation.of(course, {"config": name, **course.identity()["config"]})
    (flights,) = other.evaluate([BASE], result.held_out.cases)
    return tuple(flights)


def start_values(space: SearchSpace, base: Mapping[str, Any]) -> Dict[str, Any]:
    """Return the base's values within the space: the first candidate."""
    low, _ = space.corners()
    return {
        dimension.path: low[dimension.path]
        if base[dimension.path] is None
        else dimension.nearest(base[dimension.path])
        for dimension in space.dimensions
    }


def _shipped_space(course: CourseOptions, configuration: config.Configuration) -> Path:
    if plugin_name(configuration.navigator.base_local_planner) == _DWA:
        return shipped("spaces", "dwa.yaml")
    return shipped("spaces", course.space)
