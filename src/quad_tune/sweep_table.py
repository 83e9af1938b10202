"""Rows of a sweep as a table, CSV and JSON."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any, Dict, List, Sequence

from quad_nav.report import results
from quad_nav.versions import versions
from quad_tune.statistics import FlightStatistics
from quad_tune.study_text import format_value
from quad_tune.sweep import SweepRow, SweepSetup

_HEADER = [
    "flights",
    "complete\n(%)",
    "with\ncontacts (%)",
    "mean\ntime (s)",
    "min\ngap (m)",
    "roughness\n(m/s2)",
    "cost",
]


def table(rows: Sequence[SweepRow]) -> str:
    """Format one line per point for the terminal."""
    paths = list(rows[0].point)
    shown = [
        [*(format_value(row.point[path]) for path in paths), *_cells(row.statistics)]
        for row in rows
    ]
    return results.table(shown, [*(path.replace("/", "/\n") for path in paths), *_HEADER], names=0)


def to_json(setup: SweepSetup, rows: Sequence[SweepRow]) -> Dict[str, Any]:
    """Convert points, statistics and flights to JSON data."""
    return {
        "base": setup.course.config,
        "fixed": dict(setup.course.fixed),
        "versions": versions(),
        "rows": [
            {
                "point": row.point,
                "figures": asdict(row.statistics),
                "flights": [
                    {"mission": case.name, "seed": case.seed, **asdict(flight)}
                    for case, flight in zip(setup.cases, row.flights)
                ],
            }
            for row in rows
        ],
    }


def to_csv(rows: Sequence[SweepRow]) -> str:
    """Return one row per point."""
    cells = [
        {
            **{path: format_value(value) for path, value in row.point.items()},
            **asdict(row.statistics),
        }
        for row in rows
    ]
    return results.csv_text(cells, list(cells[0]))


def _cells(statistics: FlightStatistics) -> List[str]:
    return [
        str(statistics.flights),
        f"{100 * statistics.completed / statistics.flights:.0f}",
        f"{100 * statistics.touched / statistics.flights:.0f}",
        results.number_text(statistics.mean_time_s),
        results.number_text(statistics.least_gap_m, 2),
        f"{statistics.roughness_mps2:.2f}",
        f"{statistics.cost:.2f}",
    ]
