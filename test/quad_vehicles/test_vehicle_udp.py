"""Strangers at the UDP port of a bridge: they get nothing, end nothing and change nothing."""

from __future__ import annotations

import math
import socket
import threading
import time

import pytest

from quad_nav.errors import InputError
from quad_vehicles.autopilots import AUTOPILOTS
from quad_vehicles.mavlink_link import MavlinkLink, ardupilotmega
from quad_vehicles.orders import Permissions
from quad_vehicles.states import VehicleMachine
from quad_vehicles.telemetry import Limits
from quad_vehicles.vehicle_file import Vehicle

PATIENCE_S = 20.0
ENCODER = ardupilotmega.MAVLink(None, 1, 1)
BEAT = ("HEARTBEAT", {"type": 6, "autopilot": 8, "base_mode": 0, "custom_mode": 0})
BEAT[1]["system_status"] = 4


def packed(name, *values, system=1, component=1):
    encoder = ardupilotmega.MAVLink(None, system, component)
    return getattr(encoder, f"{name}_encode")(*values).pack(encoder)


def heartbeat(mode=4, system=1, component=1, autopilot=3):
    values = (2, autopilot, 81, mode, 3)
    return packed("heartbeat", *values, system=system, component=component)


class Desk:
    """A bridge that listens to a port, on a clock that the test sets."""

    def __init__(self, address="udpin:127.0.0.1:0"):
        self.now_s = 100.0
        traits = AUTOPILOTS["ardupilot"].traits
        machine = VehicleMachine(1.0, Limits(), traits, Permissions())
        vehicle = Vehicle(0, "mavlink", address=address)
        self.link = MavlinkLink(vehicle, machine, lambda: self.now_s)
        self.address = self.link._connection._socket.getsockname()
        self.inputs = machine.inputs
        self._senders = []

    def sender(self):
        made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        made.bind(("127.0.0.1", 0))
        made.settimeout(PATIENCE_S)
        self._senders.append(made)
        return made

    def hear(self, sender, *datagrams):
        """Send datagrams and let the link read them, one at a time."""
        for data in datagrams:
            sender.sendto(data, self.address)
            self.link.read(PATIENCE_S)

    def got(self, sender):
        """Return how many messages a sender has got when the link sends one."""
        self.link._send([BEAT])
        sender.setblocking(False)
        count = 0
        try:
            while True:
                sender.recv(1000)
                count += 1
        except BlockingIOError:
            return count

    def texts(self):
        return [text for _, text in self.link.pop_texts()]

    @property
    def mode(self):
        return self.inputs.status and self.inputs.status.mode

    def close(self):
        self.link.close()
        for sender in self._senders:
            sender.close()


@pytest.fixture
def desk():
    made = Desk()
    yield made
    made.close()


def test_nothing_is_sent_to_whom_no_heartbeat_of_the_vehicle_comes_from(desk):
    vehicle, stranger = desk.sender(), desk.sender()
    desk.hear(stranger, b"x", heartbeat(system=2), heartbeat(component=154), heartbeat(autopilot=8))
    desk.hear(stranger, packed("attitude", 1, *[0.0] * 6), heartbeat()[:-1])
    assert desk.got(stranger) == 0
    desk.hear(vehicle, heartbeat())
    assert (desk.got(vehicle), desk.got(stranger)) == (1, 0)
    assert "heard from 127.0.0.1:" in desk.texts()[0]


def test_heartbeats_from_another_address_are_dropped_while_the_vehicle_sends(desk):
    vehicle, stranger = desk.sender(), desk.sender()
    desk.hear(vehicle, heartbeat(4))
    desk.texts()
    for _ in range(10):
        desk.now_s += 1.0
        desk.hear(vehicle, heartbeat(4))
        desk.hear(stranger, heartbeat(9), packed("attitude", 1, math.inf, *[0.0] * 5))
        assert desk.mode == "GUIDED"
    assert desk.got(stranger) == 0 and desk.got(vehicle) == 2
    told = desk.texts()
    theirs, ours = stranger.getsockname()[1], vehicle.getsockname()[1]
    assert told == 2 * [
        f"messages of system 1 come from 127.0.0.1:{theirs} too, expected 127.0.0.1:{ours} alone;"
        " dropped"
    ]


def test_a_vehicle_that_moves_to_another_address_is_followed_when_the_old_one_is_silent(desk):
    before, after = desk.sender(), desk.sender()
    desk.hear(before, heartbeat(4))
    desk.now_s += 1.4
    desk.hear(after, heartbeat(9))
    assert desk.mode == "GUIDED"  # its next heartbeat is not late yet
    desk.now_s += 0.2
    assert desk.got(before) == 0  # the link is lost: nothing is sent
    desk.hear(after, heartbeat(9))
    assert desk.mode == "LAND" and (desk.got(after), desk.got(before)) == (1, 0)
    desk.hear(before, heartbeat(4))
    assert desk.mode == "LAND"


def test_the_bytes_of_strangers_stay_out_of_the_vehicles_messages(desk):
    vehicle, stranger = desk.sender(), desk.sender()
    desk.hear(vehicle, heartbeat(4))
    for mode, name in ((9, "LAND"), (5, "LOITER"), (6, "RTL")):
        desk.hear(stranger, b"\xfd", b"\xfd\xff\x00", heartbeat(0)[:10])
        data = heartbeat(mode)
        desk.hear(vehicle, data[:7])
        desk.hear(stranger, b"\xfe\xff")
        desk.hear(vehicle, data[7:])
        assert desk.mode == name


@pytest.mark.parametrize("is_known", [True, False])
def test_empty_datagrams_do_not_close_the_port(desk, is_known):
    vehicle = desk.sender()
    if is_known:
        desk.hear(vehicle, heartbeat(4))
    desk.hear(vehicle, *[b""] * 10)
    desk.hear(vehicle, heartbeat(9))
    assert desk.mode == "LAND"


def test_a_thousand_new_senders_in_flight_end_nothing(desk):
    """Each port sends one byte, while the bridge reads, sends and follows commands."""
    vehicle, stop, errors = desk.sender(), threading.Event(), []
    desk.hear(vehicle, heartbeat(4))

    def run(work):
        try:
            while not stop.is_set():
                work()
        except Exception as error:
            errors.append(error)

    setpoints = [BEAT] * 20
    workers = [lambda: desk.link.read(0.01), lambda: desk.link._send(setpoints), desk.link.tick]
    threads = [threading.Thread(target=run, args=(work,)) for work in workers]
    for thread in threads:
        thread.start()
    for _ in range(1000):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
            stranger.sendto(b"\xfd", desk.address)
    vehicle.sendto(heartbeat(9), desk.address)
    end_s = time.monotonic() + PATIENCE_S
    while desk.mode != "LAND" and not errors and time.monotonic() < end_s:
        vehicle.sendto(heartbeat(9), desk.address)
        time.sleep(0.01)
    stop.set()
    for thread in threads:
        thread.join(PATIENCE_S)
    assert errors == [] and desk.mode == "LAND"
    assert desk.link._peer == vehicle.getsockname()


@pytest.mark.parametrize("error", [OSError(101, "Network is unreachable"), ValueError("odd")])
def test_no_error_of_sending_is_raised(desk, error):
    vehicle = desk.sender()
    desk.hear(vehicle, heartbeat())
    desk.texts()

    class Broken:
        def sendto(self, *_):
            raise error

        def close(self):
            """Nothing is open."""

    whole, desk.link._connection._socket = desk.link._connection._socket, Broken()
    for _ in range(100):
        desk.link._send([BEAT])
    (line,) = desk.texts()
    assert line.startswith(f"HEARTBEAT cannot be sent: {type(error).__name__}")
    desk.link._connection._socket = whole
    assert desk.got(vehicle) == 1


@pytest.mark.parametrize("value", [1e300, math.inf, None, "x"])
def test_a_value_that_does_not_fit_into_a_message_is_not_sent_and_the_next_one_is(desk, value):
    vehicle = desk.sender()
    desk.hear(vehicle, heartbeat())
    desk.texts()
    odd = ("PARAM_SET", {"param_id": "FENCE_RADIUS", "param_value": value, "param_type": 9})
    desk.link._send([odd])
    assert desk.got(vehicle) >= 1
    assert value == math.inf or "PARAM_SET cannot be sent: " in desk.texts()[0]


def test_a_bridge_that_sends_first_hears_its_destination_alone():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as vehicle:
        vehicle.bind(("127.0.0.1", 0))
        vehicle.settimeout(PATIENCE_S)
        desk = Desk(f"udpout:127.0.0.1:{vehicle.getsockname()[1]}")
        desk.link._send([BEAT])
        _, port = vehicle.recvfrom(1000)
        desk.address = port
        stranger = desk.sender()
        desk.hear(stranger, heartbeat(9))
        assert desk.mode is None and desk.got(stranger) == 0
        desk.hear(vehicle, heartbeat(4))
        assert desk.mode == "GUIDED"
        desk.close()


@pytest.mark.parametrize("address", ["127.0.0.1:0", "udp:127.0.0.1:0", "udpbcast:127.0.0.1:1"])
def test_other_addresses_of_udp_have_the_same_rules(address):
    desk = Desk(address)
    desk.address = ("127.0.0.1", desk.address[1] or desk.link._connection._socket.getsockname()[1])
    vehicle, stranger = desk.sender(), desk.sender()
    if "bcast" in address:
        desk.link._send([BEAT])  # opens the port
        desk.address = ("127.0.0.1", desk.link._connection._socket.getsockname()[1])
    desk.hear(stranger, b"x", heartbeat(system=9))
    desk.hear(vehicle, heartbeat())
    assert (desk.got(vehicle), desk.got(stranger)) == (1, 0)
    desk.close()


def test_a_port_that_another_program_listens_to_is_not_shared(desk):
    with pytest.raises(InputError) as error:
        Desk(f"udpin:0.0.0.0:{desk.address[1]}")
    assert "in use" in str(error.value)
