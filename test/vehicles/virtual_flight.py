"""A bridge and a vehicle that exchange messages on a virtual clock."""

from __future__ import annotations

import math
from types import SimpleNamespace

from vehicles.point_vehicle import ARDUPILOT, PX4, PointVehicle

from quad_nav.geometry import Twist2D
from quad_nav.vehicle.autopilots import AUTOPILOTS
from quad_nav.vehicle.mavlink_adapter import MavlinkAdapter
from quad_nav.vehicle.orders import Permissions, State
from quad_nav.vehicle.states import VehicleMachine
from quad_nav.vehicle.telemetry import Limits
from quad_nav.vehicle.vehicle_file import Vehicle

STEP_S = 0.01
MAY_ARM, AHEAD = Permissions(may_arm=True), Twist2D(0.5, 0.0, 0.0)
KINDS = {"ardupilot": ARDUPILOT, "px4": PX4}


class Flight:
    """A bridge and a vehicle, which exchange messages without delay."""

    def __init__(self, autopilot="ardupilot", permissions=MAY_ARM, **limits):
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

    def to_flight(self, command=AHEAD):
        self.to_hover()
        self.command = command
        self.run(3.0)
        assert self.state is State.FLYING
        return self

    def setpoints_since(self, start_s):
        name = "SET_POSITION_TARGET_LOCAL_NED"
        return [fields for at_s, sent, fields in self.sent if sent == name and at_s >= start_s]
