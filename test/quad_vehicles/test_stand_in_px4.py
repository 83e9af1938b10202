"""The stand-in for PX4 behaves as PX4's documentation says, and the bridge copes with it."""

from __future__ import annotations

import struct

import pytest
from vehicles import failures
from vehicles.bodies import Bodies
from vehicles.px4 import AIRFRAME, HOLD, INT32, LAND, OFFBOARD, REJECTED, Px4
from vehicles.stand_in import ACCEPTED, IN_AIR, ON_GROUND
from vehicles.virtual_flight import StandInFlight

from quad_nav.topics.vehicle_states import State


class Desk:
    """A stand-in, and the messages that have come from it."""

    def __init__(self, **parameters):
        self.bodies = Bodies(airframes=[AIRFRAME])
        self.vehicle = Px4(self.bodies, parameters=parameters)
        self.got = []

    def run(self, seconds):
        self.got += self.vehicle.advance(seconds)
        return self

    def command(self, number, **parameters):
        """Send a command; return its result and the texts that came with it."""
        self.got.clear()
        self.vehicle.receive("COMMAND_LONG", {"command": number, **parameters})
        self.run(0.05)
        (result,) = [fields["result"] for name, fields in self.got if name == "COMMAND_ACK"]
        texts = [fields["text"] for name, fields in self.got if name == "STATUSTEXT"]
        assert all(text.endswith("\t") for text in texts)
        return result, [text.rstrip() for text in texts]

    def stream(self, seconds, hz=20.0, **velocity):
        """Send set-points."""
        fields = {"coordinate_frame": 8, "type_mask": 1479, "vx": 0.0, "vy": 0.0, "vz": 0.0}
        fields = {**fields, "yaw_rate": 0.0, **velocity}
        for _ in range(round(seconds * hz)):
            self.vehicle.receive("SET_POSITION_TARGET_LOCAL_NED", fields)
            self.run(1.0 / hz)
        return self

    def offboard(self):
        return self.command(176, param1=1, param2=6)

    def to_hover(self):
        self.stream(1.2)
        assert self.offboard()[0] == self.command(400, param1=1)[0] == ACCEPTED
        return self.stream(6.0, vz=-0.5).stream(2.0)


@pytest.fixture
def desk():
    desk = Desk(COM_OBL_RC_ACT=4.0)
    yield desk
    desk.bodies.close()


@pytest.mark.parametrize("seconds, hz", [(0.5, 20.0), (5.0, 1.5)])
def test_arms_in_offboard_only_with_a_stream(desk, seconds, hz):
    assert desk.offboard() == (ACCEPTED, [])  # on the ground any mode is
    desk.stream(seconds, hz)
    result, texts = desk.command(400, param1=1)
    assert result == REJECTED
    assert texts[-1] == "Arming denied: Resolve system health failures first"
    desk.stream(1.1)
    assert desk.command(400, param1=1)[0] == ACCEPTED


def test_takes_off_by_set_points(desk):
    desk.to_hover()
    assert desk.vehicle.landed == IN_AIR and 1.5 < desk.vehicle.height_m < 3.0


def test_refuses_offboard_in_flight_without_a_stream(desk):
    desk.to_hover()
    assert desk.command(176, param1=1, param2=4, param3=3)[0] == ACCEPTED
    desk.run(1.0)
    what = "Switching to Offboard is currently not available"
    assert desk.offboard() == (REJECTED, [what])
    assert desk.stream(1.2).offboard() == (ACCEPTED, [])


def test_holds_and_then_lands_when_the_stream_stops(desk):
    desk.to_hover()
    desk.stream(3.0, vx=0.5)
    assert desk.run(0.9).vehicle.mode == OFFBOARD
    assert desk.run(0.2).vehicle.mode == HOLD  # COM_OF_LOSS_T 1 s
    assert desk.run(2.0).vehicle.speed_mps < 0.03
    assert desk.run(2.8).vehicle.mode == HOLD
    assert desk.run(0.4).vehicle.mode == LAND  # COM_FAIL_ACT_T 5 s later
    desk.run(8.0)
    assert desk.vehicle.landed == ON_GROUND and not desk.vehicle.armed


def test_whole_numbers_travel_as_their_bits(desk):
    desk.vehicle.receive("PARAM_REQUEST_READ", {"param_id": "COM_OBL_RC_ACT"})
    (fields,) = [f for name, f in desk.run(0.05).got if name == "PARAM_VALUE"]
    assert fields["param_type"] == INT32
    assert struct.unpack("<i", struct.pack("<f", fields["param_value"])) == (4,)


def test_streams_some_messages_unasked(desk):
    names = [name for name, _ in desk.run(5.0).got]
    assert names.count("ATTITUDE") == pytest.approx(75, abs=2)
    assert names.count("LOCAL_POSITION_NED") == pytest.approx(5, abs=1)


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_the_bridge_passes_on_why_arming_was_refused(autopilot):
    flight = StandInFlight(autopilot)
    flight.vehicle.refuses_arming = "Compass not calibrated"
    flight.adapter.machine.inputs.take_text = lambda *_: None  # asks all the same
    assert flight.run(10.0, lambda: flight.state is State.READY)
    flight.machine.take_off(flight.now_s)
    assert flight.run(5.0, lambda: flight.state is State.NOT_READY)
    assert "Compass not calibrated" in flight.machine.refusal
    flight.end()


@pytest.mark.slow
@pytest.mark.parametrize("delay_s, loss_share", [(0.3, 0.0), (0.0, 0.2), (0.1, 0.15)])
@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_the_bridge_flies_over_a_bad_link(autopilot, delay_s, loss_share):
    flight = StandInFlight(autopilot, seed=5)
    vehicle = flight.vehicle
    vehicle.delay_up_s = vehicle.delay_down_s = delay_s
    vehicle.loss_share = loss_share
    flight.to_flight()
    flight.run(10.0)
    assert flight.state is State.FLYING and flight.speed_mps > 0.45
    flight.machine.land(flight.now_s, "asked")
    assert flight.run(15.0, lambda: flight.state is State.LANDED)
    flight.end()


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_somebody_resumes_after_the_pilot(autopilot):
    flight, _, _ = failures.fly_row(
        "the pilot changes the mode", autopilot, 1.0, make_flight=StandInFlight
    )
    flight.machine.resume(flight.now_s)
    assert flight.run(3.0, lambda: flight.state is State.FLYING), flight.news[-1]
    flight.run(3.0)
    assert flight.speed_mps > 0.3
    flight.end()


def test_the_bridge_orders_a_cancelled_take_off_again():
    flight = StandInFlight("ardupilot")
    assert flight.run(10.0, lambda: flight.state is State.READY)
    flight.machine.take_off(flight.now_s)
    assert flight.run(5.0, lambda: flight.state is State.TAKING_OFF)
    flight.run(1.0)
    foreign = {"coordinate_frame": 8, "type_mask": 1479, "vx": 0.0, "vy": 0.0, "vz": 0.0}
    flight.vehicle.receive("SET_POSITION_TARGET_LOCAL_NED", foreign, sender=(42, 1))
    start_s = flight.now_s
    assert flight.run(18.0, lambda: flight.state is State.HOLDING)
    assert 7.0 < flight.now_s - start_s < 15.0
    flight.end()


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
@pytest.mark.parametrize("row", failures.STAND_IN_ROWS)
def test_failure_on_the_stand_in(row, autopilot):
    flight, _, _ = failures.fly_row(row, autopilot, 1.3, make_flight=StandInFlight, seed=5)
    flight.end()
