"""Tuning from end to end: search, refinement, and flights that the search never saw."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Dict, Mapping, Optional, Tuple

import optuna
from optuna.trial import FrozenTrial

from quad_nav import config
from quad_nav.barn.setup import BarnOptions
from quad_nav.config.plugins import plugin_name
from quad_nav.errors import InputError
from quad_nav.files.shipped import config_folder, shipped
from quad_nav.offline.workers import Workers
from quad_nav.tuning.courses import Case
from quad_nav.tuning.evaluation import Course, Evaluation, Watcher
from quad_nav.tuning.flight_result import FlightResult
from quad_nav.tuning.parameter_files import base_configuration, base_value
from quad_nav.tuning.refinement import BASE, Refined, refine
from quad_nav.tuning.search import SearchOptions, best_first, search
from quad_nav.tuning.space import Assignments, SearchSpace, load_space
from quad_nav.tuning.study import TuneStudy, open_study
from quad_nav.tuning.study_input import CourseOptions, parameter_faults, read_course, with_config
from quad_nav.versions import versions

TUNED = "tuned"
_DWA = "DWAPlannerROS"


@dataclass(frozen=True)
class TuneOptions:
    """What a person asks for. ``space`` None: the shipped one for the
    course and the base's local planner.

    ``finalists``: the best candidates that fly ``final_flights`` each before one is chosen;
    ``held_out``: flights that the search never sees, with the base and with the best, and with
    the folders of parameters ``against`` as they are.
    """

    course: CourseOptions
    output: Path
    space: Optional[Path] = None
    search: SearchOptions = SearchOptions()
    finalists: int = 4
    final_flights: int = 16
    held_out: int = 20
    against: Tuple[str, ...] = ()


@dataclass(frozen=True)
class TuneSetup:
    """A study that can be flown; ``base`` is the base's own value of each parameter."""

    options: TuneOptions
    course: Course
    space: SearchSpace
    base: Mapping[str, Any]
    against: Tuple[Tuple[str, Course], ...]
    warnings: Tuple[str, ...]

    @property
    def base_folder(self) -> Path:
        return config_folder(self.course.config)

    @property
    def identity(self) -> Dict[str, Any]:
        """What the study depends on; with the same one it can be taken up again."""
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
    """Flights that the search never saw, with the base and with the best, case by case.

    ``others``: the same with other folders of parameters, by their names.
    """

    cases: Tuple[Case, ...]
    base: Tuple[FlightResult, ...]
    tuned: Tuple[FlightResult, ...]
    others: Tuple[Tuple[str, Tuple[FlightResult, ...]], ...] = ()

    def sets(self, base: str) -> Tuple[Tuple[str, Tuple[FlightResult, ...]], ...]:
        """Everything by name, ``base`` being the base's."""
        return (*self.others, (base, self.base), (TUNED, self.tuned))


@dataclass(frozen=True)
class TuneResult:
    """What came of it. ``reference`` are the base's flights of the search."""

    setup: TuneSetup
    trials: Tuple[FrozenTrial, ...]
    reference: Tuple[FlightResult, ...]
    refined: Refined
    held_out: HeldOut

    @property
    def assignments(self) -> Assignments:
        """What the best one changes, as move_base has it."""
        return self.setup.space.assignments(self.refined.values)


def read_tune_setup(options: TuneOptions) -> TuneSetup:
    """Reads and checks everything that a study needs.

    Raises:
        InputError: every fault.
    """
    course, warnings = read_course(options.course)
    against = tuple(
        (name, read_course(with_config(options.course, name))[0]) for name in options.against
    )
    folder = config_folder(course.config)
    configuration = base_configuration(folder, course.fixed)
    space = load_space(options.space or _shipped_space(options.course, configuration)).without(
        [path for path, _ in course.fixed]
    )
    problems = [
        line
        for values in space.corners()
        for line in parameter_faults(
            (*course.fixed, *space.assignments(values)), folder, space.name
        )
    ]
    if not space.dimensions:
        problems.append(
            f"{space.name}: every parameter in it is fixed by --set; expected one that is not"
        )
    if problems:
        raise InputError(list(dict.fromkeys(problems)))
    tree = configuration.to_tree()
    base = {path: base_value(tree, path) for path in space.paths}
    return TuneSetup(options, course, space, base, against, tuple(warnings))


def all_versions() -> Dict[str, str]:
    """What a study depends on besides its options."""
    return {**versions(), "optuna": optuna.__version__}


def run_tune(setup: TuneSetup, workers: Workers, watcher: Watcher) -> TuneResult:
    """Takes up the study where it was left, and brings it to its end.

    Raises:
        InputError: the folder holds another study, or somebody works on it.
        WorkersLost: workers die again and again.
    """
    with open_study(setup.options.output, setup.identity) as study:
        evaluation = Evaluation(setup.course, setup.space, workers, study.journal, watcher)
        result = _run(setup, evaluation, study)
        others = tuple(
            (name, _fly_other(name, course, result, evaluation)) for name, course in setup.against
        )
        return replace(result, held_out=replace(result.held_out, others=others))


def _run(setup: TuneSetup, evaluation: Evaluation, study: TuneStudy) -> TuneResult:
    options, course, watcher = setup.options, setup.course, evaluation.watcher
    few = course.search_cases(options.search.flights)
    watcher.expect(len(few))
    watcher.stage("flying the base")
    (reference,) = evaluation.flown([BASE], few)
    search(evaluation, study, start_values(setup.space, setup.base), options.search)
    trials = study.trials[: options.search.candidates]
    finalists = [trial.params for trial in best_first(trials)[: options.finalists]]
    many = course.search_cases(max(options.final_flights, len(few)))
    refined = refine(evaluation, finalists, setup.base, few, many)
    held_out = course.held_out_cases(options.held_out)
    watcher.expect(2 * len(held_out))
    watcher.stage("flying what was held out")
    base, tuned = evaluation.flown([BASE, refined.values], held_out)
    return TuneResult(
        setup,
        tuple(trials),
        tuple(reference),
        refined,
        HeldOut(held_out, tuple(base), tuple(tuned)),
    )


def _fly_other(
    name: str, course: Course, result: TuneResult, evaluation: Evaluation
) -> Tuple[FlightResult, ...]:
    """The flights that were held out with other parameters."""
    evaluation.watcher.expect(len(result.held_out.cases))
    evaluation.watcher.stage(f"flying {name}")
    other = evaluation.of(course, {"config": name, **course.identity()["config"]})
    (flights,) = other.flown([BASE], result.held_out.cases)
    return tuple(flights)


def start_values(space: SearchSpace, base: Mapping[str, Any]) -> Dict[str, Any]:
    """The base's own values, as far as the space has them: the first candidate."""
    low, _ = space.corners()
    return {
        one.path: low[one.path] if base[one.path] is None else one.nearest(base[one.path])
        for one in space.dimensions
    }


def _shipped_space(course: CourseOptions, configuration: config.Configuration) -> Path:
    if plugin_name(configuration.navigator.base_local_planner) == _DWA:
        return shipped("spaces", "dwa.yaml")
    return shipped("spaces", "barn.yaml" if isinstance(course, BarnOptions) else "default.yaml")
