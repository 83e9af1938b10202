"""Fly among people, and count contacts and those at which the quadcopter moved.

    python bench/walkers.py                                  # arena and corridor, 2 and 8 robots
    python bench/walkers.py 2in12 corridor --seeds 10 --set fixes/avoid_moving_obstacles=false

``8in12`` are eight quadcopters with a random mission in an arena of 12 m, ``corridor`` is that of
``goals/encounters``; people walk in both. A quadcopter moved if it was faster than 0.05 m/s in the
period of odometry before the touch.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, List, Sequence, Tuple

import click
import numpy as np
import tabulate
from encounters import options_of, parameter

from quad_nav.offline.flight import Flight, FlightObserver
from quad_nav.offline.run import fly
from quad_nav.offline.workers import LocalWorkers, fly_all
from quad_nav.scenario.flight_setup import FlightSetup, read_setup
from quad_nav.sim.contacts import Contact
from quad_nav.sim.motion import Walkers

MOVED_MPS = 0.05


@dataclass(frozen=True)
class Task:
    """A flight: its name, seed and configuration, the number of people, and how they walk."""

    name: str
    seed: int
    config: str
    parameters: Tuple[Tuple[str, Any], ...]
    people: int
    reacting: bool
    time_limit_s: float


@dataclass(frozen=True)
class WalkersResult:
    """Contacts of one flight; ``moved`` are those at which the quadcopter moved."""

    name: str
    seed: int
    contacts: int
    moved: int
    reached: int
    goals: int
    time_s: float


class Speeds(FlightObserver):
    """Counts the contacts at which the quadcopter moved."""

    def __init__(self) -> None:
        self.moved = 0
        self._speeds = np.zeros(0)

    def on_move(self, flight: Flight) -> None:
        """Keep the speeds of the last period of odometry."""
        velocities = flight.states.bodies.velocities_mps
        self._speeds = np.hypot(velocities[:, 0], velocities[:, 1])

    def on_contact(self, contact: Contact) -> None:
        """Count a contact of a robot that moves."""
        robot = int(contact.robot[len("quad") :])
        self.moved += bool(len(self._speeds) and self._speeds[robot] > MOVED_MPS)


def setup_of(task: Task) -> FlightSetup:
    """Return the flight with people in its scene."""
    options = options_of(task.name, task.seed, task.config)
    setup = read_setup(replace(options, parameters=task.parameters, time_limit_s=task.time_limit_s))
    walkers = Walkers(task.people, reacting=task.reacting) if task.people else None
    return replace(setup, scene=replace(setup.scene, walkers=walkers))


def fly_task(task: Task) -> WalkersResult:
    """Fly among people."""
    speeds = Speeds()
    summary = fly(setup_of(task), (speeds,))
    legs = [leg for robot in summary.robots for leg in robot.legs]
    return WalkersResult(
        task.name,
        task.seed,
        len(summary.contacts),
        speeds.moved,
        sum(leg.reached for leg in legs),
        len(legs),
        summary.sim_time_s,
    )


def row(name: str, flights: Sequence[WalkersResult]) -> List[str]:
    return [
        name,
        str(len(flights)),
        str(sum(one.contacts for one in flights)),
        str(sum(one.moved for one in flights)),
        f"{sum(one.reached for one in flights)} of {sum(one.goals for one in flights)}",
        f"{np.mean([one.time_s for one in flights]):.0f}",
    ]


@click.command()
@click.argument("names", nargs=-1)
@click.option("--config", default="moving", show_default=True)
@click.option("--set", "parameters", multiple=True, help="PATH=VALUE on top of it.")
@click.option("--seeds", default=10, show_default=True)
@click.option("--people", default=10, show_default=True)
@click.option("--reacting", is_flag=True, help="People keep away from quadcopters.")
@click.option("--time-limit", default=300.0, show_default=True, help="Seconds of each flight.")
@click.option("--jobs", default=lambda: LocalWorkers().count)
def main(
    names: Sequence[str],
    config: str,
    parameters: Sequence[str],
    seeds: int,
    people: int,
    reacting: bool,
    time_limit: float,
    jobs: int,
) -> None:
    """Fly among people and print a table of the results."""
    names, given = names or ("2in12", "8in12", "corridor"), tuple(map(parameter, parameters))
    tasks = [
        (k, Task(name, seed, config, given, people, reacting, time_limit))
        for k, (name, seed) in enumerate((name, seed) for name in names for seed in range(seeds))
    ]
    flights = [one for _, one in fly_all(LocalWorkers(jobs), fly_task, tasks)]
    rows = [row(name, [one for one in flights if one.name == name]) for name in names]
    header = ["flights of", "flights", "contacts", "moved", "goals", "mean time (s)"]
    print(tabulate.tabulate(rows, header, disable_numparse=True))


if __name__ == "__main__":
    main()
