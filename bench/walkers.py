"""Fly among people, and count contacts: how many, and what the quadcopter did then.

    python bench/walkers.py                                  # arena and hallway, 2 and 8 robots
    python bench/walkers.py 2in12 corridor --seeds 10 --set evasion/max_speed=1.0

``8in12`` are eight quadcopters with a random mission in an arena of 12 m. ``8hallway`` are eight
in a hallway of 4 m by 24 m, half of them at each end, which fly to the other end and back.
``corridor`` is that of ``goals/encounters``, too narrow for two. People walk in all of them. Of the
contacts with people, in the period of odometry (25 ms) before the touch the quadcopter

* *moved* if its speed was above 0.05 m/s, in any direction;
* *was pushed* if it moved and had begun to touch something in the second before: a person who does
  not stop pushes it on, into the next one;
* *moved into* the person if its velocity had a part above 0.05 m/s from its centre towards the
  point of the touch. The others were run into while the quadcopter stood, or fled.

``person`` is the mean part of the person's velocity towards the quadcopter's centre at contacts.
Contacts with anything else are in the column ``others``.
"""

from __future__ import annotations

import math
import re
import sys
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Dict, List, NamedTuple, Optional, Sequence, Tuple

import click
import numpy as np
import tabulate
from encounters import JITTER_M, options_of, parameter

from quad_nav.geometry import Pose2D
from quad_nav.offline.flight import Flight, FlightObserver
from quad_nav.offline.run import fly
from quad_nav.offline.workers import LocalWorkers, fly_all
from quad_nav.scenario.flight_setup import FlightOptions, FlightSetup, read_setup
from quad_nav.scenario.random_mission import RandomMission
from quad_nav.sim.contacts import Contact
from quad_nav.sim.motion import Walkers
from quad_nav.sim.scene import Scene, Walls
from quad_nav.sim.simulation_params import SimulationParams

HALLWAY = re.compile(r"(\d+)hallway")
HALLWAY_M = 24.0, 4.0
MOVED_MPS = 0.05
PUSHED_S = 1.0
PERIOD_S = 0.025
TIME_LIMIT_S = 300.0


@dataclass(frozen=True)
class Task:
    """A flight: its name, seed and configuration, the number of people, and how they walk."""

    name: str
    seed: int
    config: str
    parameters: Tuple[Tuple[str, Any], ...]
    people: int
    reacting: bool


class WalkersResult(NamedTuple):
    """Contacts of one flight, and those with people at which the quadcopter did something.

    ``person_mps`` are the people's speeds towards the quadcopter at the contacts.
    """

    name: str
    seed: int
    moved: int
    pushed: int
    moved_into: int
    others: int
    person_mps: Tuple[float, ...]
    reached: int
    goals: int
    time_s: float


class Touches(FlightObserver):
    """Keeps the velocities of quadcopter and person towards each other at each contact."""

    def __init__(self) -> None:
        self.speeds_mps: List[Tuple[float, float, float]] = []  # of both ways, and any direction
        self.pushed = self.others = 0
        self._touched_s: Dict[int, float] = {}
        self._flight: Optional[Flight] = None
        self._velocities = self._places = np.zeros((0, 2))

    def on_start(self, flight: Flight) -> None:
        """Keep the flight."""
        self._flight = flight
        self.on_move(flight)

    def on_move(self, flight: Flight) -> None:
        """Keep places and velocities of the last period of odometry."""
        self._velocities = flight.states.bodies.velocities_mps[:, :2].copy()
        self._places = flight.states.poses[:, :2].copy()

    def on_contact(self, contact: Contact) -> None:
        """Keep the speeds of a robot and a person who touch."""
        robot = int(contact.robot[len("quad") :])
        since_s = contact.time_s - self._touched_s.get(robot, -math.inf)
        self._touched_s[robot] = contact.time_s
        if not contact.other.startswith("person_"):
            self.others += 1
            return
        assert self._flight is not None
        movers, person = self._flight.simulation.movers, int(contact.other[len("person_") :])
        before, now = movers.poses_at(contact.time_s - np.array([PERIOD_S, 0.0]))[:, person, :2]
        away = np.array([contact.x_m, contact.y_m]) - self._places[robot]
        away /= np.hypot(*away)
        velocity = self._velocities[robot]
        speed_mps = float(np.hypot(*velocity))
        self.pushed += speed_mps > MOVED_MPS and since_s < PUSHED_S
        person_mps = float((before - now) @ away / PERIOD_S)
        self.speeds_mps.append((float(velocity @ away), person_mps, speed_mps))


def hallway(robots: int) -> RandomMission:
    """Return a hallway with half of the robots at each end, which fly to the other end and back."""
    length_m, width_m = HALLWAY_M
    starts, goals = [], []
    for robot in range(robots):
        row, place = divmod(robot // 2, 2)
        x_m, y_m = 1.0 + 1.5 * row, width_m * (0.3 if place else 0.7)
        ends = (x_m, length_m - x_m) if robot % 2 == 0 else (length_m - x_m, x_m)
        starts.append(Pose2D(ends[0], y_m, math.pi * (robot % 2)))
        goals.append(((ends[1], y_m), (ends[0], y_m)))
    scene = Scene("hallway", length_m, width_m, 1.0, Walls(), (), tuple(starts))
    return RandomMission(scene, tuple(goals))


def mission_options(task: Task, folder: Path) -> FlightOptions:
    """Return the options of a flight; files that it needs are written to a folder."""
    named = HALLWAY.fullmatch(task.name)
    if not named:
        return options_of(task.name, task.seed, task.config)
    scene, goals = folder / "hallway.yaml", folder / "goals"
    hallway(int(named[1])).write(scene, goals)
    jitter = SimulationParams(jitter_m=JITTER_M)
    return FlightOptions(scene, goals, task.config, seed=task.seed, simulation=jitter)


def setup_of(task: Task) -> FlightSetup:
    """Return the flight with people in its scene."""
    with tempfile.TemporaryDirectory() as folder:
        options = mission_options(task, Path(folder))
        options = replace(options, parameters=task.parameters, time_limit_s=TIME_LIMIT_S)
        setup = read_setup(options)
    walkers = Walkers(task.people, reacting=task.reacting) if task.people else None
    return replace(setup, scene=replace(setup.scene, walkers=walkers))


def fly_task(task: Task) -> WalkersResult:
    """Fly among people."""
    touches = Touches()
    summary = fly(setup_of(task), (touches,))
    legs = [leg for robot in summary.robots for leg in robot.legs]
    speeds_mps = touches.speeds_mps
    return WalkersResult(
        task.name,
        task.seed,
        sum(speed_mps > MOVED_MPS for _, _, speed_mps in speeds_mps),
        touches.pushed,
        sum(towards_mps > MOVED_MPS for towards_mps, _, _ in speeds_mps),
        touches.others,
        tuple(person_mps for _, person_mps, _ in speeds_mps),
        sum(leg.reached for leg in legs),
        len(legs),
        summary.sim_time_s,
    )


def row(name: str, flights: Sequence[WalkersResult]) -> Dict[str, object]:
    _, _, *counts, persons, reached, goals, times_s = zip(*flights)
    persons_mps = sum(persons, ())
    moved, pushed, moved_into, others = map(sum, counts)
    return {
        "flights of": name,
        "flights": len(flights),
        "contacts\nwith people": len(persons_mps),
        "quadcopter\nmoved": moved,
        "was\npushed": pushed,
        "moved into\nthe person": moved_into,
        "person\nm/s": f"{np.mean(persons_mps):.2f}" if persons_mps else "",
        "others": others,
        "goals": f"{sum(reached)} of {sum(goals)}",
        "mean time\ns": f"{np.mean(times_s):.0f}",
    }


@click.command()
@click.argument("names", nargs=-1)
@click.option("--config", default="moving", show_default=True)
@click.option("--set", "parameters", multiple=True, help="PATH=VALUE on top of it.")
@click.option("--seeds", default=10, show_default=True)
@click.option("--people", default=10, show_default=True)
@click.option("--reacting", is_flag=True, help="People keep away from quadcopters.")
@click.option("--jobs", default=LocalWorkers().count, help="Flights at the same time.")
def main(
    names: Sequence[str],
    config: str,
    parameters: Sequence[str],
    seeds: int,
    people: int,
    reacting: bool,
    jobs: int,
) -> None:
    """Fly among people and print a table of the results."""
    names = names or ("2in12", "8in12", "2hallway", "8hallway")
    given = tuple(map(parameter, parameters))
    tasks = [
        Task(name, seed, config, given, people, reacting) for name in names for seed in range(seeds)
    ]
    flights: List[WalkersResult] = []
    for _, one in fly_all(LocalWorkers(jobs), fly_task, list(enumerate(tasks))):
        flights.append(one)
        print(one, file=sys.stderr, flush=True)
    rows = [row(name, [one for one in flights if one.name == name]) for name in names]
    print(tabulate.tabulate(rows, "keys", disable_numparse=True))


if __name__ == "__main__":
    main()
