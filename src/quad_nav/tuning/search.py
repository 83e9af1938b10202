"""The search: generations of candidates, each flown in rounds that the bad ones do not survive."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, Dict, List, Mapping, Sequence, Tuple

import optuna
from optuna.trial import FrozenTrial, TrialState

from quad_nav.tuning.courses import Case
from quad_nav.tuning.evaluation import Evaluation
from quad_nav.tuning.proposals import distributions, is_hopeless, propose
from quad_nav.tuning.score import mean_cost
from quad_nav.tuning.space import Values
from quad_nav.tuning.statistics import flight_statistics
from quad_nav.tuning.study import TuneStudy

FIRST_ROUND = 2
FIGURES = "figures"


@dataclass(frozen=True)
class SearchOptions:
    """``flights`` of each candidate that is not dropped; ``generation``: its size.

    ``candidates`` may grow when a study is taken up again; everything else must not change.
    """

    candidates: int = 60
    flights: int = 8
    generation: int = 8
    seed: int = 0


def rounds(flights: int) -> Tuple[int, ...]:
    """How many flights have been flown after each round: 2, 4, 8, ... and all."""
    counts = []
    count = FIRST_ROUND
    while count < flights:
        counts.append(count)
        count *= 2
    return (*counts, flights)


def search(evaluation: Evaluation, study: TuneStudy, start: Values, options: SearchOptions) -> None:
    """Until there are ``candidates`` trials. ``start`` is the very first candidate."""
    evaluation.watcher.expect(options.candidates * options.flights)
    evaluation.watcher.stage("searching")
    for generation in range(-(-options.candidates // options.generation)):
        _fly_generation(evaluation, study, start, options, generation)


def _fly_generation(
    evaluation: Evaluation, study: TuneStudy, start: Values, options: SearchOptions, generation: int
) -> None:
    first = generation * options.generation
    told = study.trials
    candidates: List[Dict[str, Any]] = propose(
        evaluation.space, told[:first], generation, options.generation, options.seed
    )
    if generation == 0:
        candidates[0] = dict(start)
    candidates = candidates[: options.candidates - first]
    cases = evaluation.course.search_cases(options.flights)
    means = _fly_rounds(evaluation, told[:first], candidates, cases)
    for number, (values, steps) in enumerate(zip(candidates, means), start=first):
        if number >= len(told):
            study.tell(_trial(evaluation, values, steps, cases))
        done = study.trials[: number + 1]
        evaluation.watcher.told(
            number + 1,
            min(
                (trial.value for trial in done if trial.value is not None and is_complete(trial)),
                default=float("inf"),
            ),
        )


def _fly_rounds(
    evaluation: Evaluation,
    told: Sequence[FrozenTrial],
    candidates: Sequence[Values],
    cases: Sequence[Case],
) -> List[Dict[int, float]]:
    """For each candidate: flights -> mean cost of so many, as far as it came."""
    means: List[Dict[int, float]] = [{} for _ in candidates]
    flying = list(range(len(candidates)))
    for count in rounds(len(cases)):
        evaluation.fly((candidates[k], case) for case in cases[:count] for k in flying)
        for k in flying:
            means[k][count] = mean_cost(evaluation.flights(candidates[k], cases[:count]))
        if count < len(cases):
            hopeless = {k for k in flying if is_hopeless(told, count, means[k][count])}
            evaluation.watcher.expect(-len(hopeless) * (len(cases) - count))
            flying = [k for k in flying if k not in hopeless]
    return means


def _trial(
    evaluation: Evaluation, values: Values, means: Mapping[int, float], cases: Sequence[Case]
) -> FrozenTrial:
    flown = max(means)
    attributes = {FIGURES: asdict(flight_statistics(evaluation.flights(values, cases[:flown])))}
    return optuna.create_trial(
        state=TrialState.COMPLETE if flown == len(cases) else TrialState.PRUNED,
        value=means[flown],
        params=dict(values),
        distributions=distributions(evaluation.space),
        user_attrs=attributes,
        intermediate_values=dict(means),
    )


def is_complete(trial: FrozenTrial) -> bool:
    """Whether it has flown everything."""
    return trial.state is TrialState.COMPLETE


def best_first(trials: Sequence[FrozenTrial]) -> List[FrozenTrial]:
    """Those that have flown everything, the best first, the older of equal ones."""
    return sorted(filter(is_complete, trials), key=lambda trial: (trial.value, trial.number))
