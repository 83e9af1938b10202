"""Fly through the worlds, several at the same time in worker processes."""

from __future__ import annotations

from typing import Any, Dict, Iterator

from quad_bench.barn.protocol import TIME_LIMIT_S, Outcome, Run, metric
from quad_bench.barn.setup import BarnSetup, Contestant, flight_setup
from quad_bench.barn.worlds import BarnWorld
from quad_bench.flights import fly_each
from quad_nav.mission.summary import MissionSummary
from quad_nav.offline.flight import StopAtContact
from quad_nav.offline.run import fly


def fly_all(setup: BarnSetup, count: int) -> Iterator[Run]:
    """Yield every run of every world as soon as it is flown, in any order; see ``fly_each``."""
    tasks = [(setup.contestant, world, run) for run in range(setup.runs) for world in setup.worlds]
    return fly_each(fly_world, tasks, count)


def fly_world(contestant: Contestant, world: BarnWorld, run: int) -> Run:
    """Fly through a world until the goal, the first contact or the time limit."""
    summary = fly(flight_setup(contestant, world, run), (StopAtContact(),))
    return judge(summary, world, run)


def judge(summary: MissionSummary, world: BarnWorld, run: int) -> Run:
    """Score a flight by the benchmark's protocol."""
    found = judged(summary, summary.robots[0].legs[0].time_s or 0.0)
    score = metric(found["outcome"], found["time_s"], world.path_length_m)
    return Run(world.number, run, metric=score, **found)


def judged(summary: MissionSummary, time_s: float) -> Dict[str, Any]:
    """Return what both protocols say of a flight; a contact at the goal is a collision.

    Args:
        summary: The flight.
        time_s: Time that counts, but for a time-out.

    Returns:
        Values by the names of the fields of ``Run``.
    """
    robot = summary.robots[0]
    leg = robot.legs[0]
    touched = summary.contacts[0] if summary.contacts else None
    outcome = Outcome.COLLISION if touched else Outcome.SUCCESS if leg.reached else Outcome.TIME_OUT
    is_late = outcome is Outcome.TIME_OUT
    assert summary.seed is not None and robot.min_clearance_m is not None
    return {
        "seed": summary.seed,
        "outcome": outcome,
        "time_s": TIME_LIMIT_S if is_late else time_s,
        "path_length_m": robot.path_length_m,
        "min_clearance_m": robot.min_clearance_m,
        "recoveries": robot.recoveries,
        "gave_up": leg.reason if is_late and "abort" in leg.reason else "",
        "touched": touched.other if touched else "",
        "touched_at_m": (touched.x_m, touched.y_m) if touched else None,
    }
