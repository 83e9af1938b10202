"""The bridge with a vehicle at the other end of its messages, on a virtual clock."""

from __future__ import annotations

import math
from types import SimpleNamespace

import pytest
from vehicles.point_vehicle import ARDUPILOT, PX4, PointVehicle

from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.vehicle.autopilots import AUTOPILOTS
from quad_nav.vehicle.mavlink_adapter import MavlinkAdapter
from quad_nav.vehicle.orders import Permissions, State
from quad_nav.vehicle.states import VehicleMachine
from quad_nav.vehicle.telemetry import Limits
from quad_nav.vehicle.vehicle_file import Vehicle

STEP_S = 0.01
KINDS = {"ardupilot": ARDUPILOT, "px4": PX4}


class Flight:
    """A bridge and a vehicle, which exchange messages without delay."""

    def __init__(self, autopilot="ardupilot", permissions=Permissions(may_arm=True), **limits):
        self.vehicle = PointVehicle(KINDS[autopilot], heading_rad=0.6, boot_s=40.0)
        limits = Limits(**{"speed_mps": 1.0, **limits})
        self.machine = VehicleMachine(1.2, limits, AUTOPILOTS[autopilot].traits, permissions)
        self.adapter = MavlinkAdapter(
            Vehicle(0, "mavlink", autopilot, altitude_m=1.2, limits=limits), self.machine
        )
        self.now_s = 100.0
        self.sent = []  # (time, name, fields)
        self.news, self.states, self.pauses = [], [], 0
        self.hears = self.is_heard = True
        self.command = None  # Twist2D of each 50 ms
        self._next_command_s = 0.0

    def run(self, seconds, until=None):
        """Fly; return whether `until` became true."""
        end_s = self.now_s + seconds - 1e-9
        while self.now_s < end_s:
            self._step()
            if until is not None and until():
                return True
        return until is None

    def _step(self):
        self.now_s += STEP_S
        for name, fields in self.vehicle.advance(STEP_S):
            if self.hears:
                message = SimpleNamespace(id=0, **fields) if name == "STATUSTEXT" else None
                self.adapter.receive(name, 1, message or SimpleNamespace(**fields), self.now_s)
        messages = []
        if self.command is not None and self.now_s >= self._next_command_s:
            self._next_command_s = self.now_s + 0.05
            messages += self.adapter.follow(self.command, self.now_s)[1]
        output, more = self.adapter.tick(self.now_s)
        self.news += [(self.now_s, line) for line in output.news]
        self.pauses += output.pauses_mission
        if not self.states or self.states[-1] is not self.state:
            self.states.append(self.state)
        for name, fields in messages + more:
            self.sent.append((self.now_s, name, fields))
            if self.is_heard:
                self.vehicle.receive(name, fields)

    @property
    def state(self):
        return self.machine.state

    @property
    def height_m(self):
        return -self.vehicle.position[2]

    @property
    def speed_mps(self):
        return math.hypot(*self.vehicle.velocity[:2])

    def to_hover(self):
        assert self.run(10.0, lambda: self.state is State.READY), (self.state, self.machine.reason)
        assert self.machine.take_off(self.now_s).is_accepted
        assert self.run(20.0, lambda: self.state is State.HOLDING), (
            self.state,
            self.machine.reason,
        )
        return self

    def to_flight(self, command=Twist2D(0.5, 0.0, 0.0)):
        self.to_hover()
        self.command = command
        self.run(3.0)
        assert self.state is State.FLYING
        return self

    def setpoints_since(self, start_s):
        name = "SET_POSITION_TARGET_LOCAL_NED"
        return [fields for at_s, sent, fields in self.sent if sent == name and at_s >= start_s]


@pytest.fixture(params=["ardupilot", "px4"])
def autopilot(request):
    return request.param


def test_from_no_link_to_a_hover_at_the_altitude(autopilot):
    flight = Flight(autopilot).to_hover()
    assert flight.states == [
        State.NOT_READY,
        State.READY,
        State.ARMING,
        State.TAKING_OFF,
        State.HOLDING,
    ]
    flight.command = Twist2D()
    flight.run(6.0)
    assert flight.height_m == pytest.approx(1.2, abs=0.02)


def test_no_set_point_before_ardupilot_is_in_the_air():
    flight = Flight().to_hover()
    in_air_s = next(at_s for at_s, line in flight.news if line.startswith("holding"))
    assert flight.setpoints_since(0.0) == flight.setpoints_since(in_air_s)


def test_a_command_flies_the_way_that_ros_means(autopilot):
    flight = Flight(autopilot).to_flight(Twist2D(0.3, 0.2, 0.0))
    start = Pose2D(flight.vehicle.position[1], flight.vehicle.position[0], math.pi / 2 - 0.6)
    flight.run(2.0)
    x_m, y_m = start.inverse_transform(flight.vehicle.position[1], flight.vehicle.position[0])
    assert (x_m, y_m) == (pytest.approx(0.6, abs=0.01), pytest.approx(0.4, abs=0.01))
    odometry = flight.adapter.estimate
    assert odometry.linear_mps == pytest.approx((0.3, 0.2, 0.0), abs=0.02)


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
    assert flight.run(15.0, lambda: flight.state is State.LANDED)
    assert not flight.vehicle.armed and flight.height_m < 0.02
    assert flight.setpoints_since(start_s) == []
    flight.command = None
    flight.run(1.0)
    assert flight.machine.take_off(flight.now_s).is_accepted  # again
    assert flight.run(20.0, lambda: flight.state is State.HOLDING)
