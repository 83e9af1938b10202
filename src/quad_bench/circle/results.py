"""Results of swaps of sides as text, JSON and CSV."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, Dict, List, Optional, Sequence, Tuple

from quad_bench.circle.runs import CircleRun
from quad_bench.circle.setup import METHODS, CircleOptions
from quad_nav.report.results import (
    csv_text,
    interruption,
    interval_text,
    number_text,
    paragraphs,
    percent,
    rounded,
    table,
    versions_text,
    wilson_interval,
    wrapped,
)
from quad_nav.versions import versions

_HEADER = [
    "robots,\nradius",
    "method",
    "flights",
    "success\n(%)",
    "95 %\ninterval",
    "contact\n(%)",
    "mean\n(s)",
    "last\n(s)",
    "slowest\n(s)",
    "detour",
    "gap\n(m)",
]


@dataclass(frozen=True)
class CircleStatistics:
    """Figures of all flights of one number of robots by one method.

    Means are over the flights in which all robots arrived, and None without one.

    Attributes:
        runs: Number of flights.
        successes: Flights in which all arrived without contact.
        touched: Flights with a contact.
        mean_arrival_s: Mean time of arrival.
        last_arrival_s: Mean time of the last arrival.
        slowest_s: Latest arrival of all flights.
        detour: Mean of path length over that of the straight line.
        gap_m: Smallest distance between two hulls.
    """

    runs: int
    successes: int
    touched: int
    mean_arrival_s: Optional[float]
    last_arrival_s: Optional[float]
    slowest_s: Optional[float]
    detour: Optional[float]
    gap_m: float

    @property
    def success_interval(self) -> Tuple[float, float]:
        """The 95 % confidence interval of the success rate."""
        return wilson_interval(self.successes, self.runs)


@dataclass(frozen=True)
class CircleResults:
    """Runs in the order of circles, methods and seeds, with their conditions."""

    options: CircleOptions
    runs: Tuple[CircleRun, ...]
    wanted: int
    wall_time_s: float

    @property
    def rows(self) -> List[Tuple[int, float, str, CircleStatistics]]:
        """Number of robots, radius of the circle, method and figures."""
        groups: Dict[Tuple[int, float, str], List[CircleRun]] = {}
        for run in self.runs:
            groups.setdefault((run.robots, run.radius_m, run.method), []).append(run)
        return [(*group, circle_statistics(runs)) for group, runs in groups.items()]


def in_order(runs: Sequence[CircleRun]) -> Tuple[CircleRun, ...]:
    """Sort runs by number of robots, method and seed."""
    return tuple(sorted(runs, key=lambda one: (one.robots, METHODS.index(one.method), one.run)))


def circle_statistics(runs: Sequence[CircleRun]) -> CircleStatistics:
    """Compute the figures of flights that differ in the seed alone."""
    complete = [run for run in runs if run.arrived == run.robots]
    lasts_s = [run.last_arrival_s or 0.0 for run in complete]
    return CircleStatistics(
        len(runs),
        sum(run.succeeded for run in runs),
        sum(bool(run.contacts) for run in runs),
        _mean([run.mean_arrival_s or 0.0 for run in complete]),
        _mean(lasts_s),
        max(lasts_s, default=None),
        _mean([run.detour for run in complete]),
        min(run.gap_m for run in runs),
    )


def text(results: CircleResults) -> str:
    """Format the results for a terminal of 100 columns."""
    options = results.options
    shown = table([_row(*row) for row in results.rows], _HEADER, names=2)
    seeds = sorted({run.seed for run in results.runs}) or [options.seed]
    notes = [
        *(f"{_name(run)}: {contact}." for run in results.runs for contact in run.contacts[:1]),
        *(f"{_name(run)}: {run.arrived} arrived." for run in results.runs if not _complete(run)),
        *interruption(len(results.runs), results.wanted),
        f"Configuration {options.config}, body radius {options.body_radius_m:g} m, jitter "
        f"{options.jitter_m:g} m, seeds {seeds[0]} to {seeds[-1]}, {results.wall_time_s:.0f} s.",
        "mean, last: arrival, a mean of the flights; slowest: last arrival of all flights; detour: "
        "path by straight line; gap: the least between hulls.",
        versions_text(),
    ]
    methods = wrapped("Methods, with the same starts and the same greatest speed:", METHOD_LINES)
    shown = shown if results.runs else "No flight was completed."
    return "\n\n".join([shown, paragraphs(notes), methods])


METHOD_LINES = (
    "quad: our navigators, as in quad fly",
    "orca: ORCA's velocities, from exact positions, flown by the same simulated quadcopters",
    "orca-points: ORCA's points, which have the velocity at once",
)


def to_json(results: CircleResults) -> Dict[str, Any]:
    """Convert the results to JSON data."""
    options = results.options
    return {
        "config": options.config,
        "seed": options.seed,
        "body_radius_m": options.body_radius_m,
        "jitter_m": options.jitter_m,
        "time_limit_s": options.time_limit_s,
        "orca_horizon_s": options.orca_horizon_s,
        "flights_wanted": results.wanted,
        "wall_time_s": round(results.wall_time_s, 3),
        "versions": versions(),
        "figures": [_figures(*row) for row in results.rows],
        "runs": [{**_run_row(run), "contacts": list(run.contacts)} for run in results.runs],
    }


def to_csv(results: CircleResults) -> str:
    """Return a row for each run, below a header."""
    return csv_text([_run_row(run) for run in results.runs], _RUN_COLUMNS)


def _row(robots: int, radius_m: float, method: str, row: CircleStatistics) -> List[str]:
    return [
        f"{robots}, {radius_m:g} m",
        method,
        str(row.runs),
        percent(row.successes, row.runs),
        interval_text(row.success_interval),
        percent(row.touched, row.runs),
        number_text(row.mean_arrival_s),
        number_text(row.last_arrival_s),
        number_text(row.slowest_s),
        number_text(row.detour, 2),
        number_text(row.gap_m, 2),
    ]


def _figures(robots: int, radius_m: float, method: str, row: CircleStatistics) -> Dict[str, Any]:
    return {
        "robots": robots,
        "radius_m": radius_m,
        "method": method,
        **_rounded(asdict(row)),
        "success_interval": [rounded(end) for end in row.success_interval],
    }


def _rounded(values: Dict[str, Any]) -> Dict[str, Any]:
    return {
        name: rounded(value) if isinstance(value, float) else value
        for name, value in values.items()
    }


_RUN_COLUMNS = (
    *("robots", "radius_m", "method", "run", "seed", "succeeded", "arrived", "contacts"),
    *("mean_arrival_s", "last_arrival_s", "detour", "gap_m", "sim_time_s"),
)


def _run_row(run: CircleRun) -> Dict[str, Any]:
    values = {name: getattr(run, name) for name in _RUN_COLUMNS}
    return _rounded({**values, "contacts": len(run.contacts)})


def _complete(run: CircleRun) -> bool:
    return run.arrived == run.robots


def _name(run: CircleRun) -> str:
    return f"{run.robots} robots, {run.method}, seed {run.seed}"


def _mean(values: Sequence[float]) -> Optional[float]:
    return sum(values) / len(values) if values else None
