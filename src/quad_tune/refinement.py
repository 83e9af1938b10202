"""Select the best candidate, and take needless changes back.

The best of many candidates in few flights was lucky, too. So the best few fly more, and so does
the base. Then every change without a benefit is taken back, and the gain of each remaining
change is measured: flights without it beside flights with it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Dict, List, Mapping, Sequence, Tuple

from quad_tune.courses import Case
from quad_tune.evaluation import Evaluation
from quad_tune.flight_result import FlightResult
from quad_tune.score import mean_cost
from quad_tune.space import Values
from quad_tune.statistics import Comparison, FlightStatistics, compare, flight_statistics

BASE: Values = {}
NEGLIGIBLE_COST = 0.02
"""Smallest cost that justifies a change: one second in 50 m of flight."""


@dataclass(frozen=True)
class Gain:
    """Effect of one changed parameter in the same flights.

    Attributes:
        path: Path of the parameter.
        value: Tuned value.
        base: Base's value, None if the base does not set it.
        with_it: Statistics with the change.
        without_it: Statistics without the change.
        difference: What the change differs in, flight by flight, with intervals.
    """

    path: str
    value: Any
    base: Any
    with_it: FlightStatistics
    without_it: FlightStatistics
    difference: Comparison

    @property
    def cost(self) -> float:
        """Cost that the change saves."""
        return self.without_it.cost - self.with_it.cost


@dataclass(frozen=True)
class Refinement:
    """Changes of the winner and their gains; empty if no candidate is better than the base.

    ``has_completed`` is false if no flight of the winner completed its mission.
    """

    values: Dict[str, Any]
    gains: Tuple[Gain, ...]
    has_completed: bool = True


def refine(
    evaluation: Evaluation,
    finalists: Sequence[Values],
    base: Mapping[str, Any],
    few: Sequence[Case],
    many: Sequence[Case],
) -> Refinement:
    """Select the best of ``finalists`` and the base, and simplify it.

    Args:
        evaluation: Flies the candidates.
        finalists: Best candidates of the search.
        base: Base's value of each searched parameter.
        few: Cases that screen for changes without benefit.
        many: Cases that decide; they include ``few``.
    """
    candidates = [BASE, *(_changed(values, base) for values in finalists)]
    evaluation.observer.on_stage("finalists")
    final = len(candidates) * (len(many) - len(few))
    evaluation.expect(final + refinement_flights(len(base), len(few), len(many)))
    flights = evaluation.evaluate(candidates, many)
    costs = list(map(mean_cost, flights))
    number = costs.index(min(costs))
    has_completed = any(flight.completed for flight in flights[number])
    if not has_completed and _reached(flights[number]) <= _reached(flights[0]):
        return Refinement({}, (), has_completed)  # it only failed faster than the base
    best = candidates[number]
    values = _simplified(evaluation, best, few, many)
    evaluation.observer.on_stage("gain of each change")
    return Refinement(values, _gains(evaluation, values, base, many), has_completed)


def refinement_flights(changes: int, few: int, many: int) -> int:
    """Estimate the flights after the selection; needless changes are taken back all at once."""
    return changes * few + (many if changes else 0) + changes * many


def _reached(flights: Sequence[FlightResult]) -> int:
    return sum(flight.reached for flight in flights)


def _changed(values: Values, base: Mapping[str, Any]) -> Dict[str, Any]:
    """Drop values that equal the base's."""
    return {path: value for path, value in values.items() if base.get(path) != value}


def _without(values: Values, paths: Sequence[str]) -> Dict[str, Any]:
    return {path: value for path, value in values.items() if path not in paths}


def _simplified(
    evaluation: Evaluation, best: Values, few: Sequence[Case], many: Sequence[Case]
) -> Dict[str, Any]:
    """Take changes without benefit back, if all of them together are no benefit either."""
    evaluation.observer.on_stage("simplification")
    evaluation.expect(refinement_flights(len(best), len(few), len(many)))
    savings = [
        (path, cost - mean_cost(evaluation.flights(best, few)))
        for path, cost in zip(best, _costs_without(evaluation, best, few))
    ]
    idle = [
        path
        for path, saving in sorted(savings, key=lambda pair: pair[1])
        if saving <= NEGLIGIBLE_COST
    ]
    limit = mean_cost(evaluation.flights(best, many)) + NEGLIGIBLE_COST
    simplest = dict(best)
    waiting = [idle] if idle else []
    while waiting:  # all at once, then halves: they may matter together
        paths = waiting.pop(0)
        simpler = _without(simplest, paths)
        evaluation.expect((1 + len(simpler)) * len(many))
        (flights,) = evaluation.evaluate([simpler], many)
        if mean_cost(flights) <= limit:
            simplest = simpler
        elif len(paths) > 1:
            middle = len(paths) // 2
            waiting[:0] = [paths[:middle], paths[middle:]]
    return simplest


def _costs_without(evaluation: Evaluation, values: Values, cases: Sequence[Case]) -> List[float]:
    return list(
        map(mean_cost, evaluation.evaluate([_without(values, [path]) for path in values], cases))
    )


def _gains(
    evaluation: Evaluation, values: Values, base: Mapping[str, Any], cases: Sequence[Case]
) -> Tuple[Gain, ...]:
    """Measure the gain of every change, largest first."""
    evaluation.expect(len(values) * len(cases))
    without = evaluation.evaluate([_without(values, [path]) for path in values], cases)
    tuned = evaluation.flights(values, cases)
    gains = [
        Gain(
            path,
            value,
            base.get(path),
            flight_statistics(tuned),
            flight_statistics(flights),
            compare(tuned, flights),
        )
        for (path, value), flights in zip(values.items(), without)
    ]
    return tuple(sorted(gains, key=lambda gain: -gain.cost))
