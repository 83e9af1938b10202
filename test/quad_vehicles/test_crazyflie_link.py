"""cflib itself and the bridge, with a stand-in at the other end of a TCP connection."""

from __future__ import annotations

import threading
import time

import pytest

pytest.importorskip("cflib", reason="the Crazyflie's library needs Python 3.10")

from vehicles.bodies import Bodies, warm_up  # noqa: E402
from vehicles.crazyflie import AIRFRAME, Crazyflie  # noqa: E402
from vehicles.crazyflie_server import Server, fly  # noqa: E402

from quad_nav.geometry import Twist2D  # noqa: E402
from quad_nav.topics.vehicle_states import State  # noqa: E402
from quad_vehicles import crazyflie_link  # noqa: E402
from quad_vehicles.crazyflie_adapter import TRAITS  # noqa: E402
from quad_vehicles.orders import Permissions  # noqa: E402
from quad_vehicles.states import VehicleMachine  # noqa: E402
from quad_vehicles.telemetry import Limits  # noqa: E402
from quad_vehicles.vehicle_file import Lidar, Vehicle  # noqa: E402

PATIENCE_S = 60.0
TICK_S = 0.025


class Desk:
    """A Crazyflie behind a port, and its bridge."""

    def __init__(self):
        warm_up()
        self.bodies = Bodies(airframes=[AIRFRAME])
        self.crazyflie = Crazyflie(self.bodies)
        self.server = Server(0, self.crazyflie)
        self.is_over = False
        self._thread = threading.Thread(target=self._serve)
        self._thread.start()
        vehicle = Vehicle(
            0,
            "crazyflie",
            address=f"tcp://127.0.0.1:{self.server.port}",
            altitude_m=0.5,
            limits=Limits(climb_mps=0.5),
            lidar=Lidar(is_multiranger=True),
        )
        machine = VehicleMachine(0.5, vehicle.limits, TRAITS, Permissions(may_arm=True))
        self.link = crazyflie_link.CrazyflieLink(vehicle, machine, time.monotonic)
        self.command = None

    def _serve(self):
        fly(self.bodies, [self.server], [self.crazyflie], lambda: self.is_over)

    def until(self, condition):
        end_s = time.monotonic() + PATIENCE_S
        while not condition():
            machine = self.link.machine
            assert time.monotonic() < end_s, (machine.state, machine.reason)
            self.link.read(TICK_S)
            if self.command is not None:
                self.link.follow(self.command)
            self.link.tick()

    def until_state(self, state):
        self.until(lambda: self.link.machine.state is state)

    def close(self):
        self.link.close()
        self.is_over = True
        self._thread.join(PATIENCE_S)
        self.server.close()
        self.bodies.close()


@pytest.fixture
def desk(tmp_path, monkeypatch):
    monkeypatch.setattr(crazyflie_link, "CACHE", str(tmp_path))
    made = Desk()
    yield made
    made.close()


def test_a_flight_through_cflib(desk):
    desk.until_state(State.READY)
    assert desk.link.machine.take_off(time.monotonic()).is_accepted
    desk.until_state(State.HOLDING)
    assert desk.crazyflie.height_m == pytest.approx(0.5, abs=0.16)
    desk.command = Twist2D(0.2, 0.1, 0.4)
    desk.until(lambda: desk.link.estimate.odom_from_base.yaw_rad > 0.4)
    flown = pytest.approx((0.2, 0.1, 22.9183), abs=1e-3)
    desk.until(lambda: desk.crazyflie.setpoints[-1][1:4] == flown)
    desk.until(lambda: desk.link.estimate.linear_mps[0] == pytest.approx(0.2, abs=0.05))
    assert desk.link.scan.ranges_m[2] == pytest.approx(0.8)
    age_s = time.monotonic() - desk.link.estimate.stamp_s
    assert 0.0 <= age_s < 5.0
    desk.command = None
    desk.link.machine.land(time.monotonic(), "asked to land")
    desk.until_state(State.LANDED)
    desk.until(lambda: not desk.crazyflie.is_running)


def test_a_connection_that_ends_is_opened_again(desk):
    desk.until_state(State.READY)
    desk.server.drop()
    desk.until_state(State.NO_LINK)
    desk.until_state(State.READY)
    assert any("no connection" in text for _, text in desk.link.pop_texts())


def test_no_event_and_no_reason_of_the_library_ends_the_bridge(desk):
    desk.until_state(State.READY)
    desk.link.pop_texts()
    desk.link._events.put(lambda: {}["odd"])
    desk.link._events.put(lambda: desk.link._lost(" "))
    desk.until(lambda: not desk.link._is_ready)
    told = [text for _, text in desk.link.pop_texts()]
    assert "an event of the radio: KeyError: 'odd'; dropped" in told
    assert "no connection: no reason" in told
    desk.until(lambda: desk.link._is_ready)


def test_no_error_of_sending_ends_the_bridge(desk):
    desk.until_state(State.READY)

    def fail(*_):
        raise RuntimeError("driver")

    desk.link._crazyflie.commander.send_hover_setpoint = fail
    desk.link._send([("hover", (0.0, 0.0, 0.0, 0.5))])
    desk.until(lambda: any("cannot send: driver" in text for _, text in desk.link.pop_texts()))
    desk.until_state(State.READY)


def test_a_flight_without_cflib_says_what_to_install(monkeypatch):
    monkeypatch.setattr(crazyflie_link, "cflib", None)
    vehicle = Vehicle(0, "crazyflie", address="radio://0/80")
    machine = VehicleMachine(1.0, Limits(), TRAITS, Permissions())
    with pytest.raises(crazyflie_link.InputError) as error:
        crazyflie_link.CrazyflieLink(vehicle, machine, time.monotonic)
    assert "pip install 'quad-nav[crazyflie]'" in str(error.value)
