"""Select the best candidate, and take needless changes back.

The best of many candidates in few flights was lucky, too. So the best few fly more, and so does
the base. Then every change without a benefit is taken back, and the gain of each remaining
change is measured: flights without it beside flights with it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple

from quad_nav.tuning.courses import Case
from quad_nav.tuning.evaluation import Evaluation
from quad_nav.tuning.score import mean_cost
from quad_nav.tuning.space import Values
from quad_nav.tuning.statistics import FlightStatistics, flight_statistics

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
    """

    path: str
    value: Any
    base: Any
    with_it: FlightStatistics
    without_it: FlightStatistics

    @property
    def cost(self) -> float:
        """Cost that the change saves."""
        return self.without_it.cost - self.with_it.cost

    @property
    def time_s(self) -> Optional[float]:
        """Time that the change saves per mission; None if one set completed no mission."""
        before, after = self.without_it.mean_time_s, self.with_it.mean_time_s
        return None if before is None or after is None else before - after


@dataclass(frozen=True)
class Refinement:
    """Changes of the winner and their gains; empty if no candidate is better than the base."""

    values: Dict[str, Any]
    gains: Tuple[Gain, ...]


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
    evaluation.observer.on_expected(len(candidates) * len(many))
    flights = evaluation.evaluate(candidates, many)
    costs = list(map(mean_cost, flights))
    best = candidates[costs.index(min(costs))]
    values = _simplified(evaluation, best, few, many)
    evaluation.observer.on_stage("gain of each change")
    return Refinement(values, _gains(evaluation, values, base, many))


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
    evaluation.observer.on_expected(len(best) * len(few))
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
        evaluation.observer.on_expected(len(many))
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
    evaluation.observer.on_expected(len(values) * len(cases))
    without = evaluation.evaluate([_without(values, [path]) for path in values], cases)
    with_it = flight_statistics(evaluation.flights(values, cases))
    gains = [
        Gain(path, value, base.get(path), with_it, flight_statistics(flights))
        for (path, value), flights in zip(values.items(), without)
    ]
    return tuple(sorted(gains, key=lambda gain: -gain.cost))
