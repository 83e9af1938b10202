"""Measure the real-time factor of offline flights, and the share of each part."""

from __future__ import annotations

import cProfile
import os
import pstats
import resource
import sys
from dataclasses import replace
from typing import Dict, Tuple

import click
import tabulate

from quad_nav.files.shipped import shipped
from quad_nav.offline.run import fly
from quad_nav.offline.worker_process import processes_for
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
    "goals": ("flight.py:tick_sequencer",),
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
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def shares(setup: FlightSetup) -> Dict[str, float]:
    """Profile a flight and return each part's share of the time."""
    profile = cProfile.Profile()
    profile.runcall(fly, setup)
    stats = pstats.Stats(profile)
    total_s = stats.total_tt  # type: ignore[attr-defined]
    times_s = {
        f"{file.rsplit('/', 1)[-1]}:{name}": entry[3]
        for (file, _, name), entry in stats.stats.items()
    }  # type: ignore[attr-defined]
    return {
        part: sum(times_s.get(place, 0.0) for place in places) / total_s
        for part, places in PARTS.items()
    }


@click.command()
@click.option("--config", default="tutorial", show_default=True)
@click.option(
    "--robots",
    type=int,
    multiple=True,
    help="Fly only the mission with so many robots; repeatable.",
)
def main(config: str, robots: Tuple[int, ...]) -> None:
    """Print real-time factors with 512 beams at 20 Hz, full navigation and no recording."""
    rows = []
    for count, sim_s, wanted, beyond in MISSIONS:
        if robots and count not in robots:
            continue
        setup = replace(setup_of(count, config), time_limit_s=sim_s)
        fly(replace(setup, time_limit_s=1.0))  # compiled kernels are loaded, caches warm
        processes = processes_for(count)
        start_cpu_s = cpu_time_s()
        summary = fly(setup, processes=processes)
        cpu_s = cpu_time_s() - start_cpu_s
        parts = shares(replace(setup, time_limit_s=min(sim_s, 20.0)))
        memory_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        rows.append(
            [
                count,
                processes,
                f"{summary.real_time_factor:.1f}",
                f"{wanted:g}",
                f"{beyond:g}",
                f"{summary.sim_time_s / cpu_s:.1f}",
                f"{memory_mb:.0f}",
                *(f"{100 * part:.0f}" for part in parts.values()),
            ]
        )
        print(f"{count} flown", file=sys.stderr)
    header = [
        "robots",
        "processes",
        "real-time\nfactor",
        "required",
        "swarm\nsimulator",
        "per CPU\nsecond",
        "memory\nMB",
        *(f"{part}\n%".replace(" ", "\n", 1) for part in PARTS),
    ]
    print(f"Flights offline, config {config}; the percentages under a profiler,\nin one process")
    print(tabulate.tabulate(rows, header, disable_numparse=True, stralign="right"))


if __name__ == "__main__":
    main()
