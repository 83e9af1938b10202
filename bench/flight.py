"""How many times faster than real time flights offline are, and where their time goes."""

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

# Quadcopters, simulated seconds, factor to reach, what a swarm simulator without navigation does.
MISSIONS: Tuple[Tuple[int, float, float, float], ...] = (
    (1, 80.0, 60.0, 100.0),
    (2, 80.0, 40.0, 60.0),
    (10, 40.0, 10.0, 30.0),
    (100, 10.0, 1.0, 4.0),
)
HALL_M = 60.0
# Functions that do a part of the work, by the last two parts of their place.
PARTS: Dict[str, Tuple[str, ...]] = {
    "bodies": ("simulation.py:step",),
    "LIDAR": ("lidars.py:scan",),
    "scans to points": ("offline_robot.py:see",),
    "costmaps": ("layered.py:update",),
    "global plans": ("navigator.py:_plan",),
    "control": ("navigator.py:_control_cycle",),
    "goals": ("flight.py:tick_sequencer",),
}


def setup_of(robots: int, config: str) -> FlightSetup:
    """The tutorial's mission for one or two; a random one; the hall for a hundred."""
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
    """Of this process and of those that it has ended."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def shares(setup: FlightSetup) -> Dict[str, float]:
    """The part of the time that each part takes."""
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
@click.option("--robots", type=int, multiple=True, help="Only with so many; repeatable.")
def main(config: str, robots: Tuple[int, ...]) -> None:
    """Real-time factors with 512 beams at 20 Hz and full navigation, nothing recorded."""
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
        "at\nleast",
        "goal\nbeyond",
        "per CPU\nsecond",
        "memory\nMB",
        *(f"{part}\n%".replace(" ", "\n", 1) for part in PARTS),
    ]
    print(f"Flights offline, config {config}; the percentages under a profiler,\nin one process")
    print(tabulate.tabulate(rows, header, disable_numparse=True, stralign="right"))


if __name__ == "__main__":
    main()
