"""A bridge and a stand-in vehicle that exchange messages on a virtual clock."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace

from vehicles.ardupilot import ArduPilot
from vehicles.bodies import AIRFRAME as BARE_ARDUPILOT
from vehicles.bodies import Bodies
from vehicles.crazyflie import AIRFRAME as CRAZYFLIE
from vehicles.crazyflie import Crazyflie, LogBlocks
from vehicles.estimator import LocalFrame
from vehicles.point_bodies import PointBodies
from vehicles.px4 import AIRFRAME as BARE_PX4
from vehicles.px4 import Px4
from vehicles.stand_in import advance

from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.sim.simulation_params import STEP_S as SIMULATION_STEP_S
from quad_nav.topics.vehicle_states import State
from quad_vehicles.autopilots import AUTOPILOTS
from quad_vehicles.crazyflie_adapter import TRAITS, CrazyflieAdapter
from quad_vehicles.localizers import name_of
from quad_vehicles.mavlink_adapter import MavlinkAdapter
from quad_vehicles.orders import Permissions
from quad_vehicles.states import VehicleMachine
from quad_vehicles.telemetry import Limits
from quad_vehicles.vehicle_file import FIXED, OUR_SYSTEM, Lidar, Vehicle

STEP_S = 2.0 * SIMULATION_STEP_S
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
AIRFRAMES = {"ardupilot": BARE_ARDUPILOT, "px4": BARE_PX4, "crazyflie": CRAZYFLIE}
GROUND_STATION = (255, 190)
STATION_HEARTBEAT = {"type": 6, "autopilot": 8, "system_status": 4}
STARTS = (Pose2D(200.0, 200.0, 0.0), Pose2D(200.0, 195.0, 0.0))
HEADING_RAD = 0.6
FRAME = LocalFrame(3.0, -2.0, HEADING_RAD)


def vehicle_of(autopilot, **limits):
    """Return the file's entry of a vehicle with usual values."""
    if autopilot == "crazyflie":
        lidar = Lidar(is_multiranger=True)
        limits = {"speed_mps": 0.7, **limits}
        return Vehicle(0, "crazyflie", limits=Limits(**limits), lidar=lidar)
    limits = {"speed_mps": 1.0, **limits}
    return Vehicle(0, "mavlink", autopilot, altitude_m=1.2, limits=Limits(**limits))


class Bridge:
    """The bridge of one vehicle, its stand-in, and MAVLink's messages between them.

    The pilot of the stand-in has set the failsafes that the bridge asks for.
    """

    def __init__(self, file, bodies, robot=0, seed=0, permissions=MAY_ARM, frame=FRAME):
        self._file, self._permissions = file, permissions
        self.vehicle = self.make_vehicle(bodies, robot, seed, frame)
        self.start()

    def make_vehicle(self, bodies, robot, seed, frame):
        stand_in, safe = STAND_INS[self._file.autopilot]
        return stand_in(bodies, robot, frame, seed, 60.0 + seed % 7, safe)

    def start(self):
        """Start the bridge; a second time after it has died, which knows nothing."""
        file = self._file
        traits = AUTOPILOTS[file.autopilot].traits if file.kind == "mavlink" else TRAITS
        self.machine = VehicleMachine(
            file.altitude_m, file.limits, traits, self._permissions, name_of(file)
        )
        self.adapter = self.make_adapter(file)

    def make_adapter(self, file):
        return MavlinkAdapter(file, self.machine)

    def receive(self, now_s, hears=True):
        """Let what the vehicle has sent come, or get lost."""
        for name, fields in self.vehicle.messages():
            if hears:
                self.adapter.receive(name, 1, SimpleNamespace(**{"id": 0, **fields}), now_s)

    def deliver(self, name, fields):
        """Let the vehicle get what the bridge has sent."""
        self.vehicle.receive(name, fields, (OUR_SYSTEM, 191))


class CrazyflieBridge(Bridge):
    """The same with a Crazyflie's log blocks and set-points."""

    def make_vehicle(self, bodies, robot, seed, frame):
        return self.log_of(Crazyflie(bodies, robot))

    def log_of(self, vehicle):
        self._log = LogBlocks(vehicle)
        return vehicle

    def make_adapter(self, file):
        adapter = CrazyflieAdapter(file, self.machine)
        adapter.connected(self.vehicle.parameters)
        return adapter

    def receive(self, now_s, hears=True):
        for block, stamp_ms, values in self._log.due(now_s):
            if hears:
                self.adapter.receive(block, stamp_ms, values, now_s)

    def deliver(self, name, fields):
        getattr(self.vehicle, name)(*fields)


def bridge_of(file, *arguments, **options):
    """Return the bridge of a vehicle of any kind."""
    return (CrazyflieBridge if file.kind == "crazyflie" else Bridge)(file, *arguments, **options)


class Flight:
    """One flight; by default the body is a point, which is quick.

    Attributes:
        hears: Whether the bridge hears the vehicle.
        is_heard: Whether the vehicle hears the bridge.
        is_alive: Whether the bridge works.
        has_station: Whether a ground station is connected beside it.
        command: Twist2D that comes every 50 ms; None for none.
        map_from_odom: What a localization says at every tick; None while it says nothing.
        sent: What the bridge has sent: (time, name, fields).
    """

    def __init__(
        self,
        autopilot="ardupilot",
        permissions=MAY_ARM,
        seed=0,
        bodies=None,
        robot=0,
        localization=FIXED,
        **limits,
    ):
        self.autopilot, self.bodies = autopilot, bodies or PointBodies()
        file = replace(vehicle_of(autopilot, **limits), localization=localization)
        self.map_from_odom = None
        self._bridge = bridge_of(file, self.bodies, robot, seed, permissions)
        self.vehicle = self._bridge.vehicle
        self._vehicles = [self.vehicle]
        self.now_s, self.sent, self.command, self._next_command_s = 100.0, [], None, 0.0
        self.news, self.states, self.pauses = [], [], 0
        self.hears = self.is_heard = self.is_alive = True
        self.has_station = False

    def start_bridge(self):
        self._bridge.start()

    @property
    def machine(self):
        return self._bridge.machine

    @property
    def adapter(self):
        return self._bridge.adapter

    @property
    def state(self):
        return self.machine.state

    @property
    def height_m(self):
        return self.vehicle.height_m

    @property
    def speed_mps(self):
        return self.vehicle.speed_mps

    def run(self, seconds, until=None):
        """Fly; return whether `until` became true."""
        end_s = self.now_s + seconds - 1e-9
        while self.now_s < end_s:
            self._step()
            if until is not None and until():
                return True
        return until is None

    def until_state(self, state, seconds):
        """Fly to a state.

        Raises:
            AssertionError: The vehicle is in another one after a time.
        """
        reached = self.run(seconds, lambda: self.state is state)
        assert reached, (self.state, self.machine.reason, self.news[-2:])
        return self

    def _step(self):
        advance(self.bodies, self._vehicles, STEP_S)
        self._exchange(self.now_s + STEP_S)

    def _exchange(self, now_s):
        if self.has_station and int(now_s) > int(self.now_s):
            self.vehicle.receive("HEARTBEAT", STATION_HEARTBEAT, GROUND_STATION)
        self.now_s = now_s
        self._bridge.receive(now_s, self.hears)
        if self.is_alive:
            self._tick()

    def _tick(self):
        messages = []
        if self.map_from_odom is not None:
            self.machine.inputs.take_frame(self.map_from_odom, self.now_s)
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
                self._bridge.deliver(name, fields)

    def to_ready(self):
        return self.until_state(State.READY, 10.0)

    def to_hover(self):
        self.to_ready()
        assert self.machine.take_off(self.now_s).is_accepted
        return self.until_state(State.HOLDING, 20.0)

    def to_flight(self, command=AHEAD):
        self.to_hover().command = command
        self.run(3.0)
        assert self.state is State.FLYING
        return self

    def setpoints_since(self, start_s):
        names = ("SET_POSITION_TARGET_LOCAL_NED", "hover")
        return [fields for at_s, sent, fields in self.sent if sent in names and at_s >= start_s]

    def orders(self):
        """Return the numbers of the commands that the bridge has sent, without those for rates."""
        sent = [fields["command"] for _, name, fields in self.sent if name == "COMMAND_LONG"]
        return [number for number in sent if number != 511]


class PairFlight(Flight):
    """A flight with a simulated body, beside a vehicle with a bridge of its own, which hovers.

    Attributes:
        neighbour: Its flight.
        neighbour_moved_m: How far it has been from where it was at the last `mark`.
    """

    def __init__(self, autopilot="ardupilot", seed=0):
        bodies = Bodies(starts=STARTS, airframes=[AIRFRAMES[autopilot]] * 2)
        super().__init__(autopilot, seed=seed, bodies=bodies)
        self.neighbour = Flight(autopilot, seed=seed + 1000, bodies=bodies, robot=1)
        self.neighbour.command = Twist2D()
        self._vehicles.append(self.neighbour.vehicle)
        self.mark()

    def _step(self):
        super()._step()
        self.neighbour._exchange(self.now_s)
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
