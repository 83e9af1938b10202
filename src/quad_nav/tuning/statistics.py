"""Statistics of many flights of one set of parameters."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any, List, Optional, Sequence

from quad_nav.files.values import is_number
from quad_nav.tuning.flight_result import FlightResult
from quad_nav.tuning.score import mean_cost

STATISTICS = "statistics"
"""Name of a trial's attribute with its ``FlightStatistics``."""


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
