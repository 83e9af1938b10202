"""Rows of a sweep as a table, CSV and JSON."""

from __future__ import annotations

import csv
import io
from dataclasses import asdict, fields
from typing import Any, Dict, List, Optional, Sequence

import tabulate

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
    header = [path.replace("/", "/\n") for path in paths]
    return tabulate.tabulate(
        shown,
        [*header, *_HEADER],
        tablefmt="simple",
        disable_numparse=True,
        colalign=("right",) * (len(paths) + len(_HEADER)),
    )


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
    file = io.StringIO()
    names = [field.name for field in fields(FlightStatistics)]
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow([*rows[0].point, *names])
    for row in rows:
        figures = asdict(row.statistics)
        writer.writerow(
            [*map(format_value, row.point.values()), *(figures[name] for name in names)]
        )
    return file.getvalue().rstrip("\n")


def _cells(statistics: FlightStatistics) -> List[str]:
    return [
        str(statistics.flights),
        _percent(statistics.completed, statistics),
        _percent(statistics.touched, statistics),
        _figure(statistics.mean_time_s, 1),
        _figure(statistics.least_gap_m, 2),
        f"{statistics.roughness_mps2:.2f}",
        f"{statistics.cost:.2f}",
    ]


def _percent(count: int, statistics: FlightStatistics) -> str:
    return f"{100 * count / statistics.flights:.0f}"


def _figure(value: Optional[float], decimals: int) -> str:
    return "-" if value is None else f"{value:.{decimals}f}"
