"""Rates, parameters and clocks over a link that loses messages; scans of OBSTACLE_DISTANCE."""

from __future__ import annotations

import math
import struct
from types import SimpleNamespace

import numpy as np
import pytest

from quad_vehicles.exchanges import ClockSync, MessageRates, Parameters
from quad_vehicles.frames import scan_from_obstacle_distance


def test_rates_are_asked_for_again_until_they_arrive():
    rates = MessageRates({32: ("LOCAL_POSITION_NED", 30.0), 1: ("SYS_STATUS", 1.0)})
    first = rates.requests(1.5)
    assert [fields["param1"] for _, fields in first] == [32.0, 1.0]
    assert first[0][1]["command"] == 511
    assert first[0][1]["param2"] == pytest.approx(1e6 / 30)
    for _ in range(2):
        rates.count("SYS_STATUS")
    assert rates.requests(2.0) == []
    assert [fields["param1"] for _, fields in rates.requests(3.5)] == [32.0]  # none has come
    for _ in range(60):
        rates.count("LOCAL_POSITION_NED")
    for _ in range(2):
        rates.count("SYS_STATUS")
    assert rates.requests(5.5) == []


def test_parameters_are_asked_for_again_and_given_up():
    parameters = Parameters(["A", "B"], sends_bits=False)
    assert [fields["param_id"] for _, fields in parameters.requests(0.0)] == ["A", "B"]
    assert parameters.requests(0.1) == []
    parameters.take("A", 5.0, 9)
    assert [fields["param_id"] for _, fields in parameters.requests(1.0)] == ["B"]
    for k in range(20):
        parameters.requests(2.0 + k)
    assert parameters.is_read and parameters.values == {"A": 5.0, "B": None}


def test_a_write_is_repeated_until_its_echo():
    parameters = Parameters(["A"], sends_bits=False)
    parameters.take("A", 3.0, 2)
    parameters.write({"A": 0.5})
    fields = {"param_id": "A", "param_value": 0.5, "param_type": 2}
    assert parameters.requests(0.0) == [("PARAM_SET", fields)]
    parameters.take("A", 3.0, 2)  # an answer to somebody else
    assert not parameters.is_written
    assert parameters.requests(1.0) == [("PARAM_SET", fields)]
    parameters.take("A", 0.5, 2)
    assert parameters.is_written and parameters.requests(2.0) == []


def test_whole_numbers_of_px4_travel_as_their_bits():
    bits = struct.unpack("<f", struct.pack("<i", 3))[0]
    parameters = Parameters(["NAV_DLL_ACT"], sends_bits=True)
    parameters.take("NAV_DLL_ACT", bits, 6)
    assert parameters.values == {"NAV_DLL_ACT": 3.0}
    parameters.write({"NAV_DLL_ACT": 2.0})
    value = parameters.requests(0.0)[0][1]["param_value"]
    assert struct.pack("<f", value) == struct.pack("<i", 2)


@pytest.mark.parametrize("offset_s", [-1e9, -5.0, 0.0, 123.4])
def test_clock_takes_the_exchange_with_the_shortest_trip(offset_s):
    clock = ClockSync()
    assert clock.ours_s(7.0, 50.0) == 50.0
    for sent_s, there_s, back_s in [(10.0, 0.2, 0.01), (11.0, 0.002, 0.002), (12.0, 0.01, 0.3)]:
        theirs_ns = round((sent_s + there_s + offset_s) * 1e9)
        assert clock.take(theirs_ns, round(sent_s * 1e9), sent_s + there_s + back_s) is None
    assert clock.ours_s(20.0 + offset_s, 30.0) == pytest.approx(20.0, abs=1e-6)
    assert clock.ours_s(31.0 + offset_s, 30.0) == 30.0  # never in the future


def exchange(clock, sent_s, trip_s, offset_s):
    """Let a clock take an answer that was made in the middle of the trip."""
    theirs_ns = round((sent_s + trip_s / 2.0 + offset_s) * 1e9)
    clock.take(theirs_ns, round(sent_s * 1e9), sent_s + trip_s)


@pytest.mark.parametrize("step_s", [-2.5, -0.05, 0.05, 2.5])
def test_a_step_of_the_clock_drops_the_samples_before_it(step_s):
    clock = ClockSync()
    for k in range(20):
        exchange(clock, 10.0 + k, 0.002, 100.0)
    assert clock.ours_s(130.0, 40.0) == pytest.approx(30.0, abs=1e-6)
    exchange(clock, 30.0, 0.006, 100.0 + step_s)  # the first after the step; a longer trip
    assert clock.ours_s(130.0 + step_s, 40.0) == pytest.approx(30.0, abs=1e-6)


def test_an_answer_that_was_late_on_one_way_is_no_step():
    clock = ClockSync()
    exchange(clock, 10.0, 0.002, 100.0)
    theirs_ns = round((11.0 + 0.001 + 100.0) * 1e9)  # there in 1 ms, back in 500 ms
    clock.take(theirs_ns, round(11.0 * 1e9), 11.501)
    exchange(clock, 12.0, 0.004, 100.0)
    assert len(clock._samples) == 3
    assert clock.ours_s(130.0, 40.0) == pytest.approx(30.0, abs=1e-6)


def test_an_autopilot_with_the_new_name_of_a_parameter_is_not_asked_for_the_old_one():
    parameters = Parameters(["OLD", "NEW"], sends_bits=False, renamed={"NEW": ("OLD",)})
    parameters.take("NEW", 255.0, 9)
    assert parameters.is_read and parameters.values == {"OLD": None, "NEW": 255.0}
    assert parameters.requests(0.0) == []


def test_the_autopilots_own_question_is_answered():
    assert ClockSync().take(0, 77, 2.5) == ("TIMESYNC", {"tc1": 2500000000, "ts1": 77})


def distances(**fields):
    values = {
        "increment": 90,
        "increment_f": 0.0,
        "angle_offset": 0.0,
        "min_distance": 20,
        "max_distance": 500,
        "frame": 12,
        "distances": [100, 200, 501, 65535, *[65535] * 68],
    }
    return SimpleNamespace(**{**values, **fields})


def range_at(scan, angle_deg):
    beams = np.degrees(scan.angle_min_rad + scan.angle_increment_rad * np.arange(4))
    return scan.ranges_m[np.argmin(np.abs((beams - angle_deg + 180) % 360 - 180))]


def test_sectors_are_clockwise_and_beams_are_not():
    scan = scan_from_obstacle_distance(distances(), 3.0)
    assert (scan.stamp_s, scan.range_min_m, scan.range_max_m) == (3.0, 0.2, 5.0)
    assert range_at(scan, 0) == 1.0  # ahead
    assert range_at(scan, -90) == 2.0  # the second sector is to the right
    assert range_at(scan, 180) == math.inf  # no obstacle
    assert math.isnan(range_at(scan, 90))  # not measured


def test_sectors_from_north_turn_with_the_heading():
    scan = scan_from_obstacle_distance(distances(frame=0), 0.0, heading_rad=math.pi / 2)
    assert range_at(scan, 90) == 1.0  # north is to the left of a vehicle that looks east


@pytest.mark.parametrize(
    "fields", [{"increment": 0}, {"increment_f": math.nan}, {"max_distance": 10}]
)
def test_sectors_that_make_no_scan(fields):
    assert scan_from_obstacle_distance(distances(**fields), 0.0) is None
