"""Fly the tutorial's mission with random yaws, and measure what turning to them costs.

    python bench/yaw_goals.py                                # 100 seeds, config default
    python bench/yaw_goals.py --config tutorial --seeds 20 --jobs 1

Each seed displaces the starts by up to 0.3 m and draws a yaw for every goal. It is flown twice:
with the yaws, and with ``"yaw": null``, which advances on proximity. Errors are of the simulated
bodies at the moment when a goal counts as reached. The exit status is 1 if a goal was not reached
or an error was larger than its tolerance.
"""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass, replace
from typing import Dict, List, Optional, Sequence, Tuple

import click
import numpy as np
import tabulate
from rich.progress import track

from quad_nav.files.shipped import shipped
from quad_nav.geometry import angle_difference
from quad_nav.mission.actions import Action, GoalEnded
from quad_nav.mission.robot_goals import RobotGoals
from quad_nav.offline.flight import Flight, FlightObserver
from quad_nav.offline.run import fly
from quad_nav.offline.workers import LocalWorkers, fly_all
from quad_nav.scenario.flight_setup import FlightOptions, FlightSetup, read_setup
from quad_nav.scenario.warm_up import simulate, warm_up
from quad_nav.sim.simulation_params import SimulationParams

JITTER_M = 0.3
TIME_LIMIT_S = 1200.0
HEADER = [
    "goals",
    "flights",
    "reached",
    "sent\nagain",
    "max distance\nm",
    "max yaw error\nrad",
    "in\ntolerance",
    "mean time\ns",
    "per goal\ns",
    "contacts",
]

Task = Tuple[str, int, bool]
"""Configuration, seed, and whether the goals have yaws."""


@dataclass(frozen=True)
class Reached:
    """Errors of a robot at the moment when a goal counts as reached; yaw None without one."""

    distance_m: float
    yaw_rad: Optional[float]
    is_within: bool


@dataclass(frozen=True)
class YawResult:
    """Result of one flight; ``leg_s`` is the time to the goal for each robot and goal."""

    seed: int
    has_yaws: bool
    time_s: float
    leg_s: Tuple[float, ...]
    reached: Tuple[Reached, ...]
    resent: int
    contacts: int
    faults: Tuple[str, ...]

    def __str__(self) -> str:
        yaws = [one.yaw_rad for one in self.reached if one.yaw_rad is not None]
        distance_m = max((one.distance_m for one in self.reached), default=math.nan)
        parts = [
            f"{sum(one.is_within for one in self.reached)} of {len(self.leg_s)} in tolerance",
            f"{self.time_s:.1f} s",
            f"{sum(self.leg_s) / len(self.leg_s):.2f} s per goal",
            f"at most {distance_m:.3f} m",
            *([f"{max(yaws):.4f} rad"] if yaws else []),
            f"{self.resent} sent again",
            f"{self.contacts} contacts",
            *self.faults,
        ]
        return f"seed {self.seed}{' with yaws' * self.has_yaws}: {', '.join(parts)}"


class Errors(FlightObserver):
    """Measures the bodies whenever a goal counts as reached."""

    def __init__(self) -> None:
        self.reached: List[Reached] = []
        self._flight: Optional[Flight] = None

    def on_start(self, flight: Flight) -> None:
        """Remember the flight."""
        self._flight = flight

    def on_action(self, robot: int, now_s: float, action: Action) -> None:
        """Measure a robot that has reached a goal."""
        if not isinstance(action, GoalEnded) or not action.reached:
            return
        assert self._flight is not None
        body, goal = self._flight.simulation.body_state, action.goal
        x, y, _ = body.positions_m[robot]
        qx, qy, qz, qw = body.quaternions[robot]
        yaw_rad = math.atan2(2 * (qw * qz + qx * qy), 1 - 2 * (qy * qy + qz * qz))
        distance_m = math.hypot(x - goal.x_m, y - goal.y_m)
        sequence = self._flight.robots[robot].sequencer.sequence
        is_within = distance_m <= sequence.tolerance_m(goal) + 1e-9
        error_rad = None
        if goal.yaw_rad is not None:
            error_rad = abs(angle_difference(yaw_rad, goal.yaw_rad))
            is_within = is_within and error_rad <= sequence.yaw_tolerance_rad(goal) + 1e-9
        self.reached.append(Reached(distance_m, error_rad, is_within))


def setup_of(config: str, seed: int, has_yaws: bool) -> FlightSetup:
    """Return the mission's set-up, with yaws that depend on the seed alone."""
    setup = read_setup(
        FlightOptions(
            shipped("scenes", "arena.yaml"),
            shipped("goals"),
            config,
            seed=seed,
            time_limit_s=TIME_LIMIT_S,
            simulation=SimulationParams(jitter_m=JITTER_M),
        )
    )
    random = np.random.default_rng([seed, 7])
    robots = tuple(_turned(robot, random) for robot in setup.robots)
    return replace(setup, robots=robots) if has_yaws else setup


def _turned(robot: RobotGoals, random: np.random.Generator) -> RobotGoals:
    goals = tuple(
        replace(goal, yaw_rad=float(random.uniform(-math.pi, math.pi)))
        for goal in robot.sequence.goals
    )
    return replace(robot, sequence=replace(robot.sequence, goals=goals))


def fly_mission(task: Task) -> YawResult:
    """Fly one mission."""
    config, seed, has_yaws = task
    errors = Errors()
    summary = fly(setup_of(config, seed, has_yaws), [errors])
    legs = [(robot.robot, leg) for robot in summary.robots for leg in robot.legs]
    return YawResult(
        seed,
        has_yaws,
        summary.sim_time_s,
        tuple(leg.time_s or 0.0 for _, leg in legs),
        tuple(errors.reached),
        sum(max(leg.attempts - 1, 0) for _, leg in legs),
        len(summary.contacts),
        tuple(
            f"{name} goal {leg.index + 1}: {leg.reason}" for name, leg in legs if not leg.reached
        ),
    )


def row(flights: Sequence[YawResult]) -> List[str]:
    reached = [one for flight in flights for one in flight.reached]
    legs = [leg_s for flight in flights for leg_s in flight.leg_s]
    yaws = [one.yaw_rad for one in reached if one.yaw_rad is not None]
    return [
        "with yaws" if flights[0].has_yaws else "yaw null",
        str(len(flights)),
        f"{len(reached)} of {len(legs)}",
        str(sum(flight.resent for flight in flights)),
        f"{max(one.distance_m for one in reached):.3f}",
        f"{max(yaws):.4f}" if yaws else "-",
        f"{sum(one.is_within for one in reached)} of {len(reached)}",
        f"{sum(flight.time_s for flight in flights) / len(flights):.1f}",
        f"{sum(legs) / len(legs):.2f}",
        str(sum(flight.contacts for flight in flights)),
    ]


def lost_text(flights: Sequence[YawResult]) -> str:
    """Return the time that the yaws cost, seed by seed."""
    pairs: Dict[int, Dict[bool, YawResult]] = {}
    for one in flights:
        pairs.setdefault(one.seed, {})[one.has_yaws] = one
    mission_s = np.array([pair[True].time_s - pair[False].time_s for pair in pairs.values()])
    goal_s = [np.mean(pair[True].leg_s) - np.mean(pair[False].leg_s) for pair in pairs.values()]
    error_s = float(np.std(mission_s, ddof=1) / math.sqrt(len(mission_s))) if len(pairs) > 1 else 0
    return (
        f"Time lost to yaws: {np.mean(goal_s):.2f} s per goal, {mission_s.mean():.1f} s per "
        f"mission (standard error {error_s:.1f} s, range {mission_s.min():.1f} to "
        f"{mission_s.max():.1f} s)"
    )


@click.command()
@click.option("--config", default="default", show_default=True)
@click.option("--seeds", default=100, show_default=True, help="Seeds; each is flown twice.")
@click.option("--first-seed", default=0, show_default=True)
@click.option(
    "--jobs",
    default=lambda: LocalWorkers().count,
    help="Flights at the same time. [default: one per core]",
)
def main(config: str, seeds: int, first_seed: int, jobs: int) -> None:
    """Fly the tutorial's mission with and without yaws and print a table of the results."""
    warm_up(setup_of(config, first_seed, True).configurations[0])
    simulate()  # compile the kernels once, not in every process
    seeds_flown = range(first_seed, first_seed + seeds)
    tasks = list(enumerate((config, seed, yaws) for seed in seeds_flown for yaws in (True, False)))
    flights: List[YawResult] = []
    results = fly_all(LocalWorkers(jobs), fly_mission, tasks)
    for _, one in track(results, "flights", total=len(tasks), disable=not sys.stderr.isatty()):
        flights.append(one)
        if one.faults or not sys.stderr.isatty():
            print(one, file=sys.stderr, flush=True)
    rows = [row([one for one in flights if one.has_yaws is yaws]) for yaws in (True, False)]
    print(f"Yaws offline, config {config}, seeds {first_seed} to {first_seed + seeds - 1}")
    print(tabulate.tabulate(rows, HEADER, disable_numparse=True, stralign="right"))
    print(lost_text(flights))
    sys.exit(any(one.faults or not all(r.is_within for r in one.reached) for one in flights))


if __name__ == "__main__":
    main()
