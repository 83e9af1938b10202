#!/usr/bin/env python3
"""The table of failures: each row many times, at random moments of a flight.

    PYTHONPATH=src:test python3 test/vehicles/failures.py [REPEATS] [AUTOPILOT]

AUTOPILOT is `ardupilot`, `px4` or `crazyflie`. Prints how long the vehicle took to hover or to
begin to land, in how many flights it did what the row says, and how far another vehicle beside it
moved meanwhile, which hovers by its own bridge. The vehicles are stand-ins with simulated bodies,
their seeds others in each flight; the clock is virtual.
"""

from __future__ import annotations

import random
import statistics
import sys

from vehicles.virtual_flight import AIRFRAMES, Flight, PairFlight

from quad_nav.geometry import Twist2D
from quad_nav.topics.vehicle_states import State
from quad_vehicles.telemetry import Limits

HOVER_MPS, DESCENT_M = 0.05, 0.02
NEIGHBOUR_M = 0.05
"""How far the other vehicle may be from its place; its estimate drifts."""


def put(**values):
    """Return a fault that sets attributes of the flight."""
    return lambda flight: [setattr(flight, name, value) for name, value in values.items()]


def break_(**values):
    """Return a fault that sets attributes of the vehicle."""
    return lambda flight: [setattr(flight.vehicle, name, value) for name, value in values.items()]


def limit(**limits):
    """Return a fault that moves a limit of the bridge."""
    return lambda flight: setattr(flight.machine, "_limits", Limits(**limits))


def _move_stick(flight):
    flight.vehicle.sticks[0] = 1750


def _stop_all(flight):
    for one in (flight, flight.neighbour) if isinstance(flight, PairFlight) else (flight,):
        one.machine.land(flight.now_s, "all vehicles land", is_stop_all=True)


def _mislead_barometer(flight):
    flight.vehicle.estimator.baro_error_m = 2.0


def _lands_by_itself(flight):
    return flight.vehicle.mode == flight.vehicle.kind["land"]


NO_COMMANDS, NO_TELEMETRY = put(command=None), put(hears=False)
NO_LINK = put(hears=False, is_heard=False)
JUMP = lambda flight: flight.vehicle.jump(north_m=1.5)  # noqa: E731
FREEZE = lambda flight: flight.vehicle.freeze()  # noqa: E731
LOSE_GPS = lambda flight: flight.vehicle.lose_receiver()  # noqa: E731
TAKEN_OVER, HOLDING, LANDING = State.TAKEN_OVER, State.HOLDING, State.LANDING
# Name: fault, state of the bridge that must follow or what must become true, within s, whether the
# mission must pause. Over a link it may be ALWAYS_LATE_S later.
ROWS = {
    "the pilot changes the mode": (
        lambda flight: flight.vehicle.set_mode(flight.vehicle.kind["other"]),
        TAKEN_OVER,
        0.1,
        True,
    ),
    "the pilot moves a stick": (_move_stick, TAKEN_OVER, 0.3, True),
    "somebody disarms": (break_(armed=False), TAKEN_OVER, 1.1, True),  # at the next heartbeat
    "commands stop: hover": (NO_COMMANDS, HOLDING, 0.6, False),
    "commands stop: land": (NO_COMMANDS, LANDING, 5.1, False),
    "link lost": (NO_LINK, State.NO_LINK, 1.1, False),
    "link lost from the vehicle": (NO_TELEMETRY, State.NO_LINK, 1.1, False),
    "link lost to the vehicle": (put(is_heard=False), TAKEN_OVER, 7.0, True),
    "the bridge dies": (put(is_alive=False), _lands_by_itself, 17.0, False),
    "the bridge dies beside a station": (
        put(has_station=True, is_alive=False),
        _lands_by_itself,
        17.0,
        False,
    ),
    "estimate late: hover": (break_(hides_position=True), HOLDING, 0.6, False),
    "estimate late: land": (break_(hides_position=True), LANDING, 2.1, False),
    "estimate frozen": (FREEZE, LANDING, 4.0, False),
    "estimate jumps by 1.5 m": (JUMP, LANDING, 0.1, False),
    "battery low": (break_(battery=12), LANDING, 3.2, False),
    "voltage low, charge 100 %": (break_(battery=100, voltage_v=9.0), LANDING, 3.2, False),
    "height limit crossed": (limit(height_m=0.9), LANDING, 0.1, False),
    "distance limit crossed": (limit(radius_m=0.2), LANDING, 0.1, False),
    "stop all": (_stop_all, LANDING, 0.1, False),
    "the barometer puts it on the ground": (_mislead_barometer, LANDING, 10.0, False),
    "GPS lost: hover": (LOSE_GPS, HOLDING, 0.9, False),
    "GPS lost: land": (LOSE_GPS, LANDING, 2.4, False),
    "GPS glitch": (lambda flight: flight.vehicle.glitch(north_m=3.0), LANDING, 2.4, False),
    "radio lost": (lambda flight: flight.vehicle.lose_radio(), TAKEN_OVER, 1.1, True),
}
CRAZYFLIE_ROWS = {
    "it tumbles": (break_(is_tumbled=True), TAKEN_OVER, 0.2, True),
    "link lost": (NO_LINK, State.NO_LINK, 1.7, False),
    "link lost from the vehicle": (NO_TELEMETRY, State.NO_LINK, 1.7, False),
    "commands stop: hover": (NO_COMMANDS, HOLDING, 0.7, False),
    "commands stop: land": (NO_COMMANDS, LANDING, 5.2, False),
    "estimate frozen": (FREEZE, LANDING, 4.0, False),
    "estimate jumps by 1.5 m": (JUMP, LANDING, 0.2, False),
    "battery low": (break_(battery=10), LANDING, 2.3, False),
    "height limit crossed": (limit(height_m=0.9), LANDING, 0.1, False),
    "distance limit crossed": (limit(radius_m=0.2), LANDING, 0.1, False),
    "stop all": (_stop_all, LANDING, 0.1, False),
}
_GPS = {
    "ardupilot": "the GPS has lost its position (3 satellites)",
    "px4": "GNSS data fusion stopped",
}
REASONS = {
    "battery low": dict.fromkeys(("ardupilot", "px4"), "battery at 12 %, expected 20 % or more"),
    "voltage low, charge 100 %": {
        "ardupilot": "battery at 9.00 V, expected 10.5 V or more",
        "px4": "Low battery",
    },
    "GPS lost: hover": _GPS,
    "GPS lost: land": _GPS,
    "GPS glitch": dict.fromkeys(("ardupilot", "px4"), "the estimator rejects its measurements"),
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
ALWAYS_LATE_S = 0.05
STATES_WITHOUT_STREAM = (TAKEN_OVER, State.NO_LINK, LANDING)
COMMANDS = {"crazyflie": Twist2D(0.3, 0.1, 0.2)}
COMMAND = Twist2D(0.4, 0.1, 0.2)
CLOCK_ROW, REFUSED_ROW = "the vehicle's clock steps back", "arming is refused"
CANCELLED_ROW = "a foreign set-point cancels the take-off"


def rows_of(autopilot):
    """Return the names of all rows of an autopilot."""
    if autopilot == "crazyflie":
        return [*CRAZYFLIE_ROWS]
    rows = [*ROWS, CLOCK_ROW, REFUSED_ROW]
    return [*rows, CANCELLED_ROW] if autopilot == "ardupilot" else rows  # PX4 has set-points


def fly_row(name, autopilot, moment_s, make_flight=Flight, seed=0):
    """Fly one row; return the flight, the time to its state, and the time to a hover or landing.

    Raises:
        AssertionError: The bridge did something else.
    """
    flight = make_flight(autopilot, seed=seed)
    fly = {CLOCK_ROW: _fly_clock, REFUSED_ROW: _fly_refused, CANCELLED_ROW: _fly_cancelled}
    times = fly[name](flight, moment_s) if name in fly else _fly_fault(flight, name, moment_s)
    if isinstance(flight, PairFlight):
        _check_neighbour(flight, name)
    return (flight, *times)


def _begin(flight, moment_s):
    """Fly until a moment; return the time."""
    flight.to_flight(COMMANDS.get(flight.autopilot, COMMAND)).run(moment_s)
    assert flight.state is State.FLYING, (flight.state, flight.machine.reason)
    return _mark(flight)


def _mark(flight):
    if isinstance(flight, PairFlight):
        flight.mark()
    return flight.now_s


def _fly_fault(flight, name, moment_s):
    autopilot = flight.autopilot
    is_crazyflie = autopilot == "crazyflie"
    fault, state, within_s, pauses = (CRAZYFLIE_ROWS if is_crazyflie else ROWS)[name]
    start_s = _begin(flight, moment_s)
    height_m = flight.height_m
    fault(flight)

    def has_followed():
        return state(flight) if callable(state) else flight.state is state

    reached = flight.run(within_s + ALWAYS_LATE_S, has_followed)
    assert reached, (flight.state, flight.news[-2:])
    reached_s = flight.now_s - start_s

    def is_safe():
        if is_crazyflie and state is not HOLDING:  # it sinks, or falls
            return flight.height_m < height_m - DESCENT_M
        must_descend = state is LANDING or callable(state)
        return flight.speed_mps < HOVER_MPS and not (must_descend and flight.vehicle.landed == 2)

    assert flight.run(12.0, is_safe), (flight.state, flight.speed_mps)
    safe_s = flight.now_s - start_s
    assert (flight.pauses > 0) == pauses, flight.pauses
    if not is_crazyflie:  # which lands by set-points
        flight.run(1.0)
        if state in STATES_WITHOUT_STREAM and flight.state in STATES_WITHOUT_STREAM:
            assert flight.setpoints_since(start_s + reached_s + 0.1) == []
        assert REASONS.get(name, {}).get(autopilot, "") in flight.machine.reason
    return reached_s, safe_s


def _fly_clock(flight, moment_s):
    """Set the vehicle's clock back by 0.9 s: the flight goes on, and stamps are right again."""
    start_s = _begin(flight, moment_s)
    flight.vehicle.clock_step_s -= 0.9
    flight.run(0.06)  # a message comes

    def is_right():
        return flight.now_s - flight.adapter.estimate.stamp_s < 0.1

    assert flight.run(1.0, is_right), flight.now_s - flight.adapter.estimate.stamp_s
    wrong_s = flight.now_s - start_s
    assert not flight.run(1.0, lambda: not is_right() or flight.state is not State.FLYING)
    return wrong_s, wrong_s


def _ask_to_take_off(flight, moment_s):
    if isinstance(flight, PairFlight):
        flight.neighbour_to_hover()
    flight.to_ready().run(moment_s)
    assert flight.machine.take_off(flight.now_s).is_accepted
    return _mark(flight)


def _fly_refused(flight, moment_s):
    start_s = _ask_to_take_off(flight, moment_s)
    flight.vehicle.refuses_arming = "Gyros inconsistent"
    flight.until_state(State.NOT_READY, 5.0)
    assert "Gyros inconsistent" in flight.machine.refusal and not flight.vehicle.armed
    return (flight.now_s - start_s,) * 2


def _fly_cancelled(flight, moment_s):
    start_s = _ask_to_take_off(flight, moment_s)
    flight.until_state(State.TAKING_OFF, 5.0)
    flight.run(moment_s / 4.0)  # the motors run up for longer
    foreign = {"coordinate_frame": 8, "type_mask": 1479, "vx": 0.0, "vy": 0.0, "vz": 0.0}
    flight.vehicle.receive("SET_POSITION_TARGET_LOCAL_NED", foreign, sender=(42, 1))
    flight.until_state(HOLDING, 18.0)
    assert flight.vehicle.armed
    return (flight.now_s - start_s,) * 2


def _check_neighbour(flight, name):
    """Assert that the other vehicle hovers on; with all stopped it lands."""
    neighbour = flight.neighbour
    wanted = LANDING if name == "stop all" else State.FLYING
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
        moment_s, made = moments.uniform(0.0, 4.0), []

        def make(*arguments, made=made, **options):
            made.append(PairFlight(*arguments, **options))
            return made[-1]

        try:
            flight, *times = fly_row(name, autopilot, moment_s, make, seed)
            flown.append((*times, flight.neighbour_moved_m))
        except AssertionError as error:
            failed.append(f"seed {seed}, {moment_s:.2f} s: {error}")
        for flight in made:
            flight.bodies.close()
    return flown, failed


def main():
    repeats = int(sys.argv[1]) if len(sys.argv) > 1 else 20
    moments = random.Random(20)
    print(
        f"{'failure':30} {'autopilot':10} {'as said':>8} {'state s':>8} {'safe s':>7} {'max':>6}"
        f" {'other m':>8}"
    )
    good = True
    for autopilot in sys.argv[2:] or list(AIRFRAMES):
        for name in rows_of(autopilot):
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
