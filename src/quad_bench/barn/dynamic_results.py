"""Results of DynaBARN as text, JSON and CSV."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Dict, List, Sequence, Tuple

from quad_bench.barn.dynamic import PHASE_S, PUBLISHED, DynamicRun
from quad_bench.barn.dynamic_worlds import ALTITUDE_M, DIFFICULTIES
from quad_bench.barn.results import Results
from quad_bench.barn.statistics import BarnStatistics, barn_statistics
from quad_nav.report.results import wrapped


@dataclass(frozen=True)
class DynamicResults(Results):
    """Runs, in the order of worlds and runs, with their conditions."""

    runs: Sequence[DynamicRun]
    interpolation: str = ""

    @property
    def rows(self) -> List[Tuple[str, BarnStatistics]]:
        """Statistics of each difficulty and of all worlds, by name; empty without a run."""
        rows = []
        for number, name in enumerate(DIFFICULTIES):
            runs = [run for run in self.runs if run.difficulty == number]
            rows += [(name, barn_statistics(runs))] if runs else []
        return rows if len(rows) < 2 else [*rows, ("all", barn_statistics(self.runs))]

    def conditions(self) -> str:
        """Describe the conditions in a line."""
        return f"{self.interpolation.capitalize()} interpolation. {super().conditions()}"

    def differences(self) -> str:
        """Describe how the simulation differs from the published one, a Jackal in Gazebo."""
        simulation = self.contestant.simulation
        return wrapped(
            "Differences from the published figures, which are of a Jackal in Gazebo and 60 "
            "worlds:",
            [
                f"body: a quadcopter, radius {simulation.airframe.radius_m:.2f} m, limited to "
                f"{simulation.flight.max_speed_mps:.2f} m/s; flight altitude {ALTITUDE_M:g} m "
                "among obstacles and walls that stand on the floor",
                "exact odometry, no latency; a goal that the navigator aborts is a time-out",
                f"phase: from 0 to {PHASE_S:g} s by the seed, instead of seconds of wall time; the "
                "protocol does not define it",
            ],
        )

    def to_json(self) -> Dict[str, Any]:
        """Convert the results to JSON data."""
        speed_mps = self.contestant.simulation.flight.max_speed_mps
        return {
            **super().to_json(),
            "interpolation": self.interpolation,
            "max_speed_mps": speed_mps,
        }

    _LAST_COLUMN = "published\nDWA (%)"
    _RUN_COLUMNS = (
        "world run seed outcome time_s path_length_m min_clearance_m recoveries"
        " gave_up touched difficulty phase_s waited_s touched_x_m touched_y_m"
    )

    def _last_cell(self, name: str, row: BarnStatistics) -> str:
        return f"{100 * PUBLISHED[name]:.0f}" if name in PUBLISHED else ""

    def _statistics(self, row: BarnStatistics) -> Dict[str, Any]:
        figures = super()._statistics(row)
        del figures["metric"]
        return figures

    def _run_row(self, run: DynamicRun) -> Dict[str, Any]:
        row = {**super()._run_row(run), "difficulty": DIFFICULTIES[run.difficulty]}
        del row["metric"]
        return row
