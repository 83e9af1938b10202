"""The best candidate: found among the best few with more flights, then made as small as it can be.

A candidate that was the best of many in few flights was lucky too. So the best few fly more,
and so does the base. Then every change that does no good is taken back, and what each of the
others gains is measured: flights without it beside flights with it.
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
TRIFLE = 0.02
"""Cost that no parameter is changed for: a second in 50 m of flight."""


@dataclass(frozen=True)
class Gain:
    """What a changed parameter does: figures with it and without it, in the same flights.

    ``base``: the value that it had, None where the base does not know it.
    """

    path: str
    value: Any
    base: Any
    with_it: FlightStatistics
    without_it: FlightStatistics

    @property
    def cost(self) -> float:
        """What it saves."""
        return self.without_it.cost - self.with_it.cost

    @property
    def time_s(self) -> Optional[float]:
        """Seconds that a mission takes less with it; None where one of both never flew one."""
        before, after = self.without_it.mean_time_s, self.with_it.mean_time_s
        return None if before is None or after is None else before - after


@dataclass(frozen=True)
class Refined:
    """The winner: what it changes, and what that gains; empty when nothing beats the base."""

    values: Dict[str, Any]
    gains: Tuple[Gain, ...]


def refine(
    evaluation: Evaluation,
    finalists: Sequence[Values],
    base: Mapping[str, Any],
    few: Sequence[Case],
    many: Sequence[Case],
) -> Refined:
    """The best of ``finalists`` and the base.

    Args:
        base: the base's own value of each parameter of the space.
        few: flights that are enough to see what does no good.
        many: flights that decide, ``few`` among them.
    """
    candidates = [BASE, *(_changed(values, base) for values in finalists)]
    evaluation.watcher.stage("choosing among the best")
    evaluation.watcher.expect(len(candidates) * len(many))
    flights = evaluation.flown(candidates, many)
    costs = list(map(mean_cost, flights))
    best = candidates[costs.index(min(costs))]
    values = _simplified(evaluation, best, few, many)
    evaluation.watcher.stage("measuring what each change gains")
    return Refined(values, _gains(evaluation, values, base, many))


def _changed(values: Values, base: Mapping[str, Any]) -> Dict[str, Any]:
    """Without values that are the base's own and that nothing follows."""
    return {path: value for path, value in values.items() if base.get(path) != value}


def _without(values: Values, paths: Sequence[str]) -> Dict[str, Any]:
    return {path: value for path, value in values.items() if path not in paths}


def _simplified(
    evaluation: Evaluation, best: Values, few: Sequence[Case], many: Sequence[Case]
) -> Dict[str, Any]:
    """Without changes that do no good, if it is no worse without all of them."""
    evaluation.watcher.stage("taking back what does no good")
    evaluation.watcher.expect(len(best) * len(few))
    savings = [
        (path, cost - mean_cost(evaluation.flights(best, few)))
        for path, cost in zip(best, _costs_without(evaluation, best, few))
    ]
    idle = [path for path, saving in sorted(savings, key=lambda pair: pair[1]) if saving <= TRIFLE]
    limit = mean_cost(evaluation.flights(best, many)) + TRIFLE
    simplest = dict(best)
    waiting = [idle] if idle else []
    while waiting:  # all at once, then in halves: together they may matter
        paths = waiting.pop(0)
        simpler = _without(simplest, paths)
        evaluation.watcher.expect(len(many))
        (flights,) = evaluation.flown([simpler], many)
        if mean_cost(flights) <= limit:
            simplest = simpler
        elif len(paths) > 1:
            middle = len(paths) // 2
            waiting[:0] = [paths[:middle], paths[middle:]]
    return simplest


def _costs_without(evaluation: Evaluation, values: Values, cases: Sequence[Case]) -> List[float]:
    return list(
        map(mean_cost, evaluation.flown([_without(values, [path]) for path in values], cases))
    )


def _gains(
    evaluation: Evaluation, values: Values, base: Mapping[str, Any], cases: Sequence[Case]
) -> Tuple[Gain, ...]:
    """Of every change, the largest first."""
    evaluation.watcher.expect(len(values) * len(cases))
    without = evaluation.flown([_without(values, [path]) for path in values], cases)
    with_it = flight_statistics(evaluation.flights(values, cases))
    gains = [
        Gain(path, value, base.get(path), with_it, flight_statistics(flights))
        for (path, value), flights in zip(values.items(), without)
    ]
    return tuple(sorted(gains, key=lambda gain: -gain.cost))
