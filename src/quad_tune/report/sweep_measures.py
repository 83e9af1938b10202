"""Measures of a sweep's report, each with its interval, and how their axes are drawn."""

from __future__ import annotations

from typing import Any, Callable, List, NamedTuple, Optional, Sequence, Tuple

from quad_nav.report.results import wilson_interval
from quad_tune.flight_result import FlightResult
from quad_tune.score import cost
from quad_tune.statistics import mean_interval
from quad_tune.study_text import format_value

_LOG_FROM = 20.0  # ratio of the largest to the smallest value, above which an axis is logarithmic


class Estimate(NamedTuple):
    """Value of a measure with its 95 % interval, from so many flights; None where unknown."""

    flights: int
    value: Optional[float] = None
    low: Optional[float] = None
    high: Optional[float] = None

    def reach(self) -> Tuple[float, float]:
        """Return how far the interval reaches below and above the value, 0 without one."""
        if self.value is None or self.low is None or self.high is None:
            return 0.0, 0.0
        return max(self.value - self.low, 0.0), max(self.high - self.value, 0.0)

    def text(self, decimals: int) -> str:
        """Format value, interval and number of flights."""
        if self.value is None:
            return f"unknown, {self.flights} flights"
        words = f"{self.value:.{decimals}f}"
        if self.low is not None and self.high is not None:
            words += f" (95 %: {self.low:.{decimals}f} to {self.high:.{decimals}f})"
        return f"{words}, {self.flights} flight{'s' * (self.flights != 1)}"


class Measure(NamedTuple):
    """Measure of a panel.

    Attributes:
        title: Name with its unit.
        more_is_better: False if less is better.
        decimals: Decimals of shown values.
        estimate: Computes the measure of a point's flights.
        of_flight: Value of one flight, None where it has none; None for shares.
    """

    title: str
    more_is_better: bool
    decimals: int
    estimate: Callable[[Sequence[FlightResult]], Estimate]
    of_flight: Optional[Callable[[FlightResult], Optional[float]]] = None

    @property
    def is_percentage(self) -> bool:
        """True if the values are percentages."""
        return self.title.endswith("(%)")

    def of_flights(self, flights: Sequence[FlightResult]) -> List[float]:
        """Return the value of each flight that has one."""
        found = [self.of_flight(flight) for flight in flights] if self.of_flight else []
        return [value for value in found if value is not None]


def _share(is_counted: Callable[[FlightResult], bool]) -> Callable[..., Estimate]:
    def estimate(flights: Sequence[FlightResult]) -> Estimate:
        count = sum(map(is_counted, flights))
        low, high = wilson_interval(count, len(flights))
        return Estimate(len(flights), 100.0 * count / len(flights), 100.0 * low, 100.0 * high)

    return estimate


def _mean(of_flight: Callable[[FlightResult], Optional[float]]) -> Callable[..., Estimate]:
    def estimate(flights: Sequence[FlightResult]) -> Estimate:
        values = [value for value in map(of_flight, flights) if value is not None]
        if not values:
            return Estimate(0)
        low, high = mean_interval(values) or (None, None)
        return Estimate(len(values), sum(values) / len(values), low, high)

    return estimate


def _least_gap(flights: Sequence[FlightResult]) -> Estimate:
    gaps = [flight.gap_m for flight in flights if flight.gap_m is not None]
    return Estimate(len(gaps), min(gaps, default=None))


def _time_s(flight: FlightResult) -> Optional[float]:
    return flight.time_s if flight.completed else None


def _roughness(flight: FlightResult) -> Optional[float]:
    return flight.roughness_mps2


def _gap_m(flight: FlightResult) -> Optional[float]:
    return flight.gap_m


MEASURES: Tuple[Measure, ...] = (
    Measure("Completed missions (%)", True, 0, _share(lambda flight: flight.completed)),
    Measure("Flights with contacts (%)", False, 0, _share(lambda flight: flight.contacts > 0)),
    Measure("Mean mission time (s)", False, 1, _mean(_time_s), _time_s),
    Measure("Min gap (m)", True, 2, _least_gap, _gap_m),
    Measure("Roughness (m/s²)", False, 2, _mean(_roughness), _roughness),
    Measure("Cost", False, 2, _mean(cost), cost),
)
EXPLANATIONS: Tuple[Tuple[str, str], ...] = (
    ("Gap", "smaller of clearance and separation, the smallest of all flights of the point."),
    ("Mission time", "from the first goal to the last one's end, of completed missions."),
    (
        "Roughness",
        "mean change of the commands per second, Σ(|Δv| + 0.3 m · |Δω|) divided by the flight's "
        "time, in m/s²; constant commands have 0.",
    ),
    (
        "Cost",
        "score that quad tune minimises, the mean of 10000 · missed goals + 100 · contacts + time "
        "per metre of the straight path + closeness below 0.3 m + 0.5 · roughness; docs/tuning.md "
        "defines each term. A mission that was not completed costs 5000 or more.",
    ),
)


def is_numeric(values: Sequence[Any]) -> bool:
    """Return true if all values are numbers; only these may be joined by a line."""
    return all(isinstance(value, (int, float)) and not isinstance(value, bool) for value in values)


def is_log(values: Sequence[float]) -> bool:
    """Return true if numbers are spread so far that their axis is logarithmic."""
    return min(values) > 0.0 and max(values) / min(values) >= _LOG_FROM


def starts_at_zero(values: Sequence[float]) -> bool:
    """Return true if the axis of a swept parameter starts at 0."""
    return not is_log(values) and 0.0 <= min(values) <= 0.5 * max(values)


def axis_note(path: str, values: Sequence[float]) -> str:
    """Say how the horizontal axis of a parameter is drawn, if it does not start at 0."""
    if is_log(values):
        return f"The horizontal axis of {path} is logarithmic."
    return "" if starts_at_zero(values) else f"The axis of {path} does not start at 0."


def point_text(point: Sequence[Any]) -> str:
    """Format the values of a point; plugins lose their package."""
    return ", ".join(format_value(value).rpartition("/")[2] for value in point)
