"""A bridge and a vehicle that exchange messages on a virtual clock."""

from __future__ import annotations

import math
from types import SimpleNamespace

from vehicles.ardupilot import ArduPilot
from vehicles.bodies import AIRFRAME as BARE_ARDUPILOT
from vehicles.bodies import Bodies
from vehicles.estimator import LocalFrame
from vehicles.point_vehicle import ARDUPILOT, PX4, PointVehicle
from vehicles.px4 import AIRFRAME as BARE_PX4
from vehicles.px4 import Px4
from vehicles.stand_in import advance

from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.sim.simulation_params import STEP_S as STEP
from quad_nav.topics.vehicle_states import State
from quad_vehicles.autopilots import AUTOPILOTS
from quad_vehicles.mavlink_adapter import MavlinkAdapter
from quad_vehicles.orders import Permissions
from quad_vehicles.states import VehicleMachine
from quad_vehicles.telemetry import Limits
from quad_vehicles.vehicle_file import OUR_SYSTEM, Vehicle

STEP_S = 0.01
MAY_ARM, AHEAD = Permissions(may_arm=True), Twist2D(0.5, 0.0, 0.0)
SAFE_ARDUPILOT = {
    "FS_GCS_ENABLE": 5.0,
    "FS_THR_ENABLE": 3.0,
    "SYSID_MYGCS": float(OUR_SYSTEM),
    "BATT_FS_LOW_ACT": 1.0,
}
SAFE_PX4 = {
    "COM_OBL_RC_ACT": 4.0,
    "NAV_DLL_ACT": 3.0,
    "NAV_RCL_ACT": 3.0,
    "COM_LOW_BAT_ACT": 2.0,
}
STAND_INS = {"ardupilot": (ArduPilot, SAFE_ARDUPILOT), "px4": (Px4, SAFE_PX4)}
GROUND_STATION = (255, 190)
STATION_HEARTBEAT = {"type": 6, "autopilot": 8, "system_status": 4}
AIRFRAMES = {"ardupilot": BARE_ARDUPILOT, "px4": BARE_PX4}
STARTS = (Pose2D(200.0, 200.0, 0.0), Pose2D(200.0, 195.0, 0.0))
KINDS = {"ardupilot": ARDUPILOT, "px4": PX4}


class Flight:
    """A bridge and a vehicle, which exchange messages; those of the point have no delay."""

    step_s = STEP_S

    def __init__(self, autopilot="ardupilot", permissions=MAY_ARM, seed=0, **limits):
        self.vehicle = self.make_vehicle(autopilot, seed)
        limits = Limits(**{"speed_mps": 1.0, **limits})
        self._vehicle = Vehicle(0, "mavlink", autopilot, altitude_m=1.2, limits=limits)
        self._permissions = permissions
        self.start_bridge()
        self.now_s = 100.0
        self.sent = []  # (time, name, fields)
        self.news, self.states, self.pauses = [], [], 0
        self.hears = self.is_heard = self.is_alive = True
        self.command = None  # Twist2D of each 50 ms
        self._next_command_s = 0.0

    def start_bridge(self):
        """Start the bridge; a second time after it has died, which knows nothing."""
        traits = AUTOPILOTS[self._vehicle.autopilot].traits
        self.machine = VehicleMachine(1.2, self._vehicle.limits, traits, self._permissions)
        self.adapter = MavlinkAdapter(self._vehicle, self.machine)

    def make_vehicle(self, autopilot, seed):
        return PointVehicle(KINDS[autopilot], heading_rad=0.6, boot_s=40.0)

    def run(self, seconds, until=None):
        """Fly; return whether `until` became true."""
        end_s = self.now_s + seconds - 1e-9
        while self.now_s < end_s:
            self._step()
            if until is not None and until():
                return True
        return until is None

    def _step(self):
        self._exchange(self.now_s + self.step_s, self.vehicle.advance(self.step_s))

    def _exchange(self, now_s, messages):
        self.now_s = now_s
        for name, fields in messages:
            if self.hears:
                self.adapter.receive(name, 1, SimpleNamespace(**{"id": 0, **fields}), self.now_s)
        if self.is_alive:
            self._tick()

    def _tick(self):
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
                self._deliver(name, fields)

    def _deliver(self, name, fields):
        self.vehicle.receive(name, fields)

    @property
    def state(self):
        return self.machine.state

    @property
    def height_m(self):
        return self.vehicle.height_m

    @property
    def speed_mps(self):
        return self.vehicle.speed_mps

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

    def end(self):
        """Free what the vehicle has."""

    def setpoints_since(self, start_s):
        name = "SET_POSITION_TARGET_LOCAL_NED"
        return [fields for at_s, sent, fields in self.sent if sent == name and at_s >= start_s]


class StandInFlight(Flight):
    """The same with a simulated body and a stand-in that behaves as the recorded autopilot.

    Its pilot has set the failsafes that the bridge asks for.

    Attributes:
        has_station: Whether a ground station is connected beside the bridge.
    """

    step_s, has_station = 2.0 * STEP, False

    def __init__(
        self, autopilot="ardupilot", permissions=MAY_ARM, seed=0, bodies=None, robot=0, **limits
    ):
        self.bodies = bodies or Bodies(airframes=[AIRFRAMES[autopilot]])
        self._robot = robot
        super().__init__(autopilot, permissions, seed, **limits)

    def make_vehicle(self, autopilot, seed):
        stand_in, safe = STAND_INS[autopilot]
        frame = LocalFrame(3.0, -2.0, 0.6)
        return stand_in(self.bodies, self._robot, frame, seed, 60.0 + seed % 7, safe)

    def _deliver(self, name, fields):
        self.vehicle.receive(name, fields, (OUR_SYSTEM, 191))

    def _exchange(self, now_s, messages):
        if self.has_station and int(now_s) > int(self.now_s):
            self.vehicle.receive("HEARTBEAT", STATION_HEARTBEAT, GROUND_STATION)
        super()._exchange(now_s, messages)

    def end(self):
        self.bodies.close()


class PairFlight(StandInFlight):
    """The same beside a vehicle of the same kind with a bridge of its own, which hovers.

    Attributes:
        neighbour: Its flight.
        neighbour_moved_m: How far it has been from where it was at the last `mark`.
    """

    def __init__(self, autopilot="ardupilot", permissions=MAY_ARM, seed=0, **limits):
        bodies = Bodies(starts=STARTS, airframes=[AIRFRAMES[autopilot]] * 2)
        super().__init__(autopilot, permissions, seed, bodies, **limits)
        self.neighbour = StandInFlight(autopilot, permissions, seed + 1000, bodies, 1, **limits)
        self.neighbour.command = Twist2D()
        self.mark()

    def _step(self):
        advance(self.bodies, [self.vehicle, self.neighbour.vehicle], self.step_s)
        now_s = self.now_s + self.step_s
        self._exchange(now_s, self.vehicle.messages())
        self.neighbour._exchange(now_s, self.neighbour.vehicle.messages())
        moved_m = math.dist(self.bodies.place(1), self._marked)
        self.neighbour_moved_m = max(self.neighbour_moved_m, moved_m)

    def mark(self):
        """Measure from here on how far the neighbour moves."""
        self._marked, self.neighbour_moved_m = self.bodies.place(1), 0.0

    def neighbour_to_hover(self):
        neighbour = self.neighbour
        assert self.run(10.0, lambda: neighbour.state is State.READY), neighbour.machine.reason
        assert neighbour.machine.take_off(self.now_s).is_accepted
        assert self.run(20.0, lambda: neighbour.state is State.FLYING), neighbour.machine.reason
        self.run(2.0)  # the height settles

    def to_hover(self):
        self.neighbour_to_hover()
        return super().to_hover()
