#!/usr/bin/env python3
"""The table of failures: each row many times, at random moments of a flight.

    PYTHONPATH=src:test python3 test/vehicles/failures.py [REPEATS] [AUTOPILOT]

Prints how long the vehicle took to hover or to begin to land, and in how many flights it did what
the row says. The vehicle is the stand-in with a simulated body, its seed another one in each
flight; the clock is virtual.
"""

from __future__ import annotations

import random
import statistics
import sys

from vehicles.virtual_flight import STAND_INS, Flight, StandInFlight

from quad_nav.geometry import Twist2D
from quad_nav.vehicle.orders import State

HOVER_MPS = 0.05


def _change_mode(flight):
    flight.vehicle.set_mode(flight.vehicle.kind["other"])


def _move_stick(flight):
    flight.vehicle.sticks[0] = 1750


def _disarm(flight):
    flight.vehicle.kill_motors()


def _stop_commands(flight):
    flight.command = None


def _lose_link(flight):
    flight.hears = flight.is_heard = False


def _lose_telemetry(flight):
    flight.hears = False


def _lose_commands(flight):
    flight.is_heard = False


def _freeze(flight):
    flight.vehicle.freeze()


def _jump(flight):
    flight.vehicle.jump(north_m=1.5)


def _drain(flight):
    flight.vehicle.battery = 12


def _stop_all(flight):
    flight.machine.land(flight.now_s, "all vehicles land", is_stop_all=True)


def _climb(flight):
    flight.vehicle.jump(up_m=1.5)  # too high, as it thinks


def _leave(flight):
    flight.machine._limits = flight.machine.inputs._limits.__class__(radius_m=0.2)


def _hide(flight):
    flight.vehicle.hides_position = True


def _kill_bridge(flight):
    flight.is_alive = False


def _lands_by_itself(flight):
    return flight.vehicle.mode == flight.vehicle.kind["land"]


# Name: fault, state of the bridge that must follow or what must become true, within s, whether the
# mission must pause.
ROWS = {
    "the pilot changes the mode": (_change_mode, State.TAKEN_OVER, 0.1, True),
    "the pilot moves a stick": (_move_stick, State.TAKEN_OVER, 0.3, True),
    "somebody disarms": (_disarm, State.TAKEN_OVER, 0.1, True),
    "commands stop: hover": (_stop_commands, State.HOLDING, 0.6, False),
    "commands stop: land": (_stop_commands, State.LANDING, 5.1, False),
    "link lost": (_lose_link, State.NO_LINK, 1.1, False),
    "link lost from the vehicle": (_lose_telemetry, State.NO_LINK, 1.1, False),
    "link lost to the vehicle": (_lose_commands, State.TAKEN_OVER, 7.0, True),
    "the bridge dies": (_kill_bridge, _lands_by_itself, 17.0, False),
    "estimate late: hover": (_hide, State.HOLDING, 0.6, False),
    "estimate late: land": (_hide, State.LANDING, 2.1, False),
    "estimate frozen": (_freeze, State.LANDING, 4.0, False),
    "estimate jumps by 1.5 m": (_jump, State.LANDING, 0.1, False),
    "battery low": (_drain, State.LANDING, 3.2, False),
    "height limit crossed": (_climb, State.LANDING, 0.1, False),
    "distance limit crossed": (_leave, State.LANDING, 0.1, False),
    "stop all": (_stop_all, State.LANDING, 0.1, False),
}
LATE_S, ALWAYS_LATE_S = {"somebody disarms": 1.1}, 0.05
"""A real link is this much later; arming is told by the heartbeats, once a second."""
STATES_WITHOUT_STREAM = (State.TAKEN_OVER, State.NO_LINK, State.LANDING)


COMMAND = Twist2D(0.4, 0.1, 0.2)


def fly_row(name, autopilot, moment_s, command=COMMAND, make_flight=Flight, seed=0):
    """Fly one row; return the flight, the time to its state, and the time to a hover or landing.

    Raises:
        AssertionError: The bridge did something else.
    """
    fault, state, within_s, pauses = ROWS[name]
    if make_flight is StandInFlight:
        within_s += LATE_S.get(name, ALWAYS_LATE_S)
    flight = make_flight(autopilot, seed=seed).to_flight(command)
    flight.run(moment_s)
    assert flight.state is State.FLYING, (flight.state, flight.machine.reason)
    start_s = flight.now_s
    fault(flight)

    def has_followed():
        return state(flight) if callable(state) else flight.state is state

    assert flight.run(within_s, has_followed), (flight.state, flight.news[-2:])
    reached_s = flight.now_s - start_s

    def is_safe():
        must_descend = state is State.LANDING or callable(state)
        return flight.speed_mps < HOVER_MPS and not (must_descend and flight.vehicle.landed == 2)

    assert flight.run(12.0, is_safe), (flight.state, flight.speed_mps)
    safe_s = flight.now_s - start_s
    silent_s = start_s + reached_s + 0.1
    flight.run(1.0)
    if state in STATES_WITHOUT_STREAM and flight.state in STATES_WITHOUT_STREAM:
        assert flight.setpoints_since(silent_s) == []
    assert (flight.pauses > 0) == pauses, flight.pauses
    return flight, reached_s, safe_s


def repeat(name, autopilot, repeats, moments):
    """Fly a row many times; return the times to its state, those to safety, and the failures."""
    reached, safe, failed = [], [], []
    for seed in range(repeats):
        moment_s, flight = moments.uniform(0.0, 4.0), None
        try:
            flight, reached_s, safe_s = fly_row(
                name, autopilot, moment_s, make_flight=StandInFlight, seed=seed
            )
            reached.append(reached_s)
            safe.append(safe_s)
        except AssertionError as error:
            failed.append(f"seed {seed}, {moment_s:.2f} s: {error}")
        if flight is not None:
            flight.end()
    return reached, safe, failed


def main():
    repeats = int(sys.argv[1]) if len(sys.argv) > 1 else 20
    autopilots = sys.argv[2:] or list(STAND_INS)
    moments = random.Random(20)
    print(f"{'failure':30} {'autopilot':10} {'as said':>8} {'state s':>8} {'safe s':>7} {'max':>6}")
    good = True
    for name in ROWS:
        for autopilot in autopilots:
            reached, safe, failed = repeat(name, autopilot, repeats, moments)
            good = good and not failed
            line = f"{name:30} {autopilot:10} {len(safe):>4}/{repeats:<3}"
            if safe:
                line += f" {statistics.median(reached):8.2f} {statistics.median(safe):7.2f}"
                line += f" {max(safe):6.2f}"
            print("\n    ".join([line, *failed]), flush=True)
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
