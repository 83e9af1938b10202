"""Flies through the worlds, several at once in processes of their own."""

from __future__ import annotations

import signal
from typing import Iterator, Sequence, Tuple

import joblib

from quad_nav.barn.protocol import TIME_LIMIT_S, Outcome, Run, metric
from quad_nav.barn.setup import BarnSetup, Contestant, flight_setup
from quad_nav.barn.worlds import BarnWorld
from quad_nav.mission.summary import MissionSummary
from quad_nav.offline.first_contact import FirstContact
from quad_nav.offline.run import fly

Task = Tuple[BarnWorld, int]


def cores() -> int:
    """As many flights are quickest at the same time."""
    return int(joblib.cpu_count())


def fly_all(setup: BarnSetup, workers: int) -> Iterator[Run]:
    """Every run of every world as soon as it is flown, in an order that is not said.

    Which runs come, and each bit of them, does not depend on ``workers``.
    """
    tasks: Sequence[Task] = [(world, run) for run in range(setup.runs) for world in setup.worlds]
    if workers == 1:
        return (fly_world(setup.contestant, world, run) for world, run in tasks)
    parallel = joblib.Parallel(workers, backend="loky", return_as="generator_unordered")
    runs: Iterator[Run] = parallel(
        joblib.delayed(_fly_in_worker)(setup.contestant, world, run) for world, run in tasks
    )
    return runs


def fly_world(contestant: Contestant, world: BarnWorld, run: int) -> Run:
    """One flight, to the goal, the first contact or the end of its time."""
    contact = FirstContact()
    setup = flight_setup(contestant, world, run)
    summary = fly(setup, (contact,), contact.has_come)
    return judge(summary, world, run)


def judge(summary: MissionSummary, world: BarnWorld, run: int) -> Run:
    """What a flight counts for. A contact counts, also one at the goal."""
    robot = summary.robots[0]
    leg = robot.legs[0]
    outcome = (
        Outcome.COLLISION
        if summary.contacts
        else Outcome.SUCCESS
        if leg.reached
        else Outcome.TIME_OUT
    )
    time_s = TIME_LIMIT_S if outcome is Outcome.TIME_OUT else leg.time_s or 0.0
    touched = summary.contacts[0] if summary.contacts else None
    assert summary.seed is not None and robot.min_clearance_m is not None
    return Run(
        world.number,
        run,
        summary.seed,
        outcome,
        time_s,
        metric(outcome, time_s, world.path_length_m),
        robot.path_length_m,
        robot.min_clearance_m,
        robot.recoveries,
        gave_up=leg.reason if outcome is Outcome.TIME_OUT and "abort" in leg.reason else "",
        touched=touched.other if touched else "",
        touched_at_m=(touched.x_m, touched.y_m) if touched else None,
    )


def _fly_in_worker(contestant: Contestant, world: BarnWorld, run: int) -> Run:
    # Ctrl-C reaches every process of the terminal; the first one ends the others.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    return fly_world(contestant, world, run)
