"""Results of DynaBARN as text, JSON and CSV."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Dict, List, Sequence, Tuple

from quad_bench.barn.dynamic import PHASE_S, PUBLISHED, DynamicRun
from quad_bench.barn.dynamic_worlds import ALTITUDE_M, DIFFICULTIES
from quad_bench.barn.results import (
    OUTCOME_HEADER,
    outcome_cells,
    run_row,
    statistics_json,
    world_statistics,
)
from quad_bench.barn.setup import Contestant
from quad_bench.barn.statistics import BarnStatistics, barn_statistics
from quad_nav.report.results import csv_text, interruption, rounded, table, versions_text, wrapped
from quad_nav.versions import versions

_COLUMNS = (
    "world",
    "difficulty",
    "run",
    "seed",
    "phase_s",
    "waited_s",
    "outcome",
    "time_s",
    "path_length_m",
    "min_clearance_m",
    "recoveries",
    "gave_up",
    "touched",
    "touched_x_m",
    "touched_y_m",
)


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
        return world_statistics(self.runs)


def text(results: DynamicResults, per_world: bool = False) -> str:
    """Format the results for a terminal of 100 columns."""
    parts = [_table(results.world_rows)] if per_world and results.runs else []
    parts += [_table(results.rows) if results.runs else "No flight was completed."]
    notes = [*interruption(len(results.runs), results.wanted)]
    notes.append(
        f"Configuration {results.contestant.name}, {results.interpolation} interpolation, first "
        f"seed {results.contestant.seed}, {results.wall_time_s:.0f} s."
    )
    notes.append(versions_text())
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
            "exact odometry, no latency; a goal that the navigator aborts is a time-out",
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
    return csv_text([_run_row(run) for run in results.runs], _COLUMNS)


def _table(rows: Sequence[Tuple[str, BarnStatistics]]) -> str:
    return table(
        [[*outcome_cells(name, row), _published(name)] for name, row in rows],
        [*OUTCOME_HEADER, "published\nDWA (%)"],
    )


def _published(name: str) -> str:
    return f"{100 * PUBLISHED[name]:.0f}" if name in PUBLISHED else ""


def _statistics_json(row: BarnStatistics) -> Dict[str, Any]:
    figures = statistics_json(row)
    del figures["metric"]
    return figures


def _run_row(run: DynamicRun) -> Dict[str, Any]:
    values = {
        **run_row(run),
        "difficulty": DIFFICULTIES[run.difficulty],
        "phase_s": rounded(run.phase_s),
        "waited_s": rounded(run.waited_s),
    }
    return {name: values[name] for name in _COLUMNS}
