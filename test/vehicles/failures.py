#!/usr/bin/env python3
"""The table of failures: each row many times, at random moments of a flight.

    PYTHONPATH=src:test python3 test/vehicles/failures.py [REPEATS] [AUTOPILOT]

Prints how long the vehicle took to hover or to begin to land, in how many flights it did what the
row says, and how far another vehicle beside it moved meanwhile, which hovers by its own bridge. The
vehicles are stand-ins with simulated bodies, their seeds others in each flight; the clock is
virtual.
"""

from __future__ import annotations

import random
import statistics
import sys

from vehicles.virtual_flight import STAND_INS, Flight, PairFlight, StandInFlight

from quad_nav.geometry import Twist2D
from quad_nav.topics.vehicle_states import State

CLOCK_ROW = "the vehicle's clock steps back"
HOVER_MPS = 0.05
NEIGHBOUR_M = 0.05
"""How far the other vehicle may be from its place; its estimate drifts."""


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
    for one in (flight, flight.neighbour) if isinstance(flight, PairFlight) else (flight,):
        one.machine.land(flight.now_s, "all vehicles land", is_stop_all=True)


def _climb(flight):
    flight.vehicle.jump(up_m=1.5)  # too high, as it thinks


def _leave(flight):
    flight.machine._limits = flight.machine.inputs._limits.__class__(radius_m=0.2)


def _hide(flight):
    flight.vehicle.hides_position = True


def _mislead_barometer(flight):
    flight.vehicle.estimator.baro_error_m = 2.0


def _kill_bridge(flight):
    flight.is_alive = False


def _kill_bridge_beside_station(flight):
    flight.has_station, flight.is_alive = True, False


def _lower_voltage(flight):
    flight.vehicle.battery, flight.vehicle.voltage_v = 100, 9.0


def _lose_receiver(flight):
    flight.vehicle.lose_receiver()


def _glitch(flight):
    flight.vehicle.glitch(north_m=3.0)


def _lose_radio(flight):
    flight.vehicle.lose_radio()


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
STAND_IN_ROWS = {
    **ROWS,
    "the barometer puts it on the ground": (_mislead_barometer, State.LANDING, 10.0, False),
    "the bridge dies beside a station": (
        _kill_bridge_beside_station,
        _lands_by_itself,
        17.0,
        False,
    ),
    "voltage low, charge 100 %": (_lower_voltage, State.LANDING, 3.2, False),
    "GPS lost: hover": (_lose_receiver, State.HOLDING, 0.9, False),
    "GPS lost: land": (_lose_receiver, State.LANDING, 2.4, False),
    "GPS glitch": (_glitch, State.LANDING, 2.4, False),
    "radio lost": (_lose_radio, State.TAKEN_OVER, 1.1, True),
}
_GPS = {
    "ardupilot": "the GPS has lost its position (3 satellites)",
    "px4": "GNSS data fusion stopped",
}
REASONS = {
    "battery low": dict.fromkeys(STAND_INS, "battery at 12 %, expected 20 % or more"),
    "voltage low, charge 100 %": {
        "ardupilot": "battery at 9.00 V, expected 10.5 V or more",
        "px4": "Low battery",
    },
    "GPS lost: hover": _GPS,
    "GPS lost: land": _GPS,
    "GPS glitch": dict.fromkeys(STAND_INS, "the estimator rejects its measurements"),
    "radio lost": {
        "ardupilot": "the mode was changed to LAND by the autopilot: Radio Failsafe",
        "px4": "the mode was changed to AUTO.LOITER by the autopilot: Failsafe activated",
    },
    "link lost to the vehicle": {
        "ardupilot": "the mode was changed to LAND by the autopilot: GCS Failsafe",
        "px4": "the mode was changed to AUTO.LOITER by the autopilot: Failsafe activated",
    },
}
"""What the reason of the bridge must tell at the end of some rows."""
LATE_S, ALWAYS_LATE_S = {"somebody disarms": 1.1}, 0.05
"""A real link is this much later; arming is told by the heartbeats, once a second."""
STATES_WITHOUT_STREAM = (State.TAKEN_OVER, State.NO_LINK, State.LANDING)


COMMAND = Twist2D(0.4, 0.1, 0.2)


def fly_row(name, autopilot, moment_s, command=COMMAND, make_flight=Flight, seed=0):
    """Fly one row; return the flight, the time to its state, and the time to a hover or landing.

    Raises:
        AssertionError: The bridge did something else.
    """
    fault, state, within_s, pauses = STAND_IN_ROWS[name]
    if issubclass(make_flight, StandInFlight):
        within_s += LATE_S.get(name, ALWAYS_LATE_S)
    flight = make_flight(autopilot, seed=seed).to_flight(command)
    flight.run(moment_s)
    assert flight.state is State.FLYING, (flight.state, flight.machine.reason)
    start_s = flight.now_s
    if make_flight is PairFlight:
        flight.mark()
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
    if issubclass(make_flight, StandInFlight):
        assert REASONS.get(name, {}).get(autopilot, "") in flight.machine.reason
    if make_flight is PairFlight:
        _check_neighbour(flight, name)
    return flight, reached_s, safe_s


def fly_clock_row(autopilot, moment_s, seed):
    """Set the vehicle's clock back by 0.9 s; return the flight, and how long stamps are wrong.

    Raises:
        AssertionError: They stay wrong, or the flight does not go on.
    """
    flight = PairFlight(autopilot, seed=seed).to_flight(COMMAND)
    flight.run(moment_s)
    flight.mark()
    start_s = flight.now_s
    flight.vehicle.clock_step_s -= 0.9
    flight.run(0.06)  # a message comes

    def is_right():
        return flight.now_s - flight.adapter.estimate.stamp_s < 0.1

    assert flight.run(1.0, is_right), flight.now_s - flight.adapter.estimate.stamp_s
    wrong_s = flight.now_s - start_s
    assert not flight.run(1.0, lambda: not is_right() or flight.state is not State.FLYING)
    _check_neighbour(flight, CLOCK_ROW)
    return flight, wrong_s


def _refuse_arming(flight, _):
    flight.vehicle.refuses_arming = "Gyros inconsistent"


def _cancel_take_off(flight, moment_s):
    assert flight.run(5.0, lambda: flight.state is State.TAKING_OFF), flight.state
    flight.run(moment_s / 4.0)  # the motors run up for longer
    foreign = {"coordinate_frame": 8, "type_mask": 1479, "vx": 0.0, "vy": 0.0, "vz": 0.0}
    flight.vehicle.receive("SET_POSITION_TARGET_LOCAL_NED", foreign, sender=(42, 1))


# Name: fault, state that must follow, within s.
TAKE_OFF_ROWS = {
    "arming is refused": (_refuse_arming, State.NOT_READY, 5.0),
    "a foreign set-point cancels the take-off": (_cancel_take_off, State.HOLDING, 18.0),
}


def fly_take_off_row(name, autopilot, moment_s, seed):
    """Fail one take-off beside a vehicle that hovers; return the flight and the time.

    Raises:
        AssertionError: The bridge did something else.
    """
    fault, state, within_s = TAKE_OFF_ROWS[name]
    flight = PairFlight(autopilot, seed=seed)
    flight.neighbour_to_hover()
    assert flight.run(10.0, lambda: flight.state is State.READY), flight.machine.reason
    flight.run(moment_s)
    flight.mark()
    assert flight.machine.take_off(flight.now_s).is_accepted
    start_s = flight.now_s
    fault(flight, moment_s)
    assert flight.run(within_s, lambda: flight.state is state), (flight.state, flight.news[-2:])
    assert state is not State.NOT_READY or "Gyros inconsistent" in flight.machine.refusal
    assert flight.vehicle.armed == (state is State.HOLDING)
    _check_neighbour(flight, name)
    return flight, flight.now_s - start_s


def _check_neighbour(flight, name):
    """Assert that the other vehicle hovers on; with all stopped it lands."""
    neighbour = flight.neighbour
    wanted = State.LANDING if name == "stop all" else State.FLYING
    assert neighbour.state is wanted, (neighbour.state, neighbour.machine.reason)
    assert neighbour.pauses == 0
    if wanted is State.FLYING:
        assert flight.neighbour_moved_m < NEIGHBOUR_M, flight.neighbour_moved_m


def repeat(name, autopilot, repeats, moments):
    """Fly a row many times; return a tuple for each flight, and the failures.

    A tuple has the time to the row's state, the time to safety, and how far the neighbour moved.
    """
    flown, failed = [], []
    for seed in range(repeats):
        moment_s, flight = moments.uniform(0.0, 4.0), None
        try:
            if name in TAKE_OFF_ROWS:
                flight, reached_s = fly_take_off_row(name, autopilot, moment_s, seed)
                safe_s = reached_s
            elif name == CLOCK_ROW:
                flight, reached_s = fly_clock_row(autopilot, moment_s, seed)
                safe_s = reached_s
            else:
                flight, reached_s, safe_s = fly_row(
                    name, autopilot, moment_s, make_flight=PairFlight, seed=seed
                )
            flown.append((reached_s, safe_s, flight.neighbour_moved_m))
        except AssertionError as error:
            failed.append(f"seed {seed}, {moment_s:.2f} s: {error}")
        if flight is not None:
            flight.end()
    return flown, failed


def main():
    repeats = int(sys.argv[1]) if len(sys.argv) > 1 else 20
    autopilots = sys.argv[2:] or list(STAND_INS)
    moments = random.Random(20)
    print(
        f"{'failure':30} {'autopilot':10} {'as said':>8} {'state s':>8} {'safe s':>7} {'max':>6}"
        f" {'other m':>8}"
    )
    good = True
    for name in [*STAND_IN_ROWS, CLOCK_ROW, *TAKE_OFF_ROWS]:
        for autopilot in autopilots:
            if name == "a foreign set-point cancels the take-off" and autopilot != "ardupilot":
                continue  # PX4 takes off by set-points
            flown, failed = repeat(name, autopilot, repeats, moments)
            good = good and not failed
            line = f"{name:30} {autopilot:10} {len(flown):>4}/{repeats:<3}"
            if flown:
                reached, safe, moved = zip(*flown)
                line += f" {statistics.median(reached):8.2f} {statistics.median(safe):7.2f}"
                line += f" {max(safe):6.2f} {max(moved):8.3f}"
            print("\n    ".join([line, *failed]), flush=True)
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
