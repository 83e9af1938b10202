"""Outcome of a study as text, as JSON and as remarks in tuned files."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any, Dict, List, Sequence, Tuple

import tabulate

from quad_nav.report.results import number_text
from quad_tune.courses import ProtocolStatistics
from quad_tune.parameter_files import Change, base_configuration, base_value
from quad_tune.refinement import Gain
from quad_tune.score import TERMS
from quad_tune.space import costmap_paths
from quad_tune.statistics import (
    CONFIDENCE,
    MIN_PAIRS,
    Comparison,
    Difference,
    FlightStatistics,
    flight_statistics,
)
from quad_tune.tune import TuneResult, all_versions

INTERVAL_TEXT = (
    "Intervals are 95 % bootstrap intervals of the mean difference of flights of the same mission "
    "and seed. A difference is named only if its interval excludes 0, with at least "
    f"{MIN_PAIRS} flights."
)
_CHANCE = "not distinguishable from chance"
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


def text(result: TuneResult) -> str:
    """Format the outcome for the terminal."""
    parts = [held_out_table(result), "\n".join(held_out_lines(result))]
    parts.append(gain_table(result) if result.refined.gains else unchanged_text(result))
    return "\n\n".join(parts)


def unchanged_text(result: TuneResult) -> str:
    """Say why a study keeps the base's parameters."""
    if result.refined.has_completed:
        return "No candidate is better than the base; its parameters are written unchanged."
    base = result.setup.course.config
    return (
        "No flight completed its mission, neither with the base nor with a candidate that reaches "
        f"more goals. The parameters of {base} are written unchanged. Fly the mission once with "
        "quad fly to see what stops it."
    )


def held_out_lines(result: TuneResult) -> List[str]:
    """Compare the tuned parameters to each other set in the held-out flights, a line for each."""
    lines = [
        f"tuned compared to {name}: {comparison_text(comparison)}"
        for name, comparison in result.held_out.comparisons(result.setup.course.config)
        if result.refined.values or name != result.setup.course.config
    ]
    if not any(flight.completed for flight in result.held_out.tuned):
        lines.append("No held-out flight of the tuned parameters completed its mission.")
    return lines


def verdict(result: TuneResult) -> Tuple[str, str]:
    """Return what the held-out flights show of the tuned parameters.

    Returns:
        A short text, and "good", "bad" or "unclear".
    """
    if not result.refined.values:
        return "Base kept: no candidate is better", "unclear"
    name, comparison = result.held_out.comparisons(result.setup.course.config)[-1]
    count = comparison.flights
    if not comparison.cost.is_claimed:
        return f"{_CHANCE} with {_flights(count)}".capitalize(), "unclear"
    if comparison.cost.mean < 0.0:
        return f"Better than {name} in {_flights(count)}", "good"
    return f"Worse than {name} in {_flights(count)}", "bad"


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
    rows = protocol_rows(result)
    if rows:
        columns = rows[0][1].columns
        tables.append(
            "By the benchmark's protocol:\n\n"
            + tabulate.tabulate(
                [(name, *statistics.cells) for name, statistics in rows],
                _header(["", *columns], tablefmt),
                tablefmt=tablefmt,
                disable_numparse=True,
                colalign=("left",) + ("right",) * len(columns),
            )
        )
    return "\n\n".join(tables)


def held_out_rows(result: TuneResult) -> Tuple[Tuple[str, FlightStatistics], ...]:
    """Return the statistics of the compared folders, the base and the tuned parameters."""
    return tuple(
        (name, flight_statistics(flights))
        for name, flights in result.held_out.sets(result.setup.course.config)
    )


def protocol_rows(result: TuneResult) -> Tuple[Tuple[str, ProtocolStatistics], ...]:
    """Return a benchmark's own statistics of the same flights; empty for other courses."""
    course, held_out = result.setup.course, result.held_out
    found = [
        (name, course.protocol_statistics(held_out.cases, flights))
        for name, flights in held_out.sets(course.config)
    ]
    return tuple((name, statistics) for name, statistics in found if statistics is not None)


def statistics_row(name: str, statistics: FlightStatistics) -> List[str]:
    """Format a row of the table of statistics."""
    return [
        name,
        str(statistics.flights),
        str(statistics.completed),
        str(statistics.touched),
        number_text(statistics.mean_time_s),
        number_text(statistics.least_gap_m, 2),
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
    """Describe the effect of a change: "3.4 s faster (95 %: 2.0 to 4.9)"."""
    return comparison_text(gain.difference)


def comparison_text(found: Comparison) -> str:
    """Describe the differences that are no chance, most important first, with their intervals."""
    words = [
        f"{part:.0f} % {'more' if share.mean > 0 else 'fewer'} {what} ({_interval(share, 100, 0)})"
        for share, what in (
            (found.completed, "completed missions"),
            (found.touched, "flights with contacts"),
        )
        for part in (100 * abs(share.mean),)
        if share.is_claimed
    ]
    words += [
        f"{prefix}{abs(one.mean):.{decimals}f}{unit} {up if one.mean > 0 else down}"
        f" ({_interval(one, 1, decimals)})"
        for one, prefix, decimals, unit, up, down in (
            (found.time_s, "", 1, " s", "slower", "faster"),
            (found.gap_m, "gaps ", 2, " m", "wider", "narrower"),
            (found.roughness_mps2, "", 2, " m/s2", "rougher", "smoother"),
        )
        if one is not None and one.is_claimed and round(abs(one.mean), decimals) > 0.0
    ]
    if words:
        return ", ".join(words)
    return _cost_text(found)


def _cost_text(found: Comparison) -> str:
    cost = found.cost
    if cost.is_claimed:
        word = "lower" if cost.mean < 0.0 else "higher"
        return f"cost {abs(cost.mean):.3f} {word} ({_interval(cost, 1, 3)})"
    if cost.mean == cost.low == cost.high == 0.0:
        return f"no effect in {_flights(found.flights)}"
    return f"{_CHANCE} with {_flights(found.flights)}"


def _interval(found: Difference, factor: float, decimals: int) -> str:
    """Format the interval of a difference that is no chance, without its sign."""
    assert found.low is not None and found.high is not None
    low, high = sorted((factor * abs(found.low), factor * abs(found.high)))
    return f"95 %: {low:.{decimals}f} to {high:.{decimals}f}"


def _flights(count: int) -> str:
    return f"{count} flight{'s' * (count != 1)}"


def changes(result: TuneResult) -> List[Change]:
    """Return all changes of the base's files with their remarks."""
    gains = {gain.path: gain for gain in result.refined.gains}
    base = base_configuration(result.setup.base_source, ()).to_tree()
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
    found: Dict[str, Any] = {
        "command": command,
        "versions": all_versions(),
        "seed": setup.options.search.seed,
        "base": setup.course.config,
        "candidates": len(result.trials),
        "score": {term.name: term.weight for term in TERMS},
        "parameters": dict(result.assignments),
        "gains": [{**asdict(gain), "cost": gain.cost} for gain in result.refined.gains],
        "held_out": {name: asdict(statistics) for name, statistics in held_out_rows(result)},
        "confidence": CONFIDENCE,
        "held_out_differences": {
            name: asdict(comparison)
            for name, comparison in held_out.comparisons(setup.course.config)
        },
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
    for name, statistics in protocol_rows(result):
        found.setdefault(statistics.benchmark, {})[name] = statistics.data
    return found


def markdown(result: TuneResult, command: str) -> str:
    """Format STUDY.md, which documents the origin of the parameters beside it."""
    search = result.setup.options.search
    with_versions = ", ".join(f"{name} {version}" for name, version in all_versions().items())
    gains = gain_table(result, "github") if result.refined.gains else unchanged_text(result)
    lines = "\n".join(f"* {line}" for line in held_out_lines(result))
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

{lines}

{INTERVAL_TEXT}

## Effect of each change

{gains}
"""


def _header(header: Sequence[str], tablefmt: str) -> List[str]:
    """Join the lines of headers for Markdown."""
    return [name.replace("\n", " ") if tablefmt == "github" else name for name in header]
