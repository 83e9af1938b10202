"""A bridge and a stand-in for a Crazyflie, which exchange values on a virtual clock."""

from __future__ import annotations

from vehicles.crazyflie import LogBlocks, alone
from vehicles.stand_in import advance

from quad_nav.geometry import Twist2D
from quad_nav.sim.simulation import STEP_S
from quad_nav.vehicle.crazyflie_adapter import TRAITS, CrazyflieAdapter
from quad_nav.vehicle.orders import Permissions, State
from quad_nav.vehicle.states import VehicleMachine
from quad_nav.vehicle.telemetry import Limits
from quad_nav.vehicle.vehicle_file import Lidar, Vehicle

MAY_ARM, AHEAD = Permissions(may_arm=True), Twist2D(0.3, 0.0, 0.0)
STEPS = 2  # of the simulation, between two ticks of the bridge


class CrazyflieFlight:
    """A bridge and a Crazyflie, which exchange values without delay."""

    def __init__(self, permissions=MAY_ARM, **keywords):
        limits = Limits(speed_mps=0.7)
        vehicle = Vehicle(0, "crazyflie", limits=limits, lidar=Lidar(is_multiranger=True))
        self.machine = VehicleMachine(vehicle.altitude_m, limits, TRAITS, permissions)
        self.adapter = CrazyflieAdapter(vehicle, self.machine)
        self.bodies, self.crazyflie = alone(**keywords)
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
