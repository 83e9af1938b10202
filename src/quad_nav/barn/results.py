"""Results of the benchmark as text, JSON and CSV."""

from __future__ import annotations

import csv
import io
import math
import textwrap
from dataclasses import asdict, dataclass
from typing import Any, Dict, List, Optional, Sequence, Tuple

import tabulate

from quad_nav.barn.protocol import Run
from quad_nav.barn.setup import SCANS_PER_S, Contestant
from quad_nav.barn.statistics import BarnStatistics, barn_statistics
from quad_nav.barn.worlds import ALTITUDE_M, MARGIN_M
from quad_nav.sim.simulation import STEPS_PER_S
from quad_nav.versions import versions

_WIDTH = 96
_HEADER = [
    "",
    "worlds",
    "flights",
    "success\n(%)",
    "95 %\ninterval",
    "collision\n(%)",
    "time-out\n(%)",
    "mean\ntime (s)",
    "metric",
]
_COLUMNS = (
    "world",
    "run",
    "seed",
    "outcome",
    "time_s",
    "metric",
    "path_length_m",
    "min_clearance_m",
    "recoveries",
    "gave_up",
    "touched",
    "touched_x_m",
    "touched_y_m",
)


@dataclass(frozen=True)
class Results:
    """Runs, in the order of worlds and runs, with their conditions."""

    contestant: Contestant
    runs: Tuple[Run, ...]
    wanted: int
    wall_time_s: float

    @property
    def rows(self) -> List[Tuple[str, BarnStatistics]]:
        """Statistics of the official sample and of all worlds, by name; empty without a run."""
        sample = [run for run in self.runs if run.in_sample]
        rows = [("official sample", barn_statistics(sample))] if sample else []
        if len(sample) < len(self.runs):
            rows.append(("all worlds", barn_statistics(self.runs)))
        return rows

    @property
    def world_rows(self) -> List[Tuple[str, BarnStatistics]]:
        """Statistics of each world, by name."""
        worlds: Dict[int, List[Run]] = {}
        for run in self.runs:
            worlds.setdefault(run.world, []).append(run)
        return [(f"world {number}", barn_statistics(runs)) for number, runs in worlds.items()]


def text(results: Results, per_world: bool = False) -> str:
    """Format the results for a terminal of 100 columns."""
    seeds = sorted({run.seed for run in results.runs})
    with_versions = ", ".join(f"{name} {version}" for name, version in versions().items())
    parts = [_table(results.world_rows)] if per_world and results.runs else []
    parts += [_table(results.rows) if results.runs else "No flight was completed."]
    notes = _collisions(results.runs)
    if len(results.runs) < results.wanted:
        notes.append(f"Interrupted after {len(results.runs)} of {results.wanted} flights.")
    if seeds:
        per_minute = 60.0 * len(results.runs) / max(results.wall_time_s, 1e-3)
        notes.append(
            f"Configuration {results.contestant.name}, seed "
            f"{seeds[0] if len(seeds) == 1 else f'{seeds[0]} to {seeds[-1]}'}, "
            f"{results.wall_time_s:.0f} s, {per_minute:.1f} flights per minute."
        )
    notes.append(with_versions)
    return "\n\n".join([*parts, "\n".join(notes), differences(results.contestant)])


def differences(contestant: Contestant) -> str:
    """Describe how the simulation differs from the challenge, a Jackal in Gazebo."""
    simulation = contestant.simulation
    flight, lidar = simulation.flight, simulation.lidar
    lines = [
        f"body: a quadcopter, radius {simulation.airframe.radius_m:.2f} m, limited to the "
        f"configuration's {flight.max_speed_mps:.2f} m/s and "
        f"{flight.max_yaw_rate_radps:.2f} rad/s, "
        f"and to its own {flight.max_acceleration_mps2:.1f} m/s2 and "
        f"{flight.max_yaw_acceleration_radps2:.1f} rad/s2",
        f"simulator: pybullet at {STEPS_PER_S} Hz, exact odometry, no latency; flight "
        f"altitude {ALTITUDE_M:g} m; any contact is a collision; walls {MARGIN_M:g} m from field, "
        "start and goal",
        f"LIDAR: {math.degrees(lidar.scan_range_rad):.0f} degrees, {lidar.beam_count} beams, "
        f"{lidar.range_min_m:g} to {lidar.range_max_m:g} m, noise {lidar.noise_std_m:g} m, as "
        f"in the challenge; but {SCANS_PER_S} scans per second instead of 50, and mounted at the "
        "centre of the body",
        "clock: it starts with the goal instead of after the first 0.1 m; a goal that "
        "the navigator aborts is a time-out",
    ]
    return wrapped("Differences from the challenge:", lines)


def wrapped(head: str, lines: Sequence[str]) -> str:
    """Format indented paragraphs below a line for a terminal of 100 columns."""
    paragraphs = (
        textwrap.fill(line, _WIDTH, initial_indent="  ", subsequent_indent="    ") for line in lines
    )
    return "\n".join([head, *paragraphs])


def to_json(results: Results) -> Dict[str, Any]:
    """Convert the results to JSON data."""
    return {
        "config": results.contestant.name,
        "seed": results.contestant.seed,
        "flights_wanted": results.wanted,
        "wall_time_s": round(results.wall_time_s, 3),
        "versions": versions(),
        "differences": differences(results.contestant),
        "figures": {name: _statistics_json(row) for name, row in results.rows},
        "worlds": {name: _statistics_json(row) for name, row in results.world_rows},
        "runs": [_run_row(run) for run in results.runs],
    }


def to_csv(results: Results) -> str:
    """Return a row for each run."""
    file = io.StringIO()
    writer = csv.DictWriter(file, _COLUMNS, lineterminator="\n")
    writer.writeheader()
    writer.writerows(_run_row(run) for run in results.runs)
    return file.getvalue().rstrip("\n")


def _table(rows: Sequence[Tuple[str, BarnStatistics]]) -> str:
    return tabulate.tabulate(
        [_row(name, row) for name, row in rows],
        _HEADER,
        tablefmt="simple",
        disable_numparse=True,
        colalign=("left",) + ("right",) * 8,
    )


def _row(name: str, row: BarnStatistics) -> List[str]:
    low, high = row.success_interval
    time = "-" if row.mean_time_s is None else f"{row.mean_time_s:.1f}"
    return [
        name,
        str(row.worlds),
        str(row.runs),
        _percent(row.successes, row.runs),
        f"{100 * low:.1f}-{100 * high:.1f}",
        _percent(row.collisions, row.runs),
        _percent(row.time_outs, row.runs),
        time,
        f"{row.metric:.3f}",
    ]


def _percent(count: int, runs: int) -> str:
    return f"{100 * count / runs:.1f}"


def _collisions(runs: Sequence[Run]) -> List[str]:
    """Describe each collision in a line."""
    lines = []
    for run in runs:
        if run.touched_at_m is not None:
            x_m, y_m = run.touched_at_m
            lines.append(
                f"World {run.world}, seed {run.seed}: touches {run.touched} at "
                f"({x_m:.2f}, {y_m:.2f}) after {run.time_s:.1f} s."
            )
    return lines


def _statistics_json(row: BarnStatistics) -> Dict[str, Any]:
    low, high = row.success_interval
    return {
        **asdict(row),
        "success_rate": _rounded(row.successes / row.runs),
        "success_interval": [_rounded(low), _rounded(high)],
        "mean_time_s": _rounded(row.mean_time_s),
        "metric": _rounded(row.metric),
    }


def _run_row(run: Run) -> Dict[str, Any]:
    x_m, y_m = run.touched_at_m or (None, None)
    return {
        "world": run.world,
        "run": run.run,
        "seed": run.seed,
        "outcome": run.outcome.value,
        "time_s": _rounded(run.time_s),
        "metric": _rounded(run.metric),
        "path_length_m": _rounded(run.path_length_m),
        "min_clearance_m": _rounded(run.min_clearance_m),
        "recoveries": run.recoveries,
        "gave_up": run.gave_up,
        "touched": run.touched,
        "touched_x_m": _rounded(x_m),
        "touched_y_m": _rounded(y_m),
    }


def _rounded(value: Optional[float]) -> Optional[float]:
    return None if value is None else round(value, 4)
