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

_OUTCOME_HEADER = [
    "",
    "worlds",
    "flights",
    "success\n(%)",
    "95 %\ninterval",
    "collision\n(%)",
    "time-out\n(%)",
    "mean\ntime (s)",
]


@dataclass(frozen=True)
class Results:
    """Runs, in the order of worlds and runs, with their conditions."""

    contestant: Contestant
    runs: Sequence[Run]
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
        return [(f"world {number}", barn_statistics(flown)) for number, flown in worlds.items()]

    def text(self, per_world: bool = False) -> str:
        """Format the results for a terminal of 100 columns."""
        parts = [self._table(self.world_rows)] if per_world and self.runs else []
        parts += [self._table(self.rows) if self.runs else "No flight was completed."]
        notes = [*_collisions(self.runs), *interruption(len(self.runs), self.wanted)]
        notes += [self.conditions(), versions_text()]
        return "\n\n".join([*parts, "\n".join(notes), self.differences()])

    def conditions(self) -> str:
        """Describe the conditions in a line."""
        per_minute = 60.0 * len(self.runs) / max(self.wall_time_s, 1e-3)
        return (
            f"Configuration {self.contestant.name}, first seed {self.contestant.seed}, "
            f"{self.wall_time_s:.0f} s, {per_minute:.1f} flights per minute."
        )

    def differences(self) -> str:
        """Describe how the simulation differs from the challenge, a Jackal in Gazebo."""
        simulation = self.contestant.simulation
        flight, lidar = simulation.flight, simulation.lidar
        lines = [
            f"body: a quadcopter, radius {simulation.airframe.radius_m:.2f} m, limited to the "
            f"configuration's {flight.max_speed_mps:.2f} m/s and "
            f"{flight.max_yaw_rate_radps:.2f} rad/s, "
            f"and to its own {flight.max_acceleration_mps2:.1f} m/s2 and "
            f"{flight.max_yaw_acceleration_radps2:.1f} rad/s2",
            f"simulator: pybullet at {STEPS_PER_S} Hz, exact odometry, no latency; flight "
            f"altitude {ALTITUDE_M:g} m; any contact is a collision; walls {MARGIN_M:g} m from "
            "field, start and goal",
            f"LIDAR: {math.degrees(lidar.scan_range_rad):.0f} degrees, {lidar.beam_count} beams, "
            f"{lidar.range_min_m:g} to {lidar.range_max_m:g} m, noise {lidar.noise_std_m:g} m, as "
            f"in the challenge; but {SCANS_PER_S} scans per second instead of 50, and mounted at "
            "the centre of the body",
            "clock: it starts with the goal instead of after the first 0.1 m; a goal that "
            "the navigator aborts is a time-out",
        ]
        return wrapped("Differences from the challenge:", lines)

    def to_json(self) -> Dict[str, Any]:
        """Convert the results to JSON data."""
        return {
            "config": self.contestant.name,
            "seed": self.contestant.seed,
            "flights_wanted": self.wanted,
            "wall_time_s": round(self.wall_time_s, 3),
            "versions": versions(),
            "differences": self.differences(),
            "figures": {name: self._statistics(row) for name, row in self.rows},
            "worlds": {name: self._statistics(row) for name, row in self.world_rows},
            "runs": [self._run_row(run) for run in self.runs],
        }

    def to_csv(self) -> str:
        """Return a row for each run, below a header."""
        return csv_text([self._run_row(run) for run in self.runs], self._RUN_COLUMNS.split())

    def _table(self, rows: Sequence[Tuple[str, BarnStatistics]]) -> str:
        return table(
            [[*_outcome_cells(name, row), self._last_cell(name, row)] for name, row in rows],
            [*_OUTCOME_HEADER, self._LAST_COLUMN],
        )

    _LAST_COLUMN = "metric"
    _RUN_COLUMNS = (
        "world run seed outcome time_s metric path_length_m min_clearance_m recoveries"
        " gave_up touched touched_x_m touched_y_m"
    )

    def _last_cell(self, name: str, row: BarnStatistics) -> str:
        return f"{row.metric:.3f}"

    def _statistics(self, row: BarnStatistics) -> Dict[str, Any]:
        """Convert statistics to JSON data."""
        low, high = row.success_interval
        return {
            **asdict(row),
            "success_rate": rounded(row.successes / row.runs),
            "success_interval": [rounded(low), rounded(high)],
            "mean_time_s": rounded(row.mean_time_s),
            "metric": rounded(row.metric),
        }

    def _run_row(self, run: Any) -> Dict[str, Any]:
        """Return a run's values by the names of their columns."""
        row: Dict[str, Any] = {
            name: rounded(value) if isinstance(value, float) else value
            for name, value in asdict(run).items()
        }
        x_m, y_m = row.pop("touched_at_m") or (None, None)
        row.update(touched_x_m=rounded(x_m), touched_y_m=rounded(y_m), outcome=run.outcome.value)
        return row


def _outcome_cells(name: str, row: BarnStatistics) -> List[str]:
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
    return [
        f"World {run.world}, seed {run.seed}: touches {run.touched} at "
        f"({run.touched_at_m[0]:.2f}, {run.touched_at_m[1]:.2f}) after {run.time_s:.1f} s."
        for run in runs
        if run.touched_at_m is not None
    ]
