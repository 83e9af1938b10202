"""Measure the real-time factor of offline flights, the cost of a robot, and each part's share.

    PYTHONPATH=src python bench/flight.py --config default --repeat 5

Each mission is flown several times, all of them in turn; the table shows medians. The cost of a
robot is the CPU time of all processes in milliseconds per robot and simulated second. It is the
figure to compare on a machine with other users: the real-time factor counts wall time.
"""

from __future__ import annotations

import cProfile
import os
import pstats
import resource
import sys
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Dict, List, Optional, Tuple

import click
import tabulate
from figures import JSON_HELP, LARGER, Figures

from quad_nav.files.shipped import shipped
from quad_nav.loop.worker_process import processes_for
from quad_nav.offline.run import fly
from quad_nav.scenario.flight_setup import FlightOptions, FlightSetup, read_setup

# Robots, simulated seconds, required factor, factor of a swarm simulator without navigation.
MISSIONS: Tuple[Tuple[int, float, float, float], ...] = (
    (1, 80.0, 60.0, 100.0),
    (2, 80.0, 40.0, 60.0),
    (10, 40.0, 10.0, 30.0),
    (100, 10.0, 1.0, 4.0),
)
HALL_M = 60.0
# The functions of each part, as file:function.
PARTS: Dict[str, Tuple[str, ...]] = {
    "bodies": ("simulation.py:advance",),
    "LIDAR": ("casters.py:scan",),
    "scans to points": ("scan_intake.py:add_scan",),
    "costmaps": ("layered.py:update",),
    "global plans": ("state_machine.py:_search_plan",),
    "control": ("state_machine.py:_run_control_cycle",),
    "goals": ("flight.py:_sequence",),
}


def setup_of(robots: int, config: str) -> FlightSetup:
    """Set up the tutorial's mission for 1 or 2 robots, the hall for 100, else a random mission."""
    if robots <= 2:
        return read_setup(FlightOptions(None, shipped("goals"), config, robots=robots))
    if robots < 100:
        return read_setup(FlightOptions(None, None, config, robots=robots))
    size = (("global_costmap/width", HALL_M), ("global_costmap/height", HALL_M))
    return read_setup(
        FlightOptions(
            shipped("scenes", "hall.yaml"), shipped("goals", "hall"), config, size, robots
        )
    )


def cpu_time_s() -> float:
    """CPU time of this process and of its ended children."""
    return sum(os.times()[:4])


def shares(setup: FlightSetup) -> Dict[str, float]:
    """Profile a flight and return each part's share of the time."""
    profile = cProfile.Profile()
    profile.runcall(fly, setup)
    stats = pstats.Stats(profile)
    total_s = stats.total_tt  # type: ignore[attr-defined]
    times_s = {
        f"{file.rsplit('/', 1)[-1]}:{name}": entry[3]
        for (file, _, name), entry in stats.stats.items()  # type: ignore[attr-defined]
    }
    return {
        part: sum(times_s.get(place, 0.0) for place in places) / total_s
        for part, places in PARTS.items()
    }


@dataclass
class Measured:
    """The flights of one mission.

    Attributes:
        setup: The mission, with its time limit.
        wanted: Factor that is required.
        beyond: Factor of a swarm simulator without navigation.
        factors: Real-time factor of each flight.
        per_cpu: Simulated seconds per CPU second of each flight.
    """

    setup: FlightSetup
    wanted: float
    beyond: float
    factors: List[float] = field(default_factory=list)
    per_cpu: List[float] = field(default_factory=list)

    def fly(self, processes: int) -> None:
        """Fly the mission and keep its figures."""
        begin_cpu_s = cpu_time_s()
        summary = fly(self.setup, processes=processes)
        self.per_cpu.append(summary.sim_time_s / (cpu_time_s() - begin_cpu_s))
        assert summary.real_time_factor is not None
        self.factors.append(summary.real_time_factor)


def missions(config: str, robots: Tuple[int, ...]) -> Dict[int, Measured]:
    """Return the missions by their number of robots, each flown for a second before."""
    found = {}
    for count, sim_s, wanted, beyond in MISSIONS:
        if not robots or count in robots:
            setup = replace(setup_of(count, config), time_limit_s=sim_s)
            fly(replace(setup, time_limit_s=1.0))  # compiled kernels are loaded, caches warm
            found[count] = Measured(setup, wanted, beyond)
    return found


def row(count: int, one: Measured, config: str, figures: Figures) -> Dict[str, str]:
    """Add a mission's figures; return its row."""
    case = f"{count} robots, {config}"
    factor = figures.add(f"real-time factor, {case}", "", one.factors, LARGER)
    spread = figures.figures[-1].spread
    cost_ms = figures.add(
        f"CPU per robot and second, {case}", "ms", [1e3 / count / each for each in one.per_cpu]
    )
    parts = shares(replace(one.setup, time_limit_s=min(one.setup.time_limit_s, 20.0)))
    return {
        "robots": str(count),
        "processes": str(processes_for(count)),
        "real-time\nfactor": f"{factor:.1f}",
        "spread": f"{spread:.1f}",
        "required": f"{one.wanted:g}",
        "swarm\nsimulator": f"{one.beyond:g}",
        "CPU per\nrobot, ms/s": f"{cost_ms:.2f}",
        **{
            f"{part}\n%".replace(" ", "\n", 1): f"{100 * share:.0f}"
            for part, share in parts.items()
        },
    }


@click.command()
@click.option("--config", default="tutorial", show_default=True)
@click.option("--robots", type=int, multiple=True, help="Only the mission of so many robots.")
@click.option("--repeat", type=click.IntRange(min=1), default=3, show_default=True)
@click.option("--json", "file", type=click.Path(path_type=Path), help=JSON_HELP)
def main(config: str, robots: Tuple[int, ...], repeat: int, file: Optional[Path]) -> None:
    """Print real-time factors with 512 beams at 20 Hz, full navigation and no recording."""
    figures, measured = Figures(f"flight {config}"), missions(config, robots)
    for _ in range(repeat):
        for count, one in measured.items():
            one.fly(processes_for(count))
            print(f"{count} flown", file=sys.stderr)
    memory_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    figures.add(f"memory of one process, {config}", "MB", [memory_mb])
    rows = [row(count, one, config, figures) for count, one in measured.items()]
    print(
        f"Flights offline, config {config}, medians of {repeat}; the percentages under a profiler,"
        f"\nin one process. Memory at most {memory_mb:.0f} MB"
    )
    print(tabulate.tabulate(rows, "keys", disable_numparse=True, stralign="right"))
    figures.write(file)


if __name__ == "__main__":
    main()
