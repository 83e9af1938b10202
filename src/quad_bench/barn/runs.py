"""Fly through the worlds, several at the same time in worker processes."""

from __future__ import annotations

from typing import Iterator, NamedTuple

from quad_bench.barn.protocol import TIME_LIMIT_S, Outcome, Run, metric
from quad_bench.barn.setup import BarnSetup, Contestant, flight_setup
from quad_bench.barn.worlds import BarnWorld
from quad_nav.mission.summary import MissionSummary
from quad_nav.offline import workers
from quad_nav.offline.flight import StopAtContact
from quad_nav.offline.run import fly


class _Task(NamedTuple):
    contestant: Contestant
    world: BarnWorld
    run: int


def fly_all(setup: BarnSetup, count: int) -> Iterator[Run]:
    """Yield every run of every world as soon as it is flown, in any order.

    The runs do not depend on ``count``, the number of flights at the same time.

    Raises:
        WorkersLost: Workers died repeatedly.
    """
    tasks = [
        _Task(setup.contestant, world, run) for run in range(setup.runs) for world in setup.worlds
    ]
    flown = workers.fly_all(workers.LocalWorkers(count), _fly_task, list(enumerate(tasks)))
    return (run for _, run in flown)


def fly_world(contestant: Contestant, world: BarnWorld, run: int) -> Run:
    """Fly through a world until the goal, the first contact or the time limit."""
    summary = fly(flight_setup(contestant, world, run), (StopAtContact(),))
    return judge(summary, world, run)


def _fly_task(task: _Task) -> Run:
    return fly_world(*task)


def judge(summary: MissionSummary, world: BarnWorld, run: int) -> Run:
    """Score a flight by the benchmark's protocol; a contact at the goal is a collision."""
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
