"""Outcome of a study as text, as JSON and as remarks in tuned files."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any, Dict, List, Optional, Sequence, Tuple

import tabulate

from quad_nav.barn.statistics import BarnStatistics
from quad_nav.tuning.barn_course import BarnCourse
from quad_nav.tuning.parameter_files import Change, base_configuration, base_value
from quad_nav.tuning.refinement import Gain
from quad_nav.tuning.score import TERMS
from quad_nav.tuning.space import costmap_paths
from quad_nav.tuning.statistics import FlightStatistics, flight_statistics
from quad_nav.tuning.tune import TuneResult, all_versions

_HEADER = [
    "",
    "flights",
    "all goals\nreached",
    "with\ncontacts",
    "mean\ntime (s)",
    "min\ngap (m)",
    "roughness\n(m/s2)",
    "cost",
]
_BARN_HEADER = [
    "",
    "flights",
    "success\n(%)",
    "95 %\ninterval",
    "collision\n(%)",
    "time-out\n(%)",
    "mean\ntime (s)",
    "metric",
]


def text(result: TuneResult) -> str:
    """Format the outcome for the terminal."""
    parts = [held_out_table(result)]
    if result.refined.gains:
        parts.append(gain_table(result))
    else:
        parts.append("No candidate is better than the base; its parameters are written unchanged.")
    return "\n\n".join(parts)


def held_out_table(result: TuneResult, tablefmt: str = "simple") -> str:
    """Format the statistics of the held-out flights."""
    tables = [
        tabulate.tabulate(
            [statistics_row(name, statistics) for name, statistics in held_out_rows(result)],
            _header(_HEADER, tablefmt),
            tablefmt=tablefmt,
            disable_numparse=True,
            colalign=("left",) + ("right",) * 7,
        )
    ]
    barn = barn_rows(result)
    if barn:
        tables.append(
            "By the benchmark's protocol:\n\n"
            + tabulate.tabulate(
                [barn_row(name, statistics) for name, statistics in barn],
                _header(_BARN_HEADER, tablefmt),
                tablefmt=tablefmt,
                disable_numparse=True,
                colalign=("left",) + ("right",) * 7,
            )
        )
    return "\n\n".join(tables)


def held_out_rows(result: TuneResult) -> Tuple[Tuple[str, FlightStatistics], ...]:
    """Return the statistics of the compared folders, the base and the tuned parameters."""
    return tuple(
        (name, flight_statistics(flights))
        for name, flights in result.held_out.sets(result.setup.course.config)
    )


def barn_rows(result: TuneResult) -> Tuple[Tuple[str, BarnStatistics], ...]:
    """Return the benchmark's statistics of the same flights; empty for other courses."""
    course, held_out = result.setup.course, result.held_out
    if not isinstance(course, BarnCourse):
        return ()
    return tuple(
        (name, course.statistics(held_out.cases, flights))
        for name, flights in held_out.sets(course.config)
    )


def barn_row(name: str, statistics: BarnStatistics) -> List[str]:
    """Format a row of the benchmark's table."""
    low, high = statistics.success_interval
    rates = [
        f"{100 * count / statistics.runs:.1f}"
        for count in (statistics.successes, statistics.collisions, statistics.time_outs)
    ]
    return [
        name,
        str(statistics.runs),
        rates[0],
        f"{100 * low:.1f}-{100 * high:.1f}",
        *rates[1:],
        _figure(statistics.mean_time_s, 1),
        f"{statistics.metric:.3f}",
    ]


def statistics_row(name: str, statistics: FlightStatistics) -> List[str]:
    """Format a row of the table of statistics."""
    return [
        name,
        str(statistics.flights),
        str(statistics.completed),
        str(statistics.touched),
        _figure(statistics.mean_time_s, 1),
        _figure(statistics.least_gap_m, 2),
        f"{statistics.roughness_mps2:.2f}",
        f"{statistics.cost:.3f}",
    ]


def gain_table(result: TuneResult, tablefmt: str = "simple") -> str:
    """Format the changed parameters and their effects."""
    rows = [
        [gain.path, format_value(gain.base), format_value(gain.value), gain_text(gain)]
        for gain in result.refined.gains
    ]
    return tabulate.tabulate(
        rows,
        ["parameter", "base", "tuned", "effect in the flights of the search"],
        tablefmt=tablefmt,
        disable_numparse=True,
    )


def gain_text(gain: Gain) -> str:
    """Describe the effect of a change, most important first: "3.4 s faster"."""
    before, after = gain.without_it, gain.with_it
    words = []
    if after.completed != before.completed:
        words.append(
            f"{after.completed} of {after.flights} missions completed instead of {before.completed}"
        )
    if after.touched != before.touched:
        words.append(
            f"{after.touched} of {after.flights} flights with contacts instead of {before.touched}"
        )
    time_s = gain.time_s
    if time_s is not None and abs(time_s) >= 0.05:
        words.append(f"{abs(time_s):.1f} s {'faster' if time_s > 0 else 'slower'}")
    if before.mean_gap_m is not None and after.mean_gap_m is not None:
        wider_m = after.mean_gap_m - before.mean_gap_m
        if abs(wider_m) >= 0.005:
            words.append(f"gaps {abs(wider_m):.2f} m {'wider' if wider_m > 0 else 'narrower'}")
    smoother = before.roughness_mps2 - after.roughness_mps2
    if abs(smoother) >= 0.05:
        words.append(f"{'smoother' if smoother > 0 else 'rougher'} by {abs(smoother):.2f} m/s2")
    return ", ".join(words) or "no measurable effect"


def changes(result: TuneResult) -> List[Change]:
    """Return all changes of the base's files with their remarks."""
    gains = {gain.path: gain for gain in result.refined.gains}
    base = base_configuration(result.setup.base_folder, ()).to_tree()
    found = [
        Change(path, value, "set with --set")
        for path, value in result.setup.course.fixed
        if base_value(base, path) != value
    ]
    for dimension in result.setup.space.dimensions:
        gain = gains.get(dimension.path)
        if gain is None:
            continue
        found.append(
            Change(
                dimension.path,
                gain.value,
                f"tuned, was {format_value(gain.base)}: {gain_text(gain)}",
            )
        )
        followers = dict(result.setup.space.assignments({dimension.path: gain.value}))
        found += [
            Change(path, followers[costmap_paths(path)[0]], f"follows {dimension.path}")
            for path, _ in dimension.follow
        ]
    return found


def format_value(value: Any) -> str:
    """Format a parameter's value; None is "unset"."""
    if value is None:
        return "unset"
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:g}" if isinstance(value, float) else str(value)


def to_json(result: TuneResult, command: str) -> Dict[str, Any]:
    """Convert the outcome to JSON data."""
    setup, held_out = result.setup, result.held_out
    found = {
        "command": command,
        "versions": all_versions(),
        "seed": setup.options.search.seed,
        "base": setup.course.config,
        "candidates": len(result.trials),
        "score": {term.name: term.weight for term in TERMS},
        "parameters": dict(result.assignments),
        "gains": [{**asdict(gain), "cost": gain.cost} for gain in result.refined.gains],
        "held_out": {name: asdict(statistics) for name, statistics in held_out_rows(result)},
        "held_out_flights": [
            {
                "mission": case.name,
                "seed": case.seed,
                **{
                    name: asdict(flights[k]) for name, flights in held_out.sets(setup.course.config)
                },
            }
            for k, case in enumerate(held_out.cases)
        ],
    }
    if isinstance(setup.course, BarnCourse):
        found["barn"] = {name: asdict(statistics) for name, statistics in barn_rows(result)}
    return found


def markdown(result: TuneResult, command: str) -> str:
    """Format STUDY.md, which documents the origin of the parameters beside it."""
    search = result.setup.options.search
    with_versions = ", ".join(f"{name} {version}" for name, version in all_versions().items())
    gains = (
        gain_table(result, "github")
        if result.refined.gains
        else "No candidate is better than the base."
    )
    return f"""# Tuning study of these parameters

```sh
{command}
```

Seed {search.seed}, {len(result.trials)} candidates of up to {search.flights} flights, from \
`{result.setup.course.config}`; {with_versions}. The same command with these versions gives the \
same result.

## Held-out flights

{held_out_table(result, "github")}

A gap is the smaller of clearance and separation. A lower cost is better.

## Effect of each change

{gains}
"""


def _header(header: Sequence[str], tablefmt: str) -> List[str]:
    """Join the lines of headers for Markdown."""
    return [name.replace("\n", " ") if tablefmt == "github" else name for name in header]


def _figure(value: Optional[float], decimals: int) -> str:
    return "-" if value is None else f"{value:.{decimals}f}"
