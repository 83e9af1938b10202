"""Results of DynaBARN as text, JSON and CSV."""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass
from typing import Any, Dict, List, Sequence, Tuple

import tabulate

from quad_nav.barn.dynamic import PHASE_S, PUBLISHED, DynamicRun
from quad_nav.barn.dynamic_worlds import ALTITUDE_M, DIFFICULTIES
from quad_nav.barn.results import wrapped
from quad_nav.barn.setup import Contestant
from quad_nav.barn.statistics import BarnStatistics, barn_statistics
from quad_nav.versions import versions

_HEADER = [
    "",
    "worlds",
    "flights",
    "success\n(%)",
    "95 %\ninterval",
    "collision\n(%)",
    "time-out\n(%)",
    "mean\ntime (s)",
    "published\nDWA (%)",
]


@dataclass(frozen=True)
class DynamicResults:
    """Runs, in the order of worlds and runs, with their conditions."""

    contestant: Contestant
    interpolation: str
    runs: Tuple[DynamicRun, ...]
    wanted: int
    wall_time_s: float

    @property
    def rows(self) -> List[Tuple[str, BarnStatistics]]:
        """Statistics of each difficulty and of all worlds, by name; empty without a run."""
        rows = []
        for number, name in enumerate(DIFFICULTIES):
            runs = [run for run in self.runs if run.difficulty == number]
            rows += [(name, barn_statistics(runs))] if runs else []
        return rows if len(rows) < 2 else [*rows, ("all", barn_statistics(self.runs))]

    @property
    def world_rows(self) -> List[Tuple[str, BarnStatistics]]:
        """Statistics of each world, by name."""
        worlds: Dict[int, List[DynamicRun]] = {}
        for run in self.runs:
            worlds.setdefault(run.world, []).append(run)
        return [(f"world {number}", barn_statistics(runs)) for number, runs in worlds.items()]


def text(results: DynamicResults, per_world: bool = False) -> str:
    """Format the results for a terminal of 100 columns."""
    parts = [_table(results.world_rows)] if per_world and results.runs else []
    parts += [_table(results.rows) if results.runs else "No flight was completed."]
    notes = []
    if len(results.runs) < results.wanted:
        notes.append(f"Interrupted after {len(results.runs)} of {results.wanted} flights.")
    notes.append(
        f"Configuration {results.contestant.name}, {results.interpolation} interpolation, first "
        f"seed {results.contestant.seed}, {results.wall_time_s:.0f} s."
    )
    notes.append(", ".join(f"{name} {version}" for name, version in versions().items()))
    return "\n\n".join([*parts, "\n".join(notes), differences(results)])


def differences(results: DynamicResults) -> str:
    """Describe how the simulation differs from the published one, a Jackal in Gazebo."""
    simulation = results.contestant.simulation
    return wrapped(
        "Differences from the published figures, which are of a Jackal in Gazebo and 60 worlds:",
        [
            f"body: a quadcopter, radius {simulation.airframe.radius_m:.2f} m, limited to "
            f"{simulation.flight.max_speed_mps:.2f} m/s; flight altitude {ALTITUDE_M:g} m among "
            "obstacles and walls that stand on the floor",
            "exact odometry, no latency; the clock starts with the goal instead of after the first "
            "0.1 m; a goal that the navigator aborts is a time-out",
            f"phase: from 0 to {PHASE_S:g} s by the seed, instead of seconds of wall time; the "
            "protocol does not define it",
        ],
    )


def to_json(results: DynamicResults) -> Dict[str, Any]:
    """Convert the results to JSON data."""
    return {
        "config": results.contestant.name,
        "interpolation": results.interpolation,
        "max_speed_mps": results.contestant.simulation.flight.max_speed_mps,
        "seed": results.contestant.seed,
        "flights_wanted": results.wanted,
        "wall_time_s": round(results.wall_time_s, 3),
        "versions": versions(),
        "differences": differences(results),
        "figures": {name: _statistics_json(row) for name, row in results.rows},
        "worlds": {name: _statistics_json(row) for name, row in results.world_rows},
        "runs": [_run_row(run) for run in results.runs],
    }


def to_csv(results: DynamicResults) -> str:
    """Return a row for each run."""
    file = io.StringIO()
    rows = [_run_row(run) for run in results.runs]
    writer = csv.DictWriter(file, list(rows[0]) if rows else ["world"], lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
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
    return [
        name,
        str(row.worlds),
        str(row.runs),
        f"{100 * row.successes / row.runs:.1f}",
        f"{100 * low:.1f}-{100 * high:.1f}",
        f"{100 * row.collisions / row.runs:.1f}",
        f"{100 * row.time_outs / row.runs:.1f}",
        "-" if row.mean_time_s is None else f"{row.mean_time_s:.1f}",
        f"{100 * PUBLISHED[name]:.0f}" if name in PUBLISHED else "",
    ]


def _statistics_json(row: BarnStatistics) -> Dict[str, Any]:
    return {
        "worlds": row.worlds,
        "runs": row.runs,
        "successes": row.successes,
        "collisions": row.collisions,
        "time_outs": row.time_outs,
        "gave_up": row.gave_up,
        "success_rate": round(row.successes / row.runs, 4),
        "success_interval": [round(end, 4) for end in row.success_interval],
        "mean_time_s": None if row.mean_time_s is None else round(row.mean_time_s, 4),
    }


def _run_row(run: DynamicRun) -> Dict[str, Any]:
    x_m, y_m = run.touched_at_m or (None, None)
    return {
        "world": run.world,
        "difficulty": DIFFICULTIES[run.difficulty],
        "run": run.run,
        "seed": run.seed,
        "phase_s": round(run.phase_s, 4),
        "outcome": run.outcome.value,
        "time_s": round(run.time_s, 4),
        "path_length_m": round(run.path_length_m, 4),
        "min_clearance_m": round(run.min_clearance_m, 4),
        "recoveries": run.recoveries,
        "gave_up": run.gave_up,
        "touched": run.touched,
        "touched_x_m": None if x_m is None else round(x_m, 4),
        "touched_y_m": None if y_m is None else round(y_m, 4),
    }
