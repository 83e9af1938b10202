"""What a broken sender can send to a bridge: any number, text or kind of message."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from vehicles.virtual_flight import Flight

from quad_nav.topics.vehicle_states import State
from quad_vehicles import failsafes, ranges
from quad_vehicles.adapter import VehicleAdapter
from quad_vehicles.crazyflie_adapter import TRAITS, CrazyflieAdapter
from quad_vehicles.frames import scan_from_obstacle_distance
from quad_vehicles.mavlink_adapter import MavlinkAdapter
from quad_vehicles.orders import Permissions
from quad_vehicles.states import VehicleMachine
from quad_vehicles.telemetry import Limits
from quad_vehicles.vehicle_file import Lidar, Vehicle

sys.path.insert(0, str(Path(__file__).parents[1] / "fuzz"))

import vehicle as fuzzed  # noqa: E402

LIMITS = Limits()
USUAL = {
    "ATTITUDE": dict.fromkeys(ranges.MAVLINK["ATTITUDE"], 0.1),
    "LOCAL_POSITION_NED": {
        "time_boot_ms": 41_000,
        **dict.fromkeys(ranges.MAVLINK["LOCAL_POSITION_NED"], 0.1),
    },
    "OBSTACLE_DISTANCE": {"increment_f": 5.0, "angle_offset": 0.0},
    "SYS_STATUS": {"battery_remaining": 90},
    "TIMESYNC": {"tc1": 10**9, "ts1": 10**9},
}
FIELDS = [(name, field) for name, fields in ranges.MAVLINK.items() for field in fields]


def texts_of(adapter):
    return [text for _, text in adapter.pop_texts()]


@pytest.fixture(scope="module")
def flight():
    return Flight().to_flight()


@pytest.mark.parametrize("value", [math.nan, 1e30])
@pytest.mark.parametrize("name, field", FIELDS)
def test_a_number_out_of_its_range_is_dropped_with_a_line_and_the_flight_goes_on(
    flight, name, field, value
):
    flight.adapter._told_s.clear()
    texts_of(flight.adapter)
    before, sent = flight.adapter.estimate, len(flight.sent)
    message = SimpleNamespace(**{**USUAL[name], field: value})
    flight.adapter.receive(name, 1, message, flight.now_s)
    assert flight.adapter.estimate is before
    least, most = ranges.MAVLINK[name][field]
    expected = f"{name}: {field} is {value:g}, expected {least:g} to {most:g}; dropped"
    assert texts_of(flight.adapter) == [expected]
    flight.run(0.3)
    assert flight.state is State.FLYING and flight.adapter.estimate is not before
    assert len(flight.sent) > sent


def test_the_same_fault_is_told_once_in_5_s():
    flight = Flight()
    bad = SimpleNamespace(**{**USUAL["ATTITUDE"], "roll": math.inf})
    for k in range(1000):
        flight.adapter.receive("ATTITUDE", 1, bad, 100.0 + 0.01 * k)  # for 10 s
    assert len(texts_of(flight.adapter)) == 2


def test_an_estimator_that_fails_for_good_ends_in_a_landing():
    flight = Flight().to_flight()
    attitude = flight.vehicle.send
    flight.vehicle.send = lambda name, **fields: attitude(
        name, **{**fields, "roll": math.inf} if name == "ATTITUDE" else fields
    )
    assert flight.run(2.5, lambda: flight.state is State.LANDING)
    assert "no new estimate" in flight.machine.reason


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_a_parameter_that_is_no_number_counts_as_no_answer(autopilot, value):
    flight = Flight(autopilot)
    flight.vehicle._send_parameter = lambda name: flight.vehicle.send(
        "PARAM_VALUE", param_id=name, param_value=value, param_type=9
    )
    flight.run(10.0)
    assert flight.state is State.NOT_READY
    assert "the autopilot does not answer" in flight.machine.reason
    assert any(f"is {value}, expected a finite number" in text for text in texts_of(flight.adapter))


def test_whole_numbers_of_px4_that_look_like_nan_are_read():
    """-1 as an integer of 32 bits has the bits of a NaN."""
    adapter = Flight("px4").adapter
    (value,) = fuzzed.struct.unpack("<f", fuzzed.struct.pack("<i", -1))
    assert math.isnan(value)
    message = SimpleNamespace(param_id="NAV_DLL_ACT", param_value=value, param_type=6)
    adapter.receive("PARAM_VALUE", 1, message, 100.0)
    assert adapter.parameters.values == {"NAV_DLL_ACT": -1.0}


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 3.4e38, None])
@pytest.mark.parametrize("has_radio", [True, False])
@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_failsafes_with_any_value_of_any_parameter(autopilot, has_radio, value):
    vehicle = Vehicle(0, "mavlink", autopilot, has_radio=has_radio, sets_failsafes=True)
    names = failsafes.names(vehicle)
    for changed in names:
        for other in (0.0, 1.0, 2.0, 3.0, 4.0, 5.0):
            values = {**dict.fromkeys(names, other), changed: value}
            failsafes.wanted(values, vehicle)
            failsafes.faults(values, vehicle)
    every = dict.fromkeys(names, value)
    assert failsafes.faults(every, vehicle)


def test_an_error_of_a_handler_is_told_and_ends_nothing(monkeypatch):
    def fail(adapter, message, now_s):
        raise ZeroDivisionError("never thought of")

    monkeypatch.setitem(MavlinkAdapter._HANDLERS, "RC_CHANNELS", fail)
    flight = Flight().to_flight()
    assert "RC_CHANNELS: ZeroDivisionError: never thought of; dropped" in texts_of(flight.adapter)


def test_a_message_without_its_fields_is_dropped():
    flight = Flight()
    for name in MavlinkAdapter._HANDLERS:
        flight.adapter.receive(name, 1, SimpleNamespace(), 100.0)
    assert len(texts_of(flight.adapter)) == len(MavlinkAdapter._HANDLERS)


def text_message(text, number=0):
    return SimpleNamespace(severity=2, text=text, id=number, chunk_seq=0)


def test_a_flood_of_texts_leaves_a_short_reason():
    """8,000 different ones in a second, as a broken autopilot sends them."""
    flight = Flight().to_ready()
    for k in range(8000):
        message = text_message(f"PreArm: {k} {'x' * 40}"[:49])
        flight.adapter.receive("STATUSTEXT", 1, message, flight.now_s)
    flight.run(0.1)
    assert flight.state is State.NOT_READY
    assert flight.machine.reason.count("PreArm: ") == 10
    assert "PreArm: 7999 " in flight.machine.reason and len(flight.machine.reason) < 600
    assert len(flight.adapter.pop_texts()) == 100


def test_a_text_in_parts_without_an_end_does_not_grow():
    flight = Flight()
    for _ in range(1000):
        flight.adapter.receive("STATUSTEXT", 1, text_message("y" * 50, 7), flight.now_s)
    flight.adapter.receive("STATUSTEXT", 1, text_message("end", 7), flight.now_s)
    assert texts_of(flight.adapter) == ["y" * 250]


def test_a_flood_of_refusals_leaves_a_short_reason():
    flight = Flight().to_ready()
    flight.vehicle.refuses_arming = "Gyros inconsistent"
    flight.machine.take_off(flight.now_s)
    flight.run(0.1)
    for k in range(3000):
        flight.adapter.receive("STATUSTEXT", 1, text_message(f"Arm: {k}"), flight.now_s)
    assert flight.run(3.0, lambda: flight.state is State.NOT_READY)
    assert flight.machine.refusal.count("Arm: ") <= 10


def test_control_characters_of_texts_are_escaped():
    flight = Flight()
    flight.adapter.receive("STATUSTEXT", 1, text_message("PreArm: \x1b[2J\t"), flight.now_s)
    assert texts_of(flight.adapter) == ["PreArm: \\x1b[2J"]


@pytest.mark.parametrize("increment_deg", [1e-310, 1e-45, -1e-45])
def test_sectors_without_a_width_make_no_scan(increment_deg):
    message = SimpleNamespace(
        increment=0,
        increment_f=increment_deg,
        angle_offset=0.0,
        min_distance=20,
        max_distance=500,
        frame=12,
        distances=[100] * 72,
    )
    assert scan_from_obstacle_distance(message, 0.0) is None


# Crazyflies.

ANY = st.floats() | st.integers(-(2**31), 2**31)
BLOCKS = st.sampled_from(sorted(ranges.CRAZYFLIE))


def crazyflie(may_arm=True):
    machine = VehicleMachine(1.0, LIMITS, TRAITS, Permissions(may_arm=may_arm))
    vehicle = Vehicle(0, "crazyflie", limits=LIMITS, lidar=Lidar(is_multiranger=True))
    adapter = CrazyflieAdapter(vehicle, machine)
    adapter.connected({"deck.bcFlow2": 1.0, "deck.bcMultiranger": 1.0})
    return adapter


@settings(max_examples=100, deadline=None, derandomize=True)
@given(st.lists(st.tuples(BLOCKS, st.integers(-1, 2**25), st.data()), max_size=8), st.booleans())
def test_no_value_of_a_crazyflie_raises_or_turns_the_motors(blocks, may_arm):
    adapter, now_s = crazyflie(may_arm), 100.0

    def fail(what, error, now_s):
        raise error

    adapter.fail = fail
    for block, stamp_ms, data in blocks:
        values = {field: data.draw(ANY) for field in ranges.CRAZYFLIE[block]}
        adapter.receive(block, stamp_ms, values, now_s)
        assert adapter.tick(now_s)[1] == []
        now_s += 0.01


@pytest.mark.parametrize("block", sorted(ranges.CRAZYFLIE))
def test_a_value_of_a_crazyflie_that_is_missing_or_not_finite_is_told(block):
    adapter = crazyflie()
    adapter.receive(block, 0, {}, 100.0)
    first = next(iter(ranges.CRAZYFLIE[block]))
    assert texts_of(adapter) == [f"{block}: KeyError: '{first}'; dropped"]
    values = {**dict.fromkeys(ranges.CRAZYFLIE[block], 0.0), first: math.inf}
    adapter.receive(block, 0, values, 100.0)
    assert texts_of(adapter)[0].startswith(f"{block}: {first} is inf, expected")


def test_fuzzed_datagrams_end_nothing_and_arm_nothing(monkeypatch):
    """The first flights of ``make fuzz TARGET=vehicle``, shortened."""
    monkeypatch.setattr(fuzzed, "STEPS", 10)
    told = []
    fed, armed = fuzzed.fuzz(16 * 10 * fuzzed.PER_STEP, math.inf, 0, told.append)
    assert (fed, armed) == (3200, 1600)
    assert "no exception, no arming without an order" in told[-1]


def test_a_fault_is_found_by_fuzzing(monkeypatch):
    """Without the ranges an infinite angle raises."""
    monkeypatch.setattr(VehicleAdapter, "_handle", lambda *arguments: arguments[4]())
    with pytest.raises((ValueError, OverflowError)):
        fuzzed.fuzz(100_000, math.inf, 0, lambda _: None)
