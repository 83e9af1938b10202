"""Score of a flight: one number, lower is better.

``TERMS`` defines it. The weights are so far apart that within one flight the first term outweighs
all others, and the second all below it: a goal that was not reached costs at least 5000, a
contact 50 to 100, everything else less than 50 in total.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Callable, Sequence, Tuple

from quad_tune.flight_result import FlightResult

COMFORTABLE_GAP_M = 0.3
SLOWEST_S_PER_M = 30.0
ROUGHEST_MPS2 = 10.0


@dataclass(frozen=True)
class Term:
    """Term of the score: the value of a flight times ``weight`` is its cost."""

    name: str
    weight: float
    description: str
    value: Callable[[FlightResult], float]


def _failure(flight: FlightResult) -> float:
    if flight.completed:
        return 0.0
    return 0.5 + 0.5 * (1.0 - flight.reached / max(flight.goals, 1))


def _contact(flight: FlightResult) -> float:
    return 1.0 - 0.5**flight.contacts


def _pace_s_per_m(flight: FlightResult) -> float:
    return min(flight.time_s / max(flight.straight_m, 1e-3), SLOWEST_S_PER_M)


def _tightness(flight: FlightResult) -> float:
    if flight.gap_m is None:
        return 0.0
    return min(max(1.0 - flight.gap_m / COMFORTABLE_GAP_M, 0.0), 1.0)


def _roughness_mps2(flight: FlightResult) -> float:
    return min(flight.roughness_mps2, ROUGHEST_MPS2)


TERMS: Tuple[Term, ...] = (
    Term(
        "goals",
        10000.0,
        "0 if every goal was reached, otherwise from 0.5 (almost all) to 1 (none)",
        _failure,
    ),
    Term("contacts", 100.0, "0 for none, 0.5 for one, 0.75 for two, approaching 1", _contact),
    Term(
        "time",
        1.0,
        f"seconds per metre of the longest straight path, at most {SLOWEST_S_PER_M:g}",
        _pace_s_per_m,
    ),
    Term(
        "clearance",
        1.0,
        f"0 for gaps of {COMFORTABLE_GAP_M:g} m or more, rising to 1 for a contact",
        _tightness,
    ),
    Term(
        "smoothness",
        0.5,
        f"change of commands in m/s^2, at most {ROUGHEST_MPS2:g}",
        _roughness_mps2,
    ),
)


def cost(flight: FlightResult) -> float:
    """Sum all terms of a flight."""
    return sum(term.weight * term.value(flight) for term in TERMS)


def mean_cost(flights: Sequence[FlightResult]) -> float:
    """Return the mean cost of at least one flight.

    It is summed in the flights' order, so equal flights have equal costs.
    """
    return sum(map(cost, flights)) / len(flights)
