"""Search: generations of candidates, flown in rounds after which bad candidates are pruned."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, Dict, List, Mapping, Sequence, Tuple

import optuna
from optuna.trial import FrozenTrial, TrialState

from quad_tune.courses import Case
from quad_tune.evaluation import Evaluation
from quad_tune.proposals import distributions, propose, should_prune
from quad_tune.score import mean_cost
from quad_tune.space import Values
from quad_tune.statistics import STATISTICS, flight_statistics
from quad_tune.study import TuneStudy

FIRST_ROUND = 2


@dataclass(frozen=True)
class SearchOptions:
    """Size of the search.

    Attributes:
        candidates: Number of candidates; it may grow when a study is resumed, all else is fixed.
        flights: Flights of a candidate that is not pruned.
        generation: Candidates of a generation.
        seed: Seed of the sampler.
    """

    candidates: int = 60
    flights: int = 8
    generation: int = 8
    seed: int = 0


def rounds(flights: int) -> Tuple[int, ...]:
    """Return the number of flights flown after each round: 2, 4, 8, ... and all."""
    counts = []
    count = FIRST_ROUND
    while count < flights:
        counts.append(count)
        count *= 2
    return (*counts, flights)


def search(evaluation: Evaluation, study: TuneStudy, start: Values, options: SearchOptions) -> None:
    """Fly generations until there are ``candidates`` trials; ``start`` is the first candidate."""
    evaluation.observer.on_stage("search")
    for generation in range(-(-options.candidates // options.generation)):
        _fly_generation(evaluation, study, start, options, generation)


def _fly_generation(
    evaluation: Evaluation, study: TuneStudy, start: Values, options: SearchOptions, generation: int
) -> None:
    first = generation * options.generation
    history = study.trials
    candidates: List[Dict[str, Any]] = propose(
        evaluation.space, history[:first], generation, options.generation, options.seed
    )
    if generation == 0:
        candidates[0] = dict(start)
    candidates = candidates[: options.candidates - first]
    cases = evaluation.course.search_cases(options.flights)
    left = options.candidates - first - len(candidates)
    means = _fly_rounds(evaluation, history[:first], candidates, cases, left * len(cases))
    for number, (values, steps) in enumerate(zip(candidates, means), start=first):
        if number >= len(history):
            study.add(_trial(evaluation, values, steps, cases))
        done = study.trials[: number + 1]
        evaluation.observer.on_candidates(
            number + 1,
            min(
                (trial.value for trial in done if trial.value is not None and is_complete(trial)),
                default=float("inf"),
            ),
        )


def _fly_rounds(
    evaluation: Evaluation,
    history: Sequence[FrozenTrial],
    candidates: Sequence[Values],
    cases: Sequence[Case],
    next_flights: int,
) -> List[Dict[int, float]]:
    """Return for each candidate its mean cost after each round that it survived.

    ``next_flights`` are those of later generations, for the estimate.
    """
    means: List[Dict[int, float]] = [{} for _ in candidates]
    flying = list(range(len(candidates)))
    flown = 0
    for count in rounds(len(cases)):
        evaluation.expect(len(flying) * (len(cases) - flown) + next_flights)
        evaluation.fly((candidates[k], case) for case in cases[:count] for k in flying)
        for k in flying:
            means[k][count] = mean_cost(evaluation.flights(candidates[k], cases[:count]))
        if count < len(cases):
            hopeless = {k for k in flying if should_prune(history, count, means[k][count])}
            flying = [k for k in flying if k not in hopeless]
        flown = count
    return means


def _trial(
    evaluation: Evaluation, values: Values, means: Mapping[int, float], cases: Sequence[Case]
) -> FrozenTrial:
    flown = max(means)
    attributes = {STATISTICS: asdict(flight_statistics(evaluation.flights(values, cases[:flown])))}
    return optuna.create_trial(
        state=TrialState.COMPLETE if flown == len(cases) else TrialState.PRUNED,
        value=means[flown],
        params=dict(values),
        distributions=distributions(evaluation.space),
        user_attrs=attributes,
        intermediate_values=dict(means),
    )


def is_complete(trial: FrozenTrial) -> bool:
    """Return true if a trial completed all flights."""
    return trial.state is TrialState.COMPLETE


def best_first(trials: Sequence[FrozenTrial]) -> List[FrozenTrial]:
    """Return the complete trials, the best first; of equal ones the older first."""
    return sorted(filter(is_complete, trials), key=lambda trial: (trial.value, trial.number))
