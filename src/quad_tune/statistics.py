"""Statistics of many flights of one set of parameters, and paired comparisons of two sets."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from statistics import NormalDist
from typing import Any, List, Optional, Sequence, Tuple

import numpy as np

from quad_nav.files.values import is_number
from quad_tune.flight_result import FlightResult
from quad_tune.score import cost, mean_cost

STATISTICS = "statistics"
"""Name of a trial's attribute with its ``FlightStatistics``."""
CONFIDENCE = 0.95
MIN_PAIRS = 6
"""Fewest pairs that can show a difference. With five, all have the same sign by chance in 1 of 16
cases, more than the 1 of 20 that 95 % allows."""
_RESAMPLES = 10_000
_SEED = 0


@dataclass(frozen=True)
class FlightStatistics:
    """Counts and means of flights.

    Attributes:
        flights: Number of flights.
        completed: Flights that reached every goal.
        succeeded: Flights that reached every goal without contact.
        contacts: Number of contacts.
        touched: Flights with contacts.
        mean_time_s: Mean time of the completed flights, None without any.
        least_gap_m: Smallest gap of all flights. A gap is the smaller of clearance and separation.
        mean_gap_m: Mean of the flights' gaps.
        roughness_mps2: Mean roughness.
        recoveries: Number of recovery behaviours.
        cost: Mean cost.
    """

    flights: int
    completed: int
    succeeded: int
    contacts: int
    touched: int
    mean_time_s: Optional[float]
    least_gap_m: Optional[float]
    mean_gap_m: Optional[float]
    roughness_mps2: float
    recoveries: int
    cost: float


def flight_statistics(flights: Sequence[FlightResult]) -> FlightStatistics:
    """Compute the statistics of flights.

    Raises:
        ValueError: There are no flights.
    """
    if not flights:
        raise ValueError("no flights, no figures")
    gaps = [flight.gap_m for flight in flights if flight.gap_m is not None]
    return FlightStatistics(
        len(flights),
        sum(flight.completed for flight in flights),
        sum(flight.succeeded for flight in flights),
        sum(flight.contacts for flight in flights),
        sum(flight.contacts > 0 for flight in flights),
        _mean([flight.time_s for flight in flights if flight.completed]),
        min(gaps, default=None),
        _mean(gaps),
        sum(flight.roughness_mps2 for flight in flights) / len(flights),
        sum(flight.recoveries for flight in flights),
        mean_cost(flights),
    )


def statistics_faults(found: Any) -> List[str]:
    """Return the faults of statistics that were read as JSON."""
    optional = ("mean_time_s", "least_gap_m", "mean_gap_m")
    names = [field.name for field in fields(FlightStatistics)]
    if not isinstance(found, dict) or set(found) != set(names):
        return [f"has no statistics of its flights; expected {', '.join(names)}"]
    return [
        f"its statistics have no number for {name}"
        for name in names
        if not is_number(found[name]) and not (found[name] is None and name in optional)
    ]


def _mean(values: Sequence[float]) -> Optional[float]:
    return sum(values) / len(values) if values else None


@dataclass(frozen=True)
class Difference:
    """Mean difference of pairs, and what of it could be chance.

    Attributes:
        pairs: Number of pairs.
        mean: Mean difference.
        low: Lower end of the 95 % confidence interval of the mean, None with a single pair.
        high: Upper end, None with a single pair.
    """

    pairs: int
    mean: float
    low: Optional[float]
    high: Optional[float]

    @property
    def is_claimed(self) -> bool:
        """True if the interval excludes 0, from at least ``MIN_PAIRS`` pairs."""
        if self.low is None or self.high is None or self.pairs < MIN_PAIRS:
            return False
        return self.low > 0.0 or self.high < 0.0


@dataclass(frozen=True)
class Comparison:
    """Flights with a change beside flights without it, of the same missions and seeds.

    Each difference is the value with the change minus the value without it, None without pairs.

    Attributes:
        flights: Number of pairs of flights.
        cost: Difference of the cost.
        completed: Difference of the share of completed missions.
        touched: Difference of the share of flights with contacts.
        time_s: Difference of the times where both flights completed the mission.
        gap_m: Difference of the gaps where both flights have one.
        roughness_mps2: Difference of the roughness.
    """

    flights: int
    cost: Difference
    completed: Difference
    touched: Difference
    time_s: Optional[Difference]
    gap_m: Optional[Difference]
    roughness_mps2: Difference


def compare(after: Sequence[FlightResult], before: Sequence[FlightResult]) -> Comparison:
    """Compare flights with a change to those without it, case by case.

    Raises:
        ValueError: There are no flights, or their numbers differ.
    """
    if not after or len(after) != len(before):
        raise ValueError(f"{len(after)} and {len(before)} flights, expected equal numbers above 0")
    pairs = list(zip(after, before))
    times_s = [a.time_s - b.time_s for a, b in pairs if a.completed and b.completed]
    gaps_m = [a.gap_m - b.gap_m for a, b in pairs if a.gap_m is not None and b.gap_m is not None]
    return Comparison(
        len(pairs),
        paired_difference([cost(a) - cost(b) for a, b in pairs]),
        paired_difference([float(a.completed) - float(b.completed) for a, b in pairs]),
        paired_difference([float(a.contacts > 0) - float(b.contacts > 0) for a, b in pairs]),
        paired_difference(times_s) if times_s else None,
        paired_difference(gaps_m) if gaps_m else None,
        paired_difference([a.roughness_mps2 - b.roughness_mps2 for a, b in pairs]),
    )


def paired_difference(differences: Sequence[float]) -> Difference:
    """Return the mean of differences with its bootstrap interval."""
    interval = mean_interval(differences)
    low, high = (None, None) if interval is None else interval
    return Difference(len(differences), sum(differences) / len(differences), low, high)


def mean_interval(values: Sequence[float]) -> Optional[Tuple[float, float]]:
    """Return the 95 % confidence interval of a mean, None for fewer than two values.

    A bootstrap percentile interval of 10,000 resamples with a fixed seed. Few values resemble each
    other more than the population does, so the percentiles are moved outwards: from 2.5 % to
    Phi(-sqrt(n / (n - 1)) t), where t is the 97.5 % quantile of Student's distribution with n - 1
    degrees of freedom.

    Source: B. Efron, "Bootstrap methods: another look at the jackknife", Annals of Statistics 7,
    1979; T. Hesterberg, "What teachers should know about the bootstrap", The American Statistician
    69, 2015, section 4.4 (the expanded percentile interval).
    """
    count = len(values)
    if count < 2:
        return None
    given = np.asarray(values, np.float64)
    if np.all(given == given[0]):
        return float(given[0]), float(given[0])
    picks = np.random.default_rng(_SEED).integers(0, count, (_RESAMPLES, count))
    means = given[picks].mean(axis=1)
    tail = NormalDist().cdf(-math.sqrt(count / (count - 1)) * _student_quantile(count - 1))
    low, high = np.quantile(means, (tail, 1.0 - tail))
    return float(low), float(high)


def _student_quantile(freedom: int) -> float:
    """Return the 97.5 % quantile of Student's distribution, within 0.1 % from 5 degrees on.

    Source: M. Abramowitz, I. Stegun, "Handbook of Mathematical Functions", 26.7.5.
    """
    z = NormalDist().inv_cdf(0.5 + CONFIDENCE / 2.0)
    return (
        z
        + (z**3 + z) / (4 * freedom)
        + (5 * z**5 + 16 * z**3 + 3 * z) / (96 * freedom**2)
        + (3 * z**7 + 19 * z**5 + 17 * z**3 - 15 * z) / (384 * freedom**3)
    )
