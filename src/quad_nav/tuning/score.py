"""How good a flight is: one number, lower is better.

``TERMS`` is the whole of it. Their weights are so far apart that within one flight the first
term outweighs all below it, and the second all below that: a goal that was not reached costs
at least 5000, a contact 50 to 100, everything else less than 50 together.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Callable, Sequence, Tuple

from quad_nav.tuning.flight_result import FlightResult

COMFORTABLE_GAP_M = 0.3
SLOWEST_S_PER_M = 30.0
ROUGHEST_MPS2 = 10.0


@dataclass(frozen=True)
class Term:
    """``value`` of a flight times ``weight`` is what the term costs."""

    name: str
    weight: float
    what: str
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
        "0 when every goal was reached, else from 0.5 (all but few) to 1 (none)",
        _failure,
    ),
    Term("contacts", 100.0, "0 for none, 0.5 for one, 0.75 for two, ... towards 1", _contact),
    Term(
        "time",
        1.0,
        f"seconds for each metre of the longest straight way, at most {SLOWEST_S_PER_M:g}",
        _pace_s_per_m,
    ),
    Term(
        "clearance",
        1.0,
        f"0 when nothing came nearer than {COMFORTABLE_GAP_M:g} m, hull to "
        "hull, up to 1 for a touch",
        _tightness,
    ),
    Term(
        "smoothness", 0.5, f"change of commands, m/s^2, at most {ROUGHEST_MPS2:g}", _roughness_mps2
    ),
)


def cost(flight: FlightResult) -> float:
    """The sum of all terms."""
    return sum(term.weight * term.value(flight) for term in TERMS)


def mean_cost(flights: Sequence[FlightResult]) -> float:
    """Of at least one flight; summed in their order, so that equal flights cost the same."""
    return sum(map(cost, flights)) / len(flights)
