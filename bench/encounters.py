"""Whether fleets get through without touching: encounters and random missions, many times.

    python bench/encounters.py                            # all of them, 20 seeds each
    python bench/encounters.py corridor 8in12 --seeds 100 --jobs 4

``mission`` is the tutorial's mission, ``8in12`` are eight quadcopters with a random mission in an
arena of 12 m; the other names are those of ``goals/encounters``. Starts are displaced by up to
0.3 m, but for random missions, which differ anyway. Goals that begin again after the last one are
flown for ten minutes. The exit status is 1 when anything touched.
"""

from __future__ import annotations

import re
import sys
from dataclasses import dataclass
from typing import Iterator, List, Sequence, Tuple

import click
import joblib
import tabulate
from rich.progress import track

from quad_nav.files.shipped import shipped
from quad_nav.mission.summary import MissionSummary
from quad_nav.offline.run import fly
from quad_nav.scenario.flight_setup import FlightOptions, FlightSetup, read_setup
from quad_nav.scenario.warm_up import simulate, warm_up
from quad_nav.sim.simulation import SimulationParams

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
    "parked_on_goal",
    "parked_in_corridor",
    "8in12",
    "16in24",
)
LOOPS = {"corridor_to_and_fro": "corridor"}  # goals that share a scene with others
HEADER = [
    "encounter",
    "flights",
    "complete",
    "goals\nreached",
    "of one robot,\nleast : most",
    "flights with\ncontacts",
    "least gap\nm",
    "mean time\ns",
    "longest\ns",
]


@dataclass(frozen=True)
class Flown:
    """One flight's figures: ``reached`` goals of each robot, of so many ``goals`` in all that
    were tried; ``gap_m`` is the least between any two hulls.
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
        told = self.contacts + self.faults or (f"{sum(self.reached)} goals in {self.time_s:.0f} s",)
        return f"{self.encounter} seed {self.seed}: " + "; ".join(told)


def options_of(encounter: str, seed: int, config: str) -> FlightOptions:
    """What is flown by that name."""
    random = RANDOM.fullmatch(encounter)
    if random:
        return FlightOptions(
            None,
            None,
            config,
            robots=int(random[1]),
            size_m=float(random[2]),
            seed=seed,
            time_limit_s=TIME_LIMIT_S,
        )
    scene, goals = "arena.yaml", ""
    if encounter != "mission":
        scene, goals = (
            f"encounters/{LOOPS.get(encounter, encounter)}.yaml",
            f"encounters/{encounter}",
        )
    return FlightOptions(
        shipped("scenes", scene),
        shipped("goals", goals),
        config,
        seed=seed,
        time_limit_s=TIME_LIMIT_S,
        simulation=SimulationParams(jitter_m=JITTER_M),
    )


def flown(encounter: str, seed: int, config: str) -> Flown:
    """One flight; a module's function, so that it can be sent to another process."""
    setup = read_setup(options_of(encounter, seed, config))
    return figures(encounter, setup, fly(setup))


def figures(encounter: str, setup: FlightSetup, summary: MissionSummary) -> Flown:
    legs = [
        (robot.robot, leg)
        for robot in summary.robots
        for leg in robot.legs
        if encounter not in LOOPS or leg.reached or leg.attempts > 1
    ]
    assert summary.min_separation_m is not None
    return Flown(
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


def row(encounter: str, flights: Sequence[Flown]) -> List[str]:
    times = [one.time_s for one in flights]
    reached, goals = sum(sum(one.reached) for one in flights), sum(one.goals for one in flights)
    return [
        encounter,
        str(len(flights)),
        str(sum(not one.faults for one in flights)),
        f"{100 * reached / goals:.1f} %",
        f"{min(min(one.reached) for one in flights)} : {max(max(one.reached) for one in flights)}",
        str(sum(bool(one.contacts) for one in flights)),
        f"{min(one.gap_m for one in flights):.2f}",
        f"{sum(times) / len(times):.1f}",
        f"{max(times):.1f}",
    ]


@click.command()
@click.argument("encounters", nargs=-1)
@click.option("--config", default="default", show_default=True)
@click.option("--seeds", default=20, show_default=True, help="Flights of each.")
@click.option("--first-seed", default=0, show_default=True)
@click.option(
    "--jobs",
    default=joblib.cpu_count,
    help="Flights at the same time. [default: as many as there are cores]",
)
def main(encounters: Sequence[str], config: str, seeds: int, first_seed: int, jobs: int) -> None:
    """Fly encounters with many seeds; a table of what became of them."""
    encounters = encounters or USUAL
    warm_up(read_setup(options_of(encounters[0], first_seed, config)).configurations[0])
    simulate()  # compiled once, and not in every process
    tasks = [(name, seed) for name in encounters for seed in range(first_seed, first_seed + seeds)]
    flights: List[Flown] = []
    for one in track(
        _fly_all(tasks, config, jobs), "flights", total=len(tasks), disable=not sys.stderr.isatty()
    ):
        flights.append(one)
        if one.contacts or one.faults or not sys.stderr.isatty():
            print(one, file=sys.stderr, flush=True)
    rows = [row(name, [one for one in flights if one.encounter == name]) for name in encounters]
    print(f"Encounters offline, config {config}, seeds {first_seed} to {first_seed + seeds - 1}")
    print(
        tabulate.tabulate(
            rows, HEADER, disable_numparse=True, colalign=("left",) + ("right",) * (len(HEADER) - 1)
        )
    )
    sys.exit(any(one.contacts for one in flights))


def _fly_all(tasks: Sequence[Tuple[str, int]], config: str, jobs: int) -> Iterator[Flown]:
    if jobs == 1:
        return (flown(name, seed, config) for name, seed in tasks)
    parallel = joblib.Parallel(jobs, return_as="generator_unordered")
    results: Iterator[Flown] = parallel(
        joblib.delayed(flown)(name, seed, config) for name, seed in tasks
    )
    return results


if __name__ == "__main__":
    main()
