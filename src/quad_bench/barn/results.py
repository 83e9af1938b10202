"""Results of the benchmark as text, JSON and CSV."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any, Dict, List, Sequence, Tuple

from quad_bench.barn.protocol import Run
from quad_bench.barn.setup import SCANS_PER_S, Contestant
from quad_bench.barn.statistics import BarnStatistics, barn_statistics
from quad_bench.barn.worlds import ALTITUDE_M, MARGIN_M
from quad_nav.report.results import (
    csv_text,
    interruption,
    interval_text,
    number_text,
    percent,
    rounded,
    table,
    versions_text,
    wrapped,
)
from quad_nav.sim.simulation_params import STEPS_PER_S
from quad_nav.versions import versions

OUTCOME_HEADER = [
    "",
    "worlds",
    "flights",
    "success\n(%)",
    "95 %\ninterval",
    "collision\n(%)",
    "time-out\n(%)",
    "mean\ntime (s)",
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
        return world_statistics(self.runs)


def world_statistics(runs: Sequence[Run]) -> List[Tuple[str, BarnStatistics]]:
    """Return the statistics of each world, by name."""
    worlds: Dict[int, List[Run]] = {}
    for run in runs:
        worlds.setdefault(run.world, []).append(run)
    return [(f"world {number}", barn_statistics(flown)) for number, flown in worlds.items()]


def text(results: Results, per_world: bool = False) -> str:
    """Format the results for a terminal of 100 columns."""
    seeds = sorted({run.seed for run in results.runs})
    parts = [_table(results.world_rows)] if per_world and results.runs else []
    parts += [_table(results.rows) if results.runs else "No flight was completed."]
    notes = _collisions(results.runs)
    notes += interruption(len(results.runs), results.wanted)
    if seeds:
        per_minute = 60.0 * len(results.runs) / max(results.wall_time_s, 1e-3)
        notes.append(
            f"Configuration {results.contestant.name}, seed "
            f"{seeds[0] if len(seeds) == 1 else f'{seeds[0]} to {seeds[-1]}'}, "
            f"{results.wall_time_s:.0f} s, {per_minute:.1f} flights per minute."
        )
    notes.append(versions_text())
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


def to_json(results: Results) -> Dict[str, Any]:
    """Convert the results to JSON data."""
    return {
        "config": results.contestant.name,
        "seed": results.contestant.seed,
        "flights_wanted": results.wanted,
        "wall_time_s": round(results.wall_time_s, 3),
        "versions": versions(),
        "differences": differences(results.contestant),
        "figures": {name: statistics_json(row) for name, row in results.rows},
        "worlds": {name: statistics_json(row) for name, row in results.world_rows},
        "runs": [run_row(run) for run in results.runs],
    }


def to_csv(results: Results) -> str:
    """Return a row for each run."""
    return csv_text([run_row(run) for run in results.runs], _COLUMNS)


def _table(rows: Sequence[Tuple[str, BarnStatistics]]) -> str:
    return table(
        [[*outcome_cells(name, row), f"{row.metric:.3f}"] for name, row in rows],
        [*OUTCOME_HEADER, "metric"],
    )


def outcome_cells(name: str, row: BarnStatistics) -> List[str]:
    """Return the cells below ``OUTCOME_HEADER``."""
    return [
        name,
        str(row.worlds),
        str(row.runs),
        percent(row.successes, row.runs),
        interval_text(row.success_interval),
        percent(row.collisions, row.runs),
        percent(row.time_outs, row.runs),
        number_text(row.mean_time_s),
    ]


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


def statistics_json(row: BarnStatistics) -> Dict[str, Any]:
    """Convert statistics to JSON data."""
    low, high = row.success_interval
    return {
        **asdict(row),
        "success_rate": rounded(row.successes / row.runs),
        "success_interval": [rounded(low), rounded(high)],
        "mean_time_s": rounded(row.mean_time_s),
        "metric": rounded(row.metric),
    }


def run_row(run: Run) -> Dict[str, Any]:
    """Return a run's values by the names of their columns."""
    x_m, y_m = run.touched_at_m or (None, None)
    return {
        "world": run.world,
        "run": run.run,
        "seed": run.seed,
        "outcome": run.outcome.value,
        "time_s": rounded(run.time_s),
        "metric": rounded(run.metric),
        "path_length_m": rounded(run.path_length_m),
        "min_clearance_m": rounded(run.min_clearance_m),
        "recoveries": run.recoveries,
        "gave_up": run.gave_up,
        "touched": run.touched,
        "touched_x_m": rounded(x_m),
        "touched_y_m": rounded(y_m),
    }
