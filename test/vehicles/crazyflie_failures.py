#!/usr/bin/env python3
"""The table of failures of a Crazyflie: each row many times, at random moments of a flight.

    PYTHONPATH=src:test python3 test/vehicles/crazyflie_failures.py [REPEATS]

Prints how long the stand-in took to hover or to begin to descend, and in how many flights it did
what the row says.
"""

from __future__ import annotations

import random
import statistics
import sys

from vehicles.crazyflie_flight import CrazyfliePair

from quad_nav.geometry import Twist2D
from quad_nav.topics.vehicle_states import State

HOVER_MPS, DESCENT_M, NEIGHBOUR_M = 0.05, 0.02, 0.05
COMMAND = Twist2D(0.3, 0.1, 0.2)


def _stop_commands(flight):
    flight.command = None


def _lose_link(flight):
    flight.hears = flight.is_heard = False


def _lose_log(flight):
    flight.hears = False


def _freeze(flight):
    flight.crazyflie.is_frozen = True


def _drain(flight):
    flight.crazyflie.battery = 10


def _tumble(flight):
    flight.crazyflie.is_tumbled = True


def _jump(flight):
    flight.crazyflie.shift_m = 1.5


def _stop_all(flight):
    for one in (flight, flight.neighbour):
        one.machine.land(flight.now_s, "all vehicles land", is_stop_all=True)


def _leave(flight):
    flight.machine._limits = flight.machine.inputs._limits.__class__(radius_m=0.2)


def _climb(flight):
    flight.machine._limits = flight.machine.inputs._limits.__class__(height_m=0.9)


# Fault, state of the bridge that must follow, within s, whether it must descend.
ROWS = {
    "it tumbles": (_tumble, State.TAKEN_OVER, 0.2, True),
    "link lost, both ways": (_lose_link, State.NO_LINK, 1.7, True),
    "link lost from the Crazyflie only": (_lose_log, State.NO_LINK, 1.7, True),
    "estimate jumps by 1.5 m": (_jump, State.LANDING, 0.2, True),
    "estimate frozen under a command": (_freeze, State.LANDING, 4.0, True),
    "battery low for 2 s": (_drain, State.LANDING, 2.3, True),
    "height beyond the limit": (_climb, State.LANDING, 0.1, True),
    "distance beyond the limit": (_leave, State.LANDING, 0.1, True),
    "no command for 0.5 s": (_stop_commands, State.HOLDING, 0.7, False),
    "no command for 5 s": (_stop_commands, State.LANDING, 5.2, True),
    "stop all": (_stop_all, State.LANDING, 0.1, True),
}


def fly_row(name, moment_s):
    """Fly one row beside a Crazyflie that hovers.

    Returns:
        The time to a hover, or to the begin of the descent, and how far the other one moved.

    Raises:
        AssertionError: The bridge did something else.
    """
    fault, state, within_s, descends = ROWS[name]
    flight = CrazyfliePair()
    try:
        flight.to_flight(COMMAND)
        flight.run(moment_s)
        assert flight.state is State.FLYING, (flight.state, flight.machine.reason)
        start_s, height_m = flight.now_s, flight.crazyflie.height_m
        flight.mark()
        fault(flight)
        assert flight.run(within_s, lambda: flight.state is state), (flight.state, flight.news)

        def is_safe():
            if descends:
                return flight.crazyflie.height_m < height_m - DESCENT_M
            return flight.crazyflie.speed_mps < HOVER_MPS

        assert flight.run(12.0, is_safe), (flight.state, flight.crazyflie.height_m)
        time_s, neighbour = flight.now_s - start_s, flight.neighbour
        wanted = State.LANDING if fault is _stop_all else State.FLYING
        assert neighbour.state is wanted, (neighbour.state, neighbour.machine.reason)
        assert fault is _stop_all or flight.neighbour_moved_m < NEIGHBOUR_M
        return time_s, flight.neighbour_moved_m
    finally:
        flight.bodies.close()


def main():
    repeats = int(sys.argv[1]) if len(sys.argv) > 1 else 20
    moments, failed = random.Random(1), 0
    for name in ROWS:
        flown = []
        for _ in range(repeats):
            try:
                flown.append(fly_row(name, moments.uniform(0.0, 4.0)))
            except AssertionError as error:
                failed += 1
                print(f"{name}: {error}")
        times, moved = zip(*flown)
        print(
            f"| {name} | {statistics.median(times):.2f}, {max(times):.2f} |"
            f" {len(times)} of {repeats} | the other one moved {max(moved):.3f} m",
            flush=True,
        )
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
