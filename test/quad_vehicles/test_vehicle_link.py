"""The connection over TCP: messages come through, and it connects again after it was closed."""

from __future__ import annotations

import socket
import time

import pytest

from quad_nav.errors import InputError
from quad_vehicles.autopilots import AUTOPILOTS
from quad_vehicles.mavlink_link import MavlinkLink, mavutil
from quad_vehicles.orders import Permissions
from quad_vehicles.states import VehicleMachine
from quad_vehicles.telemetry import Limits
from quad_vehicles.vehicle_file import OUR_SYSTEM, Vehicle

PATIENCE_S = 20.0


def link_to(address):
    machine = VehicleMachine(1.0, Limits(), AUTOPILOTS["ardupilot"].traits, Permissions())
    return MavlinkLink(Vehicle(0, "mavlink", address=address), machine, time.monotonic)


def heartbeat(mode, system=1, component=1):
    mavlink = mavutil.mavlink
    encoder = mavlink.MAVLink(None, srcSystem=system, srcComponent=component)
    return encoder.heartbeat_encode(2, 3, 81, mode, 3).pack(encoder)


def read_until(link, condition):
    end_s = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < end_s
        link.read(0.05)


@pytest.fixture
def server():
    with socket.create_server(("127.0.0.1", 0)) as one:
        one.settimeout(PATIENCE_S)
        yield one


def test_only_heartbeats_of_the_vehicles_autopilot_count(server):
    link = link_to(f"tcp:127.0.0.1:{server.getsockname()[1]}")
    vehicle, _ = server.accept()
    # Another station's heartbeat (mode 0), that of a gimbal, and that of the autopilot.
    vehicle.sendall(heartbeat(0, system=254) + heartbeat(0, component=154) + heartbeat(5))
    inputs = link.machine.inputs
    read_until(link, lambda: inputs.status is not None)
    assert inputs.status.mode == "LOITER"
    link.close()
    vehicle.close()


def accepted(server):
    """The connection that a link has opened, None if it has not yet."""
    server.setblocking(False)
    try:
        return server.accept()[0]
    except BlockingIOError:
        return None


def test_it_connects_again_after_the_other_side_has_closed(server):
    link, made = link_to(f"tcp:127.0.0.1:{server.getsockname()[1]}"), []
    inputs = link.machine.inputs
    for mode, name in [(4, "GUIDED"), (9, "LAND")]:
        read_until(link, lambda: made.append(accepted(server)) or made[-1])
        made[-1].sendall(heartbeat(mode))
        read_until(link, lambda name=name: inputs.status is not None and inputs.status.mode == name)
        made[-1].close()
    link.close()


def test_a_vehicle_that_is_not_there_yet_is_no_fault(server):
    port = server.getsockname()[1]
    server.close()
    link, made = link_to(f"tcp:127.0.0.1:{port}"), []
    with socket.create_server(("127.0.0.1", port)) as later:
        read_until(link, lambda: made.append(accepted(later)) or made[-1])
        made[-1].close()
    link.close()


def test_heartbeats_of_others_are_told(server):
    link = link_to(f"tcp:127.0.0.1:{server.getsockname()[1]}")
    vehicle, _ = server.accept()
    vehicle.sendall(heartbeat(4, system=2))
    read_until(link, lambda: link.tick().news)
    assert link.machine.reason == "heartbeats of system 2, expected 1"
    vehicle.sendall(heartbeat(0, system=OUR_SYSTEM, component=190))
    told = []
    read_until(link, lambda: told.extend(link.tick().news) or told)
    assert told[0].startswith(f"another station sends heartbeats as system {OUR_SYSTEM}")
    link.close()
    vehicle.close()


@pytest.mark.parametrize(
    "address",
    ["udpin:nowhere", "udpin:256.1.1.1:5", "/dev/no_such_line", "udpin:127.0.0.1:99999"],
)
def test_an_address_that_cannot_be_opened_is_named(address):
    with pytest.raises(InputError) as error:
        link_to(address)
    assert f"quad0: address {address} cannot be opened" in str(error.value)


def test_nothing_but_the_planned_bytes_leaves():
    """A set-point as the wire has it: frame, mask, target and numbers."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as vehicle:
        vehicle.bind(("127.0.0.1", 0))
        vehicle.settimeout(PATIENCE_S)
        link = link_to(f"udpout:127.0.0.1:{vehicle.getsockname()[1]}")
        fields = {
            "time_boot_ms": 9,
            "coordinate_frame": 8,
            "type_mask": 1479,
            **dict.fromkeys(("x", "y", "z", "afx", "afy", "afz", "yaw"), 0.0),
            "vx": 0.25,
            "vy": -0.5,
            "vz": 0.125,
            "yaw_rate": -1.0,
        }
        link._send([("SET_POSITION_TARGET_LOCAL_NED", fields)])
        decoder = mavutil.mavlink.MAVLink(None)
        (message,) = decoder.parse_buffer(vehicle.recv(1000))
        values = message.to_dict()
        assert values.pop("mavpackettype") == "SET_POSITION_TARGET_LOCAL_NED"
        assert values == {**fields, "target_system": 1, "target_component": 1}
        assert (message.get_srcSystem(), message.get_srcComponent()) == (OUR_SYSTEM, 191)
        link.close()
