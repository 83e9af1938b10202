"""Fly a set-up to its end and summarize the flight."""

from __future__ import annotations

import time
from typing import List, Optional, Sequence

from quad_nav.errors import PluginError
from quad_nav.mission.summary import MissionSummary, summarize
from quad_nav.offline.flight import Flight, FlightObserver
from quad_nav.scenario.flight_setup import FlightSetup


def fly(
    setup: FlightSetup,
    observers: Sequence[FlightObserver] = (),
    processes: int = 1,
) -> MissionSummary:
    """Fly a set-up until all goals have ended, time is up, or an observer stops the flight.

    Args:
        setup: The flight.
        observers: Called as the flight goes on; the first ``stop_reason`` ends it.
        processes: Number of processes that share the navigators.

    Returns:
        The summary; its ``reason`` says why the flight ended early, "" if it did not.

    Raises:
        WorkerProcessError: A worker process failed.
        PluginError: A plugin has a mistake. Its ``summary`` is that of the flight until then.
    """
    flight = Flight(setup, observers, processes)
    start_wall_s = time.perf_counter()
    mistake: Optional[PluginError] = None
    try:
        reasons = _advance_to_end(flight)
    except PluginError as error:
        mistake, reasons = error, [str(error)]
    except BaseException as error:  # recordings keep what was flown
        flight.end(f"ended by {type(error).__name__}")
        raise
    wall_time_s = time.perf_counter() - start_wall_s
    flight.end("; ".join(reasons))
    # Observers may fail at the end, for example a recording that is closed on a full disk.
    reason = "; ".join(dict.fromkeys([*reasons, *flight.stop_reasons]))
    summary = summary_of(flight, reason, wall_time_s)
    if mistake is not None:
        mistake.summary = summary
        raise mistake
    return summary


def summary_of(flight: Flight, reason: str, wall_time_s: float) -> MissionSummary:
    """Summarize a flight up to now; ``reason`` says why it ended early, "" if it did not."""
    return summarize(
        flight.log,
        {robot.name: robot.sequencer for robot in flight.robots},
        flight.now_s,
        sim_time_s=flight.now_s,
        wall_time_s=wall_time_s,
        reason=reason,
        seed=flight.setup.seed,
    )


def _advance_to_end(flight: Flight) -> List[str]:
    """Fly and return the reasons to end early, [] after all goals have ended."""
    time_limit_s = flight.setup.time_limit_s
    reasons = flight.stop_reasons
    while not flight.is_done and not reasons:
        flight.advance()
        reasons = flight.stop_reasons
        if flight.now_s >= time_limit_s and not flight.is_done and not reasons:
            reasons = [f"time limit of {time_limit_s:g} s"]
    return reasons
