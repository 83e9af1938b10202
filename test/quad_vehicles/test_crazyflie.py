"""The bridge of a Crazyflie: signs, heights, safety, on a virtual clock."""

from __future__ import annotations

import math

import numpy as np
import pytest
from vehicles.crazyflie import Crazyflie
from vehicles.virtual_flight import AHEAD, CrazyflieBridge, Flight

from quad_nav.geometry import Pose3D, Twist2D
from quad_nav.topics.vehicle_states import State
from quad_vehicles.arrival_clock import ArrivalClock
from quad_vehicles.frames import crazyflie_quaternion
from quad_vehicles.orders import Permissions


def crazyflie(*arguments, **limits):
    """A flight of a Crazyflie that has not taken off yet."""
    return Flight("crazyflie", *arguments, **limits)


def test_from_the_desk_to_the_desk():
    flight = crazyflie().to_hover()
    heights = [setpoint[4] for setpoint in flight.vehicle.setpoints]
    times = [setpoint[0] for setpoint in flight.vehicle.setpoints]
    # It climbs by 0.3 m/s and not in one step.
    assert np.max(np.diff(heights) / np.diff(times)) == pytest.approx(0.3, abs=0.01)
    flight.run(2.0)
    assert flight.vehicle.height_m == pytest.approx(1.0, abs=0.03)
    assert flight.machine.land(flight.now_s, "asked").is_accepted
    flight.until_state(State.LANDED, 10.0)
    flight.run(3.0)
    assert not flight.vehicle.is_running
    assert flight.vehicle.height_m == pytest.approx(0.0, abs=0.01)
    assert flight.machine.take_off(flight.now_s).is_accepted  # and again
    flight.until_state(State.HOLDING, 10.0)


@pytest.mark.parametrize(
    "command, setpoint",
    [
        (Twist2D(0.3, 0.0, 0.0), (0.3, 0.0, 0.0)),
        (Twist2D(0.0, 0.3, 0.0), (0.0, 0.3, 0.0)),
        (Twist2D(0.0, 0.0, 0.5), (0.0, 0.0, 28.6479)),
        (Twist2D(2.0, 0.0, 3.0), (0.7, 0.0, 57.2958)),  # the limits: 0.7 m/s, 1 rad/s
    ],
)
def test_axes_units_and_limits_of_set_points(command, setpoint):
    flight = crazyflie().to_flight(command)
    assert flight.vehicle.setpoints[-1][1:4] == pytest.approx(setpoint, abs=1e-4)
    assert flight.vehicle.setpoints[-1][4] == pytest.approx(1.0, abs=0.001)


def test_a_body_goes_where_the_command_says():
    """Left and counter-clockwise, as its own log tells."""
    flight = crazyflie().to_flight(Twist2D(0.0, 0.2, 0.3))
    flight.run(1.0)
    estimate = flight.adapter.estimate
    assert estimate.linear_mps[1] == pytest.approx(0.2, abs=0.05)
    assert estimate.angular_radps[2] == pytest.approx(0.3, abs=0.05)
    assert estimate.odom_from_base.yaw_rad > 0.3


@pytest.mark.parametrize("yaw_deg", (-180, -90, 0, 45))
def test_nose_up_is_a_positive_logged_pitch_and_a_negative_pitch_of_ros(yaw_deg):
    attitude = Pose3D(0.0, 0.0, 0.0, crazyflie_quaternion(0.0, 10.0, yaw_deg))
    ahead = attitude.compose(Pose3D(1.0, 0.0, 0.0))
    assert ahead.z_m == pytest.approx(math.sin(math.radians(10.0)))
    assert (
        math.atan2(ahead.y_m, ahead.x_m)
        == pytest.approx(math.remainder(math.radians(yaw_deg), math.tau), abs=1e-9)
        or abs(yaw_deg) == 180
    )
    left = attitude.compose(Pose3D(0.0, 1.0, 0.0))
    assert left.z_m == pytest.approx(0.0, abs=1e-12)


def test_the_multi_ranger_is_a_scan_of_four_beams():
    flight = crazyflie()
    flight.vehicle.ranges_mm = [32767, 1200, 800, 0, 300]  # back, right, front, left, up
    flight.run(0.2)
    scan = flight.adapter.scan
    bearings = scan.angle_min_rad + scan.angle_increment_rad * np.arange(4)
    assert bearings == pytest.approx([-math.pi, -math.pi / 2, 0.0, math.pi / 2])
    np.testing.assert_array_equal(scan.ranges_m, np.float32([np.inf, 1.2, 0.8, np.nan]))


def test_nothing_turns_the_motors_without_permission():
    flight = crazyflie(Permissions())
    flight.to_ready()
    response = flight.machine.take_off(flight.now_s)
    assert not response.is_accepted and "arm:=true" in response.text
    flight.command = AHEAD
    flight.run(2.0)
    assert flight.sent == []


def test_a_dry_run_sends_nothing():
    flight = crazyflie(Permissions(may_arm=True, is_dry=True))
    flight.to_ready()
    assert flight.machine.take_off(flight.now_s).is_accepted
    flight.command = AHEAD
    flight.run(3.0)
    assert flight.state is State.FLYING and flight.sent == []


def test_a_crazyflie_that_has_to_be_armed(monkeypatch):
    monkeypatch.setattr(
        CrazyflieBridge,
        "make_vehicle",
        lambda bridge, bodies, *_: bridge.log_of(Crazyflie(bodies, arms_itself=False)),
    )
    assert crazyflie().to_hover().sent[0][1] == "arm"


def test_it_sinks_to_the_ground_when_nothing_is_heard_but_it_hears():
    flight = crazyflie().to_flight()
    flight.hears = False
    flight.until_state(State.NO_LINK, 3.0)
    lowest_m = flight.vehicle.height_m
    flight.run(8.0)
    heights = [setpoint[4] for setpoint in flight.vehicle.setpoints]
    assert lowest_m > 0.9 and heights[-1] == pytest.approx(0.0, abs=0.001)
    assert flight.vehicle.height_m < 0.06
    flight.run(10.0)
    assert not flight.vehicle.is_running


def test_a_link_that_comes_back_goes_on():
    flight = crazyflie().to_flight()
    flight.hears = False
    flight.until_state(State.NO_LINK, 3.0)
    flight.run(0.5)
    flight.hears = True
    flight.until_state(State.FLYING, 1.0)
    flight.run(3.0)
    assert flight.vehicle.height_m == pytest.approx(1.0, abs=0.05)


def test_it_falls_when_it_hears_nothing():
    """What the file of the vehicles has to allow by `link_lost: falls`."""
    flight = crazyflie().to_flight()
    flight.hears = flight.is_heard = False
    flight.run(1.9)
    assert flight.vehicle.is_running
    flight.run(0.2)
    assert not flight.vehicle.is_running


def test_a_tumble_ends_the_flight():
    flight = crazyflie().to_flight()
    flight.vehicle.is_tumbled = True
    flight.until_state(State.TAKEN_OVER, 1.0)
    assert (4, "the firmware has stopped the motors: it is tumbled") in flight.adapter.pop_texts()
    before = len(flight.vehicle.setpoints)
    flight.run(2.0)
    assert len(flight.vehicle.setpoints) == before


@pytest.mark.parametrize(
    "parameters, fault",
    [
        ({"deck.bcMultiranger": 1}, "no deck that measures the position"),
        ({"deck.bcFlow2": 1}, "no Multi-ranger deck"),
    ],
)
def test_missing_decks_are_reasons_not_to_fly(parameters, fault):
    flight = crazyflie()
    flight.adapter.connected(parameters)
    flight.run(1.0)
    assert flight.state is State.NOT_READY and fault in flight.machine.reason


@pytest.mark.parametrize("broken", [math.nan, math.inf])
def test_numbers_that_are_not_finite_stay_here(broken):
    flight = crazyflie().to_flight()
    before = len(flight.vehicle.setpoints)
    assert flight.adapter.follow(Twist2D(broken, 0.0, 0.0), flight.now_s) == (False, [])
    values = {**flight.vehicle.values(), "stateEstimate.x": broken}
    estimate = flight.adapter.estimate
    flight.adapter.receive("pose", 0, values, flight.now_s)
    assert flight.adapter.estimate is estimate
    flight.run(1.0)
    sent = flight.vehicle.setpoints[before:]
    assert len(sent) > 10 and np.isfinite(sent).all()


def test_stamps_are_on_our_clock_across_the_turn_of_the_counter():
    """The shortest delay, here 2 ms, stays in the offset."""
    clock = ArrivalClock()
    start_ms, delays_s = (1 << 24) - 500, [0.010, 0.002, 0.030, 0.004]
    for k in range(40):
        stamp_ms, sent_s = (start_ms + 50 * k) % (1 << 24), 7.0 + 0.05 * k
        ours_s = clock.ours_s(stamp_ms, sent_s + delays_s[k % 4])
        if k:
            assert ours_s == pytest.approx(sent_s + 0.002, abs=1e-9)


@pytest.mark.parametrize("step_ms", [-2500, 2500])
def test_stamps_follow_a_step_of_the_clock_within_two_seconds(step_ms):
    clock = ArrivalClock()
    for k in range(200):
        now_s = 7.0 + 0.05 * k
        ours_s = clock.ours_s(10_000 + 50 * k + (step_ms if k >= 100 else 0), now_s)
        if not 100 <= k < 141:
            assert ours_s == pytest.approx(now_s, abs=1e-9)
        assert ours_s < now_s + 1e-9
