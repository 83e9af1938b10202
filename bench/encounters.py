"""Fly encounters and random missions with many seeds, and count contacts.

    python bench/encounters.py                            # all of them, 20 seeds each
    python bench/encounters.py corridor 8in12 --seeds 100 --jobs 4
    python bench/encounters.py --config moving --set peers/avoid_peers=false

``mission`` is the tutorial's mission, ``8in12`` are eight quadcopters with a random mission in an
arena of 12 m; the other names are those of ``goals/encounters``. Starts are displaced by up to
0.3 m, except in random missions, which differ anyway. Missions that loop are flown for ten minutes.
The exit status is 1 if there was a contact.
"""

from __future__ import annotations

import re
import sys
from dataclasses import dataclass, replace
from typing import Any, Dict, List, Sequence, Tuple

import click
import tabulate
from rich.progress import track

from quad_nav.files.shipped import shipped
from quad_nav.mission.summary import MissionSummary
from quad_nav.offline.run import fly
from quad_nav.offline.workers import LocalWorkers, fly_all
from quad_nav.scenario.flight_setup import FlightOptions, FlightSetup, read_setup
from quad_nav.scenario.warm_up import simulate, warm_up
from quad_nav.sim.simulation_params import SimulationParams

JITTER_M = 0.3
TIME_LIMIT_S = 600.0
RANDOM = re.compile(r"(\d+)in(\d+)")
USUAL = (
    "mission",
    "swap",
    "crossing",
    "four_ways",
    "corridor",
    "parked_on_way",
    "parked_at_wall",
    "parked_on_goal",
    "parked_in_corridor",
    "8in12",
    "16in24",
)
LOOPS = {"corridor_to_and_fro": "corridor"}  # goals that share a scene with others


@dataclass(frozen=True)
class Task:
    """A flight: its name, seed and configuration, and what is set on top of it."""

    encounter: str
    seed: int
    config: str
    parameters: Tuple[Tuple[str, Any], ...] = ()


@dataclass(frozen=True)
class EncounterResult:
    """Result of one flight.

    Attributes:
        reached: Goals that each robot has reached.
        goals: Goals that all robots together tried to reach.
        gap_m: Smallest separation of any two hulls.
        faults: A message for each goal that was not reached.
    """

    encounter: str
    seed: int
    reached: Tuple[int, ...]
    goals: int
    contacts: Tuple[str, ...]
    gap_m: float
    time_s: float
    faults: Tuple[str, ...]

    def __str__(self) -> str:
        lines = self.contacts + self.faults or (
            f"{sum(self.reached)} goals in {self.time_s:.0f} s",
        )
        return f"{self.encounter} seed {self.seed}: " + "; ".join(lines)


def options_of(encounter: str, seed: int, config: str) -> FlightOptions:
    """Options of the flight with this name."""
    both: Dict[str, Any] = {"seed": seed, "time_limit_s": TIME_LIMIT_S}
    random = RANDOM.fullmatch(encounter)
    if random:
        robots, size_m = int(random[1]), float(random[2])
        return FlightOptions(None, None, config, robots=robots, size_m=size_m, **both)
    both["simulation"] = SimulationParams(jitter_m=JITTER_M)
    if encounter == "mission":
        return FlightOptions(shipped("scenes", "arena.yaml"), shipped("goals"), config, **both)
    scene = shipped("scenes", f"encounters/{LOOPS.get(encounter, encounter)}.yaml")
    return FlightOptions(scene, shipped("goals", f"encounters/{encounter}"), config, **both)


def setup_of(task: Task) -> FlightSetup:
    """Return the set-up of a flight."""
    options = options_of(task.encounter, task.seed, task.config)
    return read_setup(replace(options, parameters=task.parameters))


def fly_encounter(task: Task) -> EncounterResult:
    """Fly one encounter."""
    setup = setup_of(task)
    return figures(task.encounter, setup, fly(setup))


def figures(encounter: str, setup: FlightSetup, summary: MissionSummary) -> EncounterResult:
    legs = [
        (robot.robot, leg)
        for robot in summary.robots
        for leg in robot.legs
        if encounter not in LOOPS or leg.reached or leg.attempts > 1
    ]
    assert summary.min_separation_m is not None
    return EncounterResult(
        encounter,
        setup.seed,
        tuple(robot.reached for robot in summary.robots),
        len(legs),
        tuple(
            f"{touch.robot} touches {touch.other} at {touch.time_s:.1f} s"
            for touch in summary.contacts
        ),
        summary.min_separation_m,
        summary.sim_time_s,
        tuple(
            f"{name} goal {leg.index + 1}: {leg.reason}" for name, leg in legs if not leg.reached
        ),
    )


def row(encounter: str, flights: Sequence[EncounterResult]) -> Dict[str, str]:
    times_s, goals = [one.time_s for one in flights], sum(one.goals for one in flights)
    reached = [one.reached for one in flights]
    return {
        "encounter": encounter,
        "flights": str(len(flights)),
        "complete": str(sum(not one.faults for one in flights)),
        "goals\nreached": f"{100 * sum(map(sum, reached)) / goals:.1f} %",
        "per robot,\nmin : max": f"{min(map(min, reached))} : {max(map(max, reached))}",
        "flights with\ncontacts": str(sum(bool(one.contacts) for one in flights)),
        "min separation\nm": f"{min(one.gap_m for one in flights):.2f}",
        "mean time\ns": f"{sum(times_s) / len(times_s):.1f}",
        "max time\ns": f"{max(times_s):.1f}",
    }


def parameter(text: str) -> Tuple[str, Any]:
    """Return path and value of PATH=VALUE."""
    path, _, value = text.partition("=")
    known = {"true": True, "false": False}
    return path, known[value] if value in known else float(value)


@click.command()
@click.argument("encounters", nargs=-1)
@click.option("--config", default="default", show_default=True)
@click.option("--seeds", default=20, show_default=True, help="Flights of each encounter.")
@click.option("--first-seed", default=0, show_default=True)
@click.option("--jobs", default=LocalWorkers().count, help="Flights at the same time.")
@click.option("--set", "parameters", multiple=True, help="PATH=VALUE on top of it.")
def main(
    encounters: Sequence[str],
    config: str,
    seeds: int,
    first_seed: int,
    jobs: int,
    parameters: Sequence[str],
) -> None:
    """Fly encounters with many seeds and print a table of the results."""
    encounters = encounters or USUAL
    given = tuple(map(parameter, parameters))
    seeds_flown = range(first_seed, first_seed + seeds)
    tasks = list(
        enumerate(Task(name, seed, config, given) for name in encounters for seed in seeds_flown)
    )
    warm_up(setup_of(tasks[0][1]).configurations[0])
    simulate()  # compile the kernels once, not in every process
    flights: List[EncounterResult] = []
    results = fly_all(LocalWorkers(jobs), fly_encounter, tasks)
    for _, one in track(results, "flights", total=len(tasks), disable=not sys.stderr.isatty()):
        flights.append(one)
        if one.contacts or one.faults or not sys.stderr.isatty():
            print(one, file=sys.stderr, flush=True)
    rows = [row(name, [one for one in flights if one.encounter == name]) for name in encounters]
    print(f"Encounters offline, config {config}, seeds {first_seed} to {first_seed + seeds - 1}")
    if parameters:
        print(*parameters, sep=", ")
    align = ("left", *["right"] * (len(rows[0]) - 1))
    print(tabulate.tabulate(rows, "keys", disable_numparse=True, colalign=align))
    sys.exit(any(one.contacts for one in flights))


if __name__ == "__main__":
    main()
