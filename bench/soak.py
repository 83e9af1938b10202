"""Fly offline for simulated hours and watch memory and control cycles.

    PYTHONPATH=src .venv/bin/python bench/soak.py --robots 10 --hours 8

A random mission that loops. Each row covers a stretch of the flight. Memory is compared with that
at the end of the first stretch. Cycle times depend on the machine's other load, CPU seconds depend
on it less.
"""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path
from typing import List

import click
import numpy as np

from quad_nav.mission.actions import Action, GoalEnded
from quad_nav.mission.robot_goals import RobotGoals
from quad_nav.navigator.tick import RobotPoses, Tick
from quad_nav.offline.flight import Flight, FlightObserver
from quad_nav.offline.run import fly
from quad_nav.scenario.flight_setup import FlightOptions, read_setup
from quad_nav.sim.contacts import Contact

FLAT = 0.05  # relative growth that passes
HEADER = "hours   memory MB   CPU s   cycles   median ms   99 % ms   reached   skipped   contacts"


class Stretches(FlightObserver):
    """Prints a row for every ``length_s`` of simulated time."""

    def __init__(self, length_s: float) -> None:
        self._length_s = length_s
        self.memories_mb: List[float] = []
        self._begin()

    def on_contact(self, contact: Contact) -> None:
        """Count a contact."""
        self._contacts += 1

    def on_action(self, robot: int, now_s: float, action: Action) -> None:
        """Count a goal that ends."""
        if isinstance(action, GoalEnded):
            self._reached += action.reached
            self._skipped += not action.reached

    def on_tick(self, robot: int, tick: Tick, located: RobotPoses, wall_s: float) -> None:
        """Store a control cycle's wall time."""
        if tick.cycle:
            self._cycles_ms.append(1000 * wall_s)

    def on_move(self, flight: Flight) -> None:
        """Print a row at the end of a stretch."""
        if flight.now_s < self._length_s * (len(self.memories_mb) + 1):
            return
        self.memories_mb.append(memory_mb())
        median_ms, slow_ms = np.percentile(self._cycles_ms, (50, 99))
        cpu_s = time.process_time() - self._begin_cpu_s
        click.echo(
            f"{flight.now_s / 3600:5.2f} {self.memories_mb[-1]:11.1f} {cpu_s:7.1f} "
            f"{len(self._cycles_ms):8d} {median_ms:11.2f} {slow_ms:9.2f} "
            f"{self._reached:9d} {self._skipped:9d} {self._contacts:10d}"
        )
        self._begin()

    def _begin(self) -> None:
        self._cycles_ms: List[float] = []
        self._begin_cpu_s = time.process_time()
        self._reached = self._skipped = self._contacts = 0


def memory_mb() -> float:
    """Resident memory of this process."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * 4096 / 1e6


def looped(goals: RobotGoals) -> RobotGoals:
    sequence = replace(goals.sequence, settings=replace(goals.sequence.settings, loop=True))
    return replace(goals, sequence=sequence)


@click.command()
@click.option("--robots", default=10, show_default=True)
@click.option("--hours", default=8.0, show_default=True, help="Simulated time.")
@click.option("--minutes", default=30.0, show_default=True, help="Simulated time per row.")
@click.option("--seed", default=0, show_default=True)
@click.option("--config", default="default", show_default=True)
def main(robots: int, hours: float, minutes: float, seed: int, config: str) -> None:
    """Fly for long; exit status 1 if memory grows or there is a contact."""
    setup = read_setup(
        FlightOptions(None, None, config, robots=robots, seed=seed, time_limit_s=3600 * hours)
    )
    stretches = Stretches(60 * minutes)
    click.echo(HEADER)
    summary = fly(replace(setup, robots=tuple(map(looped, setup.robots))), (stretches,))
    first_mb, last_mb = stretches.memories_mb[0], stretches.memories_mb[-1]
    growth = last_mb / first_mb - 1.0
    click.echo(
        f"memory {100 * growth:+.1f} %, {len(summary.contacts)} contacts, "
        f"{summary.real_time_factor:.1f} times as fast as real time"
    )
    raise SystemExit(growth > FLAT or len(summary.contacts) > 0)


if __name__ == "__main__":
    main()
