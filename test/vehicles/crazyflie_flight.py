"""A bridge and a stand-in for a Crazyflie, which exchange values on a virtual clock."""

from __future__ import annotations

import math

from vehicles.bodies import Bodies
from vehicles.crazyflie import AIRFRAME, Crazyflie, LogBlocks
from vehicles.stand_in import advance
from vehicles.virtual_flight import STARTS

from quad_nav.geometry import Twist2D
from quad_nav.sim.simulation_params import STEP_S
from quad_nav.topics.vehicle_states import State
from quad_vehicles.crazyflie_adapter import TRAITS, CrazyflieAdapter
from quad_vehicles.orders import Permissions
from quad_vehicles.states import VehicleMachine
from quad_vehicles.telemetry import Limits
from quad_vehicles.vehicle_file import Lidar, Vehicle

MAY_ARM, AHEAD = Permissions(may_arm=True), Twist2D(0.3, 0.0, 0.0)
STEPS = 2  # of the simulation, between two ticks of the bridge


class CrazyflieFlight:
    """A bridge and a Crazyflie, which exchange values without delay."""

    def __init__(self, permissions=MAY_ARM, bodies=None, robot=0, **keywords):
        limits = Limits(speed_mps=0.7)
        vehicle = Vehicle(0, "crazyflie", limits=limits, lidar=Lidar(is_multiranger=True))
        self.machine = VehicleMachine(vehicle.altitude_m, limits, TRAITS, permissions)
        self.adapter = CrazyflieAdapter(vehicle, self.machine)
        self.bodies = bodies or Bodies(airframes=[AIRFRAME])
        self.crazyflie = Crazyflie(self.bodies, robot, **keywords)
        self.hears = self.is_heard = True
        self.command, self.calls, self.news = None, [], []
        self._log = LogBlocks(self.crazyflie)
        self._next_command_s = 0.0
        self.adapter.connected(self.crazyflie.parameters)

    @property
    def now_s(self):
        return 100.0 + self.bodies.now_s

    @property
    def state(self):
        return self.machine.state

    def run(self, seconds, until=None):
        """Fly; return whether `until` became true."""
        for _ in range(round(seconds / (STEPS * STEP_S))):
            self._step()
            if until is not None and until():
                return True
        return until is None

    def _step(self):
        advance(self.bodies, [self.crazyflie], STEPS * STEP_S)
        self._exchange()

    def _exchange(self):
        now_s, calls = self.now_s, []
        for block, stamp_ms, values in self._log.due(now_s):
            if self.hears:
                self.adapter.receive(block, stamp_ms, values, now_s)
        if self.command is not None and now_s >= self._next_command_s:
            self._next_command_s = now_s + 0.1
            calls += self.adapter.follow(self.command, now_s)[1]
        output, more = self.adapter.tick(now_s)
        self.news += output.news
        for name, arguments in calls + more:
            self.calls.append(name)
            if self.is_heard:
                getattr(self.crazyflie, name)(*arguments)

    def to_hover(self):
        assert self.run(5.0, lambda: self.state is State.READY), self.machine.reason
        assert self.machine.take_off(self.now_s).is_accepted
        assert self.run(10.0, lambda: self.state is State.HOLDING), self.machine.reason
        return self

    def to_flight(self, command=AHEAD):
        self.to_hover().command = command
        self.run(2.0)
        assert self.state is State.FLYING
        return self


class CrazyfliePair(CrazyflieFlight):
    """The same beside a Crazyflie with a bridge of its own, which hovers.

    Attributes:
        neighbour: Its flight.
        neighbour_moved_m: How far it has been from where it was at the last `mark`.
    """

    def __init__(self):
        bodies = Bodies(starts=STARTS, airframes=[AIRFRAME] * 2)
        super().__init__(bodies=bodies)
        self.neighbour = CrazyflieFlight(bodies=bodies, robot=1)
        self.neighbour.command = Twist2D()
        self.mark()

    def _step(self):
        advance(self.bodies, [self.crazyflie, self.neighbour.crazyflie], STEPS * STEP_S)
        self._exchange()
        self.neighbour._exchange()
        moved_m = math.dist(self.bodies.place(1), self._marked)
        self.neighbour_moved_m = max(self.neighbour_moved_m, moved_m)

    def mark(self):
        """Measure from here on how far the neighbour moves."""
        self._marked, self.neighbour_moved_m = self.bodies.place(1), 0.0

    def to_hover(self):
        neighbour = self.neighbour
        assert self.run(5.0, lambda: neighbour.state is State.READY), neighbour.machine.reason
        assert neighbour.machine.take_off(self.now_s).is_accepted
        assert self.run(10.0, lambda: neighbour.state is State.FLYING), neighbour.machine.reason
        self.run(2.0)  # the height settles
        return super().to_hover()
