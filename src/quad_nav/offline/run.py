"""Flies a setup to its end and sums it up."""

from __future__ import annotations

import time
from typing import Callable, Optional, Sequence

from quad_nav.mission.summary import MissionSummary, summarize
from quad_nav.offline.flight import Flight
from quad_nav.offline.observer import FlightObserver
from quad_nav.scenario.flight_setup import FlightSetup

INTERRUPTED = "interrupted"


def fly(
    setup: FlightSetup,
    observers: Sequence[FlightObserver] = (),
    is_stopped: Optional[Callable[[], bool]] = None,
    processes: int = 1,
) -> MissionSummary:
    """Fly until every goal is through, time is up, or ``is_stopped`` says so.

    The navigators share so many ``processes``.
    """
    flight = Flight(setup, observers, processes)
    start_wall_s = time.perf_counter()
    try:
        reason = _advance_to_end(flight, is_stopped)
    except BaseException as error:  # what was flown is not lost with a fault of ours
        flight.end(f"ended by {type(error).__name__}")
        raise
    wall_time_s = time.perf_counter() - start_wall_s
    flight.end(reason)
    reasons = dict.fromkeys(why for why in (reason, flight.stop_reason) if why)
    return summarize(
        flight.log,
        {robot.name: robot.sequencer for robot in flight.robots},
        flight.now_s,
        sim_time_s=flight.now_s,
        wall_time_s=wall_time_s,
        reason="; ".join(reasons),
        seed=setup.seed,
    )


def _advance_to_end(flight: Flight, is_stopped: Optional[Callable[[], bool]]) -> str:
    """Why it ended early, "" when every goal is through."""
    time_limit_s = flight.setup.time_limit_s
    reason = flight.stop_reason
    while not flight.is_done and not reason:
        flight.advance()
        reason = flight.stop_reason
        if flight.now_s >= time_limit_s and not flight.is_done:
            reason = reason or f"time limit of {time_limit_s:g} s"
        elif is_stopped is not None and is_stopped():
            reason = reason or INTERRUPTED
    return reason
