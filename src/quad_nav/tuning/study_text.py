"""A study's outcome in words, as JSON, and as remarks in the files that it writes."""

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
    "touched",
    "mean\ntime, s",
    "least\ngap, m",
    "roughness\nm/s2",
    "cost",
]
_BARN_HEADER = [
    "",
    "flights",
    "success\n%",
    "95 %\ninterval",
    "collision\n%",
    "time-out\n%",
    "mean\ntime, s",
    "metric",
]


def text(result: TuneResult) -> str:
    """What the terminal shows at the end."""
    parts = [held_out_table(result)]
    if result.refined.gains:
        parts.append(gain_table(result))
    else:
        parts.append("Nothing that was tried beats the base: its parameters are written unchanged.")
    return "\n\n".join(parts)


def held_out_table(result: TuneResult, tablefmt: str = "simple") -> str:
    """Return the statistics of flights that the search never saw."""
    tables = [
        tabulate.tabulate(
            [figure_row(name, one) for name, one in held_out_rows(result)],
            _header(_HEADER, tablefmt),
            tablefmt=tablefmt,
            disable_numparse=True,
            colalign=("left",) + ("right",) * 7,
        )
    ]
    barn = barn_rows(result)
    if barn:
        tables.append(
            "As the benchmark counts:\n\n"
            + tabulate.tabulate(
                [barn_row(name, one) for name, one in barn],
                _header(_BARN_HEADER, tablefmt),
                tablefmt=tablefmt,
                disable_numparse=True,
                colalign=("left",) + ("right",) * 7,
            )
        )
    return "\n\n".join(tables)


def held_out_rows(result: TuneResult) -> Tuple[Tuple[str, FlightStatistics], ...]:
    """Return the statistics of the base, of what it is compared with, and of the best."""
    return tuple(
        (name, flight_statistics(flights))
        for name, flights in result.held_out.sets(result.setup.course.config)
    )


def barn_rows(result: TuneResult) -> Tuple[Tuple[str, BarnStatistics], ...]:
    """The same flights as the benchmark counts them; none of other courses."""
    course, held_out = result.setup.course, result.held_out
    if not isinstance(course, BarnCourse):
        return ()
    return tuple(
        (name, course.statistics(held_out.cases, flights))
        for name, flights in held_out.sets(course.config)
    )


def barn_row(name: str, one: BarnStatistics) -> List[str]:
    """Cells of the benchmark's table."""
    low, high = one.success_interval
    rates = [
        f"{100 * count / one.runs:.1f}" for count in (one.successes, one.collisions, one.time_outs)
    ]
    return [
        name,
        str(one.runs),
        rates[0],
        f"{100 * low:.1f}-{100 * high:.1f}",
        *rates[1:],
        _figure(one.mean_time_s, 1),
        f"{one.metric:.3f}",
    ]


def figure_row(name: str, one: FlightStatistics) -> List[str]:
    """Cells of the table of figures."""
    return [
        name,
        str(one.flights),
        str(one.completed),
        str(one.touched),
        _figure(one.mean_time_s, 1),
        _figure(one.least_gap_m, 2),
        f"{one.roughness_mps2:.2f}",
        f"{one.cost:.3f}",
    ]


def gain_table(result: TuneResult, tablefmt: str = "simple") -> str:
    """Each changed parameter and what it does."""
    rows = [
        [gain.path, value_words(gain.base), value_words(gain.value), gain_words(gain)]
        for gain in result.refined.gains
    ]
    return tabulate.tabulate(
        rows,
        ["parameter", "base", "tuned", "does, in the flights of the search"],
        tablefmt=tablefmt,
        disable_numparse=True,
    )


def gain_words(gain: Gain) -> str:
    """What a change does, the most important first: "3.4 s sooner, least gap 0.05 m wider"."""
    before, after = gain.without_it, gain.with_it
    words = []
    if after.completed != before.completed:
        words.append(
            f"{after.completed} of {after.flights} missions complete, not {before.completed}"
        )
    if after.touched != before.touched:
        words.append(
            f"{after.touched} of {after.flights} flights touch something, not {before.touched}"
        )
    time_s = gain.time_s
    if time_s is not None and abs(time_s) >= 0.05:
        words.append(f"{abs(time_s):.1f} s {'sooner' if time_s > 0 else 'later'}")
    if before.mean_gap_m is not None and after.mean_gap_m is not None:
        wider_m = after.mean_gap_m - before.mean_gap_m
        if abs(wider_m) >= 0.005:
            words.append(f"gaps {abs(wider_m):.2f} m {'wider' if wider_m > 0 else 'narrower'}")
    smoother = before.roughness_mps2 - after.roughness_mps2
    if abs(smoother) >= 0.05:
        words.append(f"{'smoother' if smoother > 0 else 'rougher'} by {abs(smoother):.2f} m/s2")
    return ", ".join(words) or "hardly anything"


def changes(result: TuneResult) -> List[Change]:
    """Everything that is not as in the base's files, each with its remark."""
    gains = {gain.path: gain for gain in result.refined.gains}
    base = base_configuration(result.setup.base_folder, ()).to_tree()
    found = [
        Change(path, value, "given with --set")
        for path, value in result.setup.course.fixed
        if base_value(base, path) != value
    ]
    for one in result.setup.space.dimensions:
        gain = gains.get(one.path)
        if gain is None:
            continue
        found.append(
            Change(one.path, gain.value, f"tuned, was {value_words(gain.base)}: {gain_words(gain)}")
        )
        followers = dict(result.setup.space.assignments({one.path: gain.value}))
        found += [
            Change(path, followers[costmap_paths(path)[0]], f"follows {one.path}")
            for path, _ in one.follow
        ]
    return found


def value_words(value: Any) -> str:
    """A value as people write it; "unset" for none."""
    if value is None:
        return "unset"
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:g}" if isinstance(value, float) else str(value)


def to_json(result: TuneResult, command: str) -> Dict[str, Any]:
    """Statistics, parameters and what they depend on."""
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
        "held_out": {name: asdict(one) for name, one in held_out_rows(result)},
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
        found["barn"] = {name: asdict(one) for name, one in barn_rows(result)}
    return found


def markdown(result: TuneResult, command: str) -> str:
    """STUDY.md: how the parameters beside it came about."""
    search = result.setup.options.search
    with_versions = ", ".join(f"{name} {version}" for name, version in all_versions().items())
    gains = (
        gain_table(result, "github")
        if result.refined.gains
        else "Nothing that was tried beats the base."
    )
    return f"""# How these parameters were found

```sh
{command}
```

Seed {search.seed}, {len(result.trials)} candidates of up to {search.flights} flights, from \
`{result.setup.course.config}`; {with_versions}. The same command with these versions finds the \
same again.

## Flights that the search never saw

{held_out_table(result, "github")}

Gaps are between hulls. Cost: lower is better.

## What each change does

{gains}
"""


def _header(header: Sequence[str], tablefmt: str) -> List[str]:
    """Markdown's headers have one line."""
    return [name.replace("\n", " ") if tablefmt == "github" else name for name in header]


def _figure(value: Optional[float], decimals: int) -> str:
    return "-" if value is None else f"{value:.{decimals}f}"
