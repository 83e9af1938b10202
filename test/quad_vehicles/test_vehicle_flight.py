"""The bridge with a vehicle at the other end of its messages, on a virtual clock."""

from __future__ import annotations

import math

import numpy as np
import pytest
from vehicles import failures
from vehicles.virtual_flight import AIRFRAMES, STEP_S, Flight

from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.topics.vehicle_states import State
from quad_vehicles.orders import Permissions


@pytest.fixture(params=["ardupilot", "px4"])
def autopilot(request):
    return request.param


def test_from_no_link_to_a_hover_at_the_altitude(autopilot):
    flight = Flight(autopilot).to_hover()
    assert flight.states == [
        State.NO_LINK,
        State.NOT_READY,
        State.READY,
        State.ARMING,
        State.TAKING_OFF,
        State.HOLDING,
    ]
    flight.command = Twist2D()
    flight.run(6.0)
    assert flight.height_m == pytest.approx(1.2, abs=0.05)


def test_no_set_point_before_ardupilot_is_in_the_air():
    flight = Flight().to_hover()
    in_air_s = next(at_s for at_s, line in flight.news if line.startswith("holding"))
    assert flight.setpoints_since(0.0) == flight.setpoints_since(in_air_s)


def test_a_command_flies_the_way_that_ros_means(autopilot):
    flight = Flight(autopilot).to_flight(Twist2D(0.3, 0.2, 0.0))
    start = flight.bodies.pose(0).to_2d()
    flight.run(2.0)
    moved = start.inverse_transform(*flight.bodies.place(0)[:2])
    assert moved == pytest.approx((0.6, 0.4), abs=0.02)
    assert flight.adapter.estimate.linear_mps == pytest.approx((0.3, 0.2, 0.0), abs=0.03)


def test_a_turn_is_counter_clockwise(autopilot):
    flight = Flight(autopilot).to_flight(Twist2D(0.0, 0.0, 0.4))
    before = flight.adapter.estimate.odom_from_base.yaw_rad
    flight.run(1.0)
    after = flight.adapter.estimate.odom_from_base.yaw_rad
    assert math.remainder(after - before, math.tau) == pytest.approx(0.4, abs=0.03)


def test_lands_when_asked(autopilot):
    flight = Flight(autopilot).to_flight()
    assert flight.machine.land(flight.now_s, "asked").is_accepted
    start_s = flight.now_s + STEP_S
    flight.until_state(State.LANDED, 15.0)
    assert not flight.vehicle.armed and flight.height_m < 0.02
    assert flight.setpoints_since(start_s) == []
    flight.command = None
    flight.run(1.0)
    assert flight.machine.take_off(flight.now_s).is_accepted  # again
    flight.until_state(State.HOLDING, 20.0)


@pytest.mark.parametrize(
    "autopilot, row", [(one, row) for one in AIRFRAMES for row in failures.rows_of(one)]
)
def test_failure(autopilot, row):
    failures.fly_row(row, autopilot, 1.37, seed=5)


def test_a_running_stream_does_not_take_over_when_the_pilot_returns_the_mode(autopilot):
    flight, _, _ = failures.fly_row("the pilot changes the mode", autopilot, 0.5)
    start_s = flight.now_s
    flight.vehicle.set_mode(flight.vehicle.kind["control"])
    flight.run(3.0)
    assert flight.state is State.TAKEN_OVER
    assert flight.setpoints_since(start_s) == []


def test_a_taken_over_vehicle_flies_again_when_somebody_resumes_it(autopilot):
    flight, _, _ = failures.fly_row("the pilot changes the mode", autopilot, 0.5)
    assert flight.machine.resume(flight.now_s).is_accepted
    flight.until_state(State.FLYING, 3.0)
    assert flight.vehicle.mode == flight.vehicle.kind["control"]


def on_ground(state):
    """A flight whose vehicle is on the ground in a state."""
    if state in (State.LANDED, State.TAKEN_OVER):
        flight = Flight().to_flight()
        flight.command = None
        flight.machine.land(flight.now_s, "asked")
        if state is State.TAKEN_OVER:
            flight.vehicle.set_mode(flight.vehicle.kind["other"])  # the pilot, who lands it
            flight.until_state(State.TAKEN_OVER, 1.0)
            flight.vehicle.set_mode(flight.vehicle.kind["land"])
            flight.run(15.0, lambda: not flight.vehicle.armed)
            flight.vehicle.set_mode(flight.vehicle.kind["control"])
            flight.run(1.0)
        assert flight.run(15.0, lambda: flight.state is state), flight.state
        return flight
    flight = Flight().to_ready()
    if state is State.NOT_READY:
        flight.vehicle.battery = 10
        flight.until_state(State.NOT_READY, 2.0)
    if state is State.ARMING:
        flight.vehicle.refuses_arming = "Gyros inconsistent"
        assert flight.machine.take_off(flight.now_s).is_accepted
        assert flight.state is State.ARMING
    return flight


@pytest.mark.parametrize(
    ("state", "text"),
    [
        (State.NOT_READY, "battery at 10 %"),
        (State.READY, "take off first"),
        (State.LANDED, "take off first"),
        (State.TAKEN_OVER, "take off first"),
        (State.ARMING, "arming"),
    ],
)
def test_a_resumption_on_the_ground_fails_with_the_reason(state, text):
    flight = on_ground(state)
    response = flight.machine.resume(flight.now_s)
    assert not response.is_accepted
    assert state is State.TAKEN_OVER or response.text.startswith(state.value)
    assert text in response.text
    flight.run(5.0)
    assert not flight.vehicle.armed
    assert flight.state in (State.NOT_READY, State.READY, State.LANDED)


def test_a_vehicle_that_its_pilot_has_landed_flies_after_a_resumption_and_a_take_off():
    flight = on_ground(State.TAKEN_OVER)
    refused = flight.machine.take_off(flight.now_s)
    assert not refused.is_accepted and refused.text.startswith("taken over")
    flight.machine.resume(flight.now_s)
    flight.until_state(State.READY, 2.0)
    assert flight.machine.take_off(flight.now_s).is_accepted
    flight.until_state(State.HOLDING, 20.0)
    assert flight.machine.resume(flight.now_s).is_accepted


def test_a_resumption_without_effect_is_given_up_and_can_be_asked_for_again():
    flight, _, _ = failures.fly_row("the pilot changes the mode", "ardupilot", 0.5)
    flight.is_heard = False  # the orders get lost
    for _ in range(2):
        assert flight.machine.resume(flight.now_s).is_accepted
        assert flight.machine.refusal == ""
        assert not flight.run(2.0, lambda: flight.machine.refusal)
        assert flight.run(8.0, lambda: flight.machine.refusal)
        assert flight.state is State.TAKEN_OVER
    flight.is_heard = True
    assert flight.machine.resume(flight.now_s).is_accepted
    flight.until_state(State.FLYING, 4.0)


def test_a_vehicle_that_is_disarmed_in_a_resumption_is_not_resumed():
    flight, _, _ = failures.fly_row("the pilot changes the mode", "ardupilot", 0.5)
    flight.is_heard = False
    assert flight.machine.resume(flight.now_s).is_accepted
    flight.run(0.5)
    flight.vehicle.kill_motors()
    assert flight.run(2.0, lambda: flight.machine.refusal)
    flight.vehicle.set_mode(flight.vehicle.kind["control"])
    told = len(flight.states)
    flight.run(2.0)
    assert flight.state is State.TAKEN_OVER and len(flight.states) == told


@pytest.mark.parametrize("state", [State.TAKING_OFF, State.LANDING])
def test_a_resumption_in_a_climb_or_landing_fails(state):
    flight = Flight().to_ready()
    flight.machine.take_off(flight.now_s)
    flight.until_state(State.TAKING_OFF, 5.0)
    if state is State.LANDING:
        flight.machine.land(flight.now_s, "asked")
    response = flight.machine.resume(flight.now_s)
    assert not response.is_accepted and response.text.startswith(state.value)
    assert flight.state is state


def test_no_heartbeat_leaves_while_the_link_is_lost_in_flight(autopilot):
    """Otherwise the autopilot's failsafe would not act when only its messages are lost."""
    flight = Flight(autopilot).to_flight()
    flight.hears = False
    flight.until_state(State.NO_LINK, 1.2)
    start_s = flight.now_s + STEP_S
    assert flight.run(8.0, lambda: flight.vehicle.mode == flight.vehicle.kind["land"])
    assert [name for at_s, name, _ in flight.sent if at_s > start_s and name == "HEARTBEAT"] == []


@pytest.mark.parametrize("lost_s", [1.2, 1.5, 2.0, 2.4, 2.7, 3.0])
def test_a_short_loss_of_the_link_ends_in_flight(lost_s):
    """PX4 holds meanwhile, in a mode that is not ours."""
    flight = Flight().to_flight()
    flight.hears = flight.is_heard = False
    flight.run(lost_s)
    assert flight.state is State.NO_LINK
    flight.hears = flight.is_heard = True
    flight.until_state(State.FLYING, 2.0)


@pytest.fixture
def arming():
    """A vehicle that is armed, which its next heartbeat will tell up to 1 s later."""
    flight = Flight("px4").to_ready()
    assert flight.machine.take_off(flight.now_s).is_accepted
    assert flight.run(3.0, lambda: flight.vehicle.armed) and flight.state is State.ARMING
    return flight


def test_a_vehicle_that_its_pilot_disarms_before_take_off_is_not_armed_again(arming):
    arming.vehicle.armed = False
    assert not arming.run(4.0, lambda: arming.vehicle.armed)
    assert arming.machine.refusal == "the motors were disarmed from outside"


def test_a_mode_that_the_pilot_sets_before_take_off_stays(arming):
    arming.vehicle.set_mode(arming.vehicle.kind["other"])
    assert not arming.run(4.0, lambda: arming.vehicle.mode == arming.vehicle.kind["control"])
    assert arming.machine.refusal == "the mode was changed to POSCTL from outside"
    assert arming.height_m < 0.02


@pytest.fixture
def armed_by_hand(autopilot):
    """A vehicle whose pilot has armed it, with a bridge that may not."""
    flight = Flight(autopilot, Permissions()).to_ready()
    response = flight.machine.take_off(flight.now_s)
    assert not response.is_accepted and "arm:=true" in response.text
    flight.run(5.0)
    assert not flight.vehicle.armed
    flight.vehicle.receive("COMMAND_LONG", {"command": 400, "param1": 1.0}, (42, 1))
    assert flight.run(2.0, lambda: flight.machine.inputs.status.is_armed)
    assert flight.machine.take_off(flight.now_s).is_accepted
    return flight


def test_without_permission_the_pilot_arms(armed_by_hand):
    armed_by_hand.until_state(State.HOLDING, 20.0)
    assert 400 not in armed_by_hand.orders()


def test_a_vehicle_that_its_pilot_disarms_before_take_off_is_not_armed(armed_by_hand):
    armed_by_hand.vehicle.armed = False
    assert not armed_by_hand.run(6.0, lambda: armed_by_hand.vehicle.armed)
    assert "arm by hand" in armed_by_hand.machine.refusal


def test_a_dry_run_streams_but_does_not_arm(autopilot):
    flight = Flight(autopilot, Permissions(may_arm=True, is_dry=True)).to_ready()
    assert flight.machine.take_off(flight.now_s).is_accepted
    flight.command = Twist2D(0.2, 0.1, 0.3)
    flight.run(5.0)
    assert flight.state is State.FLYING and not flight.vehicle.armed
    last = flight.setpoints_since(flight.now_s - 0.1)[-1]
    # ArduPilot's velocity is turned by 0.6 s * 0.3 rad/s ahead of the heading.
    lead_rad = {"ardupilot": 0.18, "px4": 0.168}[autopilot]
    left, ahead = np.array([-0.1, 0.2]), np.array([0.2, 0.1])
    vx, vy = math.cos(lead_rad) * ahead + math.sin(lead_rad) * left
    assert [last["vx"], last["vy"], last["yaw_rate"]] == pytest.approx([vx, -vy, -0.3])
    commands = [fields["command"] for _, name, fields in flight.sent if name == "COMMAND_LONG"]
    assert 400 not in commands and 22 not in commands


def test_fence_height_and_timeout_are_written():
    flight = Flight(height_m=2.0, radius_m=8.0).to_ready()
    written = flight.vehicle.parameters
    assert (written["GUID_TIMEOUT"], written["FENCE_ENABLE"]) == (0.5, 1.0)
    assert (written["FENCE_ALT_MAX"], written["FENCE_RADIUS"]) == (2.5, 8.5)
    assert (written["FENCE_ACTION"], written["FENCE_TYPE"]) == (2.0, 3.0)


def test_set_points_go_out_at_20_hz_and_at_once_after_a_command(autopilot):
    flight = Flight(autopilot).to_flight()
    start_s = flight.now_s
    flight.run(10.0)
    times = [at_s for at_s, name, _ in flight.sent if "SET_POSITION" in name and at_s > start_s]
    assert len(times) == pytest.approx(200, abs=3)
    flight.command = None
    start_s = flight.now_s
    flight.run(4.0)  # holding
    times = [at_s for at_s, name, _ in flight.sent if "SET_POSITION" in name and at_s > start_s]
    assert len(times) == pytest.approx(80, abs=3)


def test_outward_command_slows_down_before_the_fence(autopilot):
    flight = Flight(autopilot, radius_m=2.0).to_flight(Twist2D(0.5, 0.0, 0.0))
    flight.run(8.0)
    assert flight.state is State.FLYING
    distance_m = math.hypot(*flight.bodies.place(0)[:2])
    assert 1.7 < distance_m < 2.0


PLACE = Pose2D(4.0, 5.0, 0.3)


def localized(**limits):
    """A flight whose place amcl knows."""
    flight = Flight(localization="amcl", **limits)
    flight.map_from_odom = PLACE
    return flight


def test_a_vehicle_that_is_not_localized_does_not_take_off():
    flight = Flight(localization="amcl")
    assert not flight.run(10.0, lambda: flight.state is State.READY)
    assert flight.machine.reason == "not localized: no transform map -> odom from amcl"
    assert not flight.machine.take_off(flight.now_s).is_accepted
    flight.map_from_odom = PLACE
    flight.to_hover()
    flight.machine.land(flight.now_s, "test")
    flight.until_state(State.LANDED, 20.0)
    flight.map_from_odom = None
    flight.until_state(State.NOT_READY, 2.0)


def test_a_vehicle_that_is_lost_hovers_and_flies_on_when_it_is_localized():
    flight = localized().to_flight()
    flight.map_from_odom = None
    flight.run(1.2)
    assert (flight.state, flight.machine.reason) == (State.HOLDING, "not localized for 1 s")
    assert flight.run(4.0, lambda: flight.speed_mps < 0.05)
    flight.map_from_odom = PLACE
    flight.until_state(State.FLYING, 0.1)


def test_a_vehicle_that_is_lost_for_long_lands_before_it_drifts_far():
    flight = localized().to_flight()
    flight.map_from_odom = None
    flight.until_state(State.LANDING, 10.2)
    assert flight.machine.reason == "not localized for 10 s"


def test_the_limit_of_distance_counts_in_map():
    """Odometry drifts toward the start as fast as the vehicle flies away: it sees no distance."""
    flight = localized(radius_m=2.0).to_flight()
    start, before = flight.machine.map_from_start, flight.machine.inputs.map_from_base()
    x, y = before.x_m - start.x_m, before.y_m - start.y_m
    away_m = math.hypot(x, y)
    shift = (2.1 - away_m) / away_m
    flight.map_from_odom = Pose2D(PLACE.x_m + shift * x, PLACE.y_m + shift * y, PLACE.yaw_rad)
    flight.until_state(State.LANDING, 0.1)
    assert "m from take-off, the limit is 2 m" in flight.machine.reason


def test_an_outward_command_slows_down_before_the_limit_in_map():
    flight = localized(radius_m=2.0).to_flight()
    flight.run(6.0)
    assert flight.state is State.FLYING and flight.speed_mps < 0.1


def test_a_navigator_that_waits_keeps_the_vehicle_in_the_air(autopilot):
    flight = Flight(autopilot).to_hover()
    for _ in range(20):
        flight.machine.inputs.take_idle(flight.now_s)
        flight.run(0.5)
    assert flight.state is State.HOLDING
    flight.until_state(State.LANDING, 5.6)  # it has died


def test_a_dry_run_notices_the_pilot_and_missing_commands(autopilot):
    flight = Flight(autopilot, Permissions(is_dry=True)).to_ready()
    assert flight.machine.take_off(flight.now_s).is_accepted
    flight.command = Twist2D(0.2, 0.0, 0.0)
    flight.until_state(State.FLYING, 5.0)
    flight.vehicle.jump(up_m=30.0)  # carried to another floor
    flight.run(1.0)
    assert flight.state is State.FLYING
    flight.command = None
    flight.until_state(State.HOLDING, 1.0)
    flight.command = Twist2D(0.2, 0.0, 0.0)
    flight.until_state(State.FLYING, 1.0)
    flight.vehicle.set_mode(flight.vehicle.kind["other"])
    flight.until_state(State.TAKEN_OVER, 0.1)
    assert flight.pauses == 1


def restarted(autopilot, dead_s):
    """A flight whose bridge dies under a command, and another bridge that has seen a heartbeat."""
    flight = Flight(autopilot).to_flight(Twist2D(0.4, 0.1, 0.2))
    flight.is_alive = False
    flight.run(dead_s)
    flight.start_bridge()
    flight.is_alive, flight.pauses, flight.sent = True, 0, []
    return flight.until_state(State.TAKEN_OVER, 2.0)


def test_a_bridge_that_starts_beside_a_flying_vehicle_lets_it_hover():
    flight = restarted("ardupilot", 3.0)
    assert flight.machine.reason == "bridge started in flight; mode GUIDED; resume or land it"
    assert flight.pauses == 1  # of the mission
    flight.run(30.0)
    assert flight.state is State.TAKEN_OVER and flight.vehicle.mode == 4
    assert flight.speed_mps < 0.02 and flight.height_m == pytest.approx(1.2, abs=0.05)
    assert flight.setpoints_since(0.0) == [] and flight.orders() == []
    assert flight.machine.resume(flight.now_s).is_accepted
    flight.until_state(State.FLYING, 2.0)
    flight.run(3.0)
    assert flight.speed_mps > 0.3


def test_a_bridge_that_starts_beside_a_landing_vehicle_lets_it_land():
    """PX4's failsafe has changed the mode, which is nobody's business but its pilot's."""
    flight = restarted("px4", 3.0)
    assert "bridge started in flight; mode AUTO.L" in flight.machine.reason
    assert flight.run(20.0, lambda: not flight.vehicle.armed)
    assert flight.setpoints_since(0.0) == [] and flight.orders() == []


def test_a_resumption_does_not_cancel_somebodys_take_off():
    """ArduPilot gives a take-off up at the first set-point, without a word."""
    flight = Flight().to_ready()
    vehicle = flight.vehicle
    for number, parameters in [(176, {"param2": 4.0}), (400, {"param1": 1.0}), (22, {})]:
        fields = {"param1": 0.0, "param2": 0.0, "param7": 1.2, **parameters}
        vehicle.receive("COMMAND_LONG", {"command": number, **fields})
    flight.until_state(State.TAKEN_OVER, 5.0)
    start_s = flight.now_s
    assert flight.machine.resume(flight.now_s).is_accepted
    assert flight.run(5.0, lambda: vehicle.landed == 2)
    assert flight.setpoints_since(start_s) == []
    flight.until_state(State.HOLDING, 1.0)
    flight.run(1.0)
    assert flight.height_m > 1.1
