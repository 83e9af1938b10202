#!/usr/bin/env python3
"""Feed the bridge of a vehicle with made-up datagrams: ``make fuzz TARGET=vehicle SECONDS=60``.

    PYTHONPATH=src:test vehicle.py [SECONDS] [--messages N] [--seed K]

The bridge is the real one, from the link's receiving side to the encoded bytes that it sends; its
socket is a list and its clock virtual. A stand-in answers it. What is fed are messages of every
kind that the bridge handles, with any bits or with one odd field, of wrong systems, cut, damaged,
doubled, and random bytes; half of them to bridges that may arm. In turn the vehicle

* stands on the ground, and nobody asks for anything: no order and no set-point may leave;
* flies, and strangers send: it must fly on;
* flies, takes off and lands, and sends the datagrams itself: the bridge may do anything that it may
  do at all, but arms only after it was asked to take off, and sends only finite set-points within
  the limits, in the states in which it may.

Exits with status 1 at the first fault, and tells the seed of its flight.
"""

from __future__ import annotations

import argparse
import itertools
import math
import random
import re
import struct
import time

from vehicles.point_bodies import PointBodies
from vehicles.virtual_flight import STAND_INS, STEP_S

from quad_nav.geometry import Twist2D
from quad_nav.topics.vehicle_states import ON_GROUND, State
from quad_vehicles import failsafes
from quad_vehicles.autopilots import AUTOPILOTS
from quad_vehicles.mavlink_adapter import MavlinkAdapter
from quad_vehicles.mavlink_link import MavlinkLink, UdpSocket, ardupilotmega
from quad_vehicles.orders import Permissions
from quad_vehicles.states import VehicleMachine
from quad_vehicles.telemetry import Limits
from quad_vehicles.vehicle_file import OUR_SYSTEM, Lidar, Vehicle

COMMAND_S = 0.05
STEPS, PER_STEP = 400, 20
COMMAND = Twist2D(0.3, 0.1, 0.2)
VEHICLE = ("10.0.0.1", 14550)
STRANGERS = [("10.0.0.1", 14551), *((f"10.0.1.{k}", 5000 + k) for k in range(20))]
ARM, TAKE_OFF, SET_RATE = 400, 22, 511
SETPOINT = "SET_POSITION_TARGET_LOCAL_NED"
MOVING = (State.ARMING, State.TAKING_OFF, State.FLYING, State.HOLDING)
ODD_FLOATS = (math.nan, math.inf, -math.inf, 3.4e38, -3.4e38, 1e-45, 0.0, 1.0, -7.0, 1e4)
NAMES = [name for kind in AUTOPILOTS for name in failsafes.names(Vehicle(0, "mavlink", kind))]
BEGINNINGS = ["", "PreArm: ", "Arm: ", "Mode change to ", "Preflight Fail: ", "EKF", "\x1b[2J"]
# Each autopilot has its own message of the state of its estimator.
HANDLED = [name for name in MavlinkAdapter._HANDLERS if name != "estimator"]
HANDLED += [kind.estimator[1] for kind in AUTOPILOTS.values()]


class Kind:
    """One kind of message: its bytes on the wire."""

    def __init__(self, name):
        self.message = getattr(ardupilotmega, f"MAVLink_{name.lower()}_message")
        self.name, self.packer = name, self.message.unpacker
        pairs = re.findall(r"(\d*)([a-zA-Z])", self.packer.format)
        self.codes = "".join(code if code == "s" else code * int(n or 1) for n, code in pairs)
        # Where each field of one value begins in the values as they are packed.
        lengths = [1 if k < 2 else k for k in self.message.lengths]
        at = list(itertools.accumulate([0, *lengths]))
        self.places = dict(zip(self.message.ordered_fieldnames, at))

    def any_bits(self, rng):
        """Return a payload of random bits."""
        size = self.packer.size
        return rng.getrandbits(8 * size).to_bytes(size, "little")

    def usual(self, rng, now_s):
        """Return a payload with usual values, but for one that is often odd."""
        values = [b"" if code == "s" else 0 for code in self.codes]
        for field, value in _usual(self.name, rng, now_s).items():
            values[self.places[field]] = value
        if rng.random() < 0.6:
            k = rng.randrange(len(values))
            values[k] = _odd(self.codes[k], rng)
        return self.packer.pack(*values)


def _odd(code, rng):
    if code in "fd":
        return rng.choice(ODD_FLOATS)
    if code == "s":
        return rng.getrandbits(320).to_bytes(40, "little")
    bits = 8 * struct.calcsize(code)
    least = -(1 << bits - 1) if code.islower() and code != "s" else 0
    most = least + (1 << bits) - 1
    return rng.choice((least, least + 1, 0, 1, most, most - 1, rng.randint(least, most)))


def _usual(name, rng, now_s):
    """Return values that get far."""
    if name == "HEARTBEAT":
        kind = AUTOPILOTS[rng.choice(list(AUTOPILOTS))]
        mode, armed = rng.choice(list(kind.modes)), rng.choice((81, 209))
        return {"autopilot": kind.number, "base_mode": armed, "custom_mode": mode}
    if name == "STATUSTEXT":
        words = rng.choice(BEGINNINGS) + str(rng.getrandbits(rng.choice((3, 200))))
        return {"severity": rng.randrange(9), "text": words.encode(), "id": rng.randrange(3)}
    if name == "COMMAND_ACK":
        return {"command": rng.choice((176, ARM, TAKE_OFF, SET_RATE)), "result": rng.randrange(7)}
    if name == "PARAM_VALUE":
        value = rng.choice((*ODD_FLOATS, 2.0, 3.0, 5.0))
        kind = rng.choice((9, 6, 2, 77))
        return {"param_id": rng.choice(NAMES).encode(), "param_value": value, "param_type": kind}
    if name == "TIMESYNC":
        return {"tc1": rng.getrandbits(40), "ts1": int((now_s - rng.random()) * 1e9)}
    if name == "EXTENDED_SYS_STATE":
        return {"landed_state": rng.randrange(6)}
    if name == "OBSTACLE_DISTANCE":
        return {"increment": 5, "max_distance": 500, "increment_f": rng.choice(ODD_FLOATS)}
    if name in ("ATTITUDE", "LOCAL_POSITION_NED"):
        return {"time_boot_ms": int(now_s * 1e3) + rng.randint(-2000, 2000)}
    return {}


KINDS_OF_MESSAGES = [Kind(name) for name in HANDLED]


def datagram(rng, now_s, kinds=KINDS_OF_MESSAGES):
    """Make one datagram up."""
    draw = rng.random()
    if draw < 0.05:
        size = rng.choice((0, 1, 3, 20, 300))
        return rng.getrandbits(8 * size).to_bytes(size, "little") if size else b""
    data = frame(rng, now_s, rng.choice(kinds))
    if draw < 0.10:
        return data[: rng.randrange(len(data))]
    if draw < 0.15:
        bad = bytearray(data)
        bad[rng.randrange(len(bad))] ^= 1 << rng.randrange(8)
        return bytes(bad)
    if draw < 0.20:
        return data + data
    return data


def frame(rng, now_s, kind):
    """Make one message up, with a right checksum."""
    payload = kind.usual(rng, now_s) if rng.random() < 0.7 else kind.any_bits(rng)
    if rng.random() < 0.1:
        payload = payload[: rng.randint(1, len(payload))]
    system = 1 if rng.random() < 0.9 else rng.randrange(256)
    component = 1 if rng.random() < 0.9 else rng.randrange(256)
    number, sequence = kind.message.id, rng.randrange(256)
    if number < 256 and rng.random() < 0.1:  # MAVLink 1
        head = struct.pack("<BBBBB", len(payload), sequence, system, component, number)
        marker = b"\xfe"
    else:
        ids = number & 0xFF, number >> 8 & 0xFF, number >> 16
        head = struct.pack("<BBBBBBBBB", len(payload), 0, 0, sequence, system, component, *ids)
        marker = b"\xfd"
    checksum = ardupilotmega.x25crc(head + payload + bytes([kind.message.crc_extra])).crc
    return marker + head + payload + struct.pack("<H", checksum)


class FakeSocket(UdpSocket):
    """A socket that is two lists."""

    def __init__(self):
        self.default = self.peer = self.source = None
        self.is_fixed = False
        self.queue, self.sent = [], []

    def select(self, timeout_s):
        return bool(self.queue)

    def recv(self, most):
        data, self.source = self.queue.pop(0)
        return data

    def send(self, data, is_alive):
        if is_alive and self.peer is not None:
            self.sent.append((data, self.peer))

    def close(self):
        pass


class FuzzedFlight:
    """A bridge, the stand-in that it flies, and somebody who sends datagrams."""

    def __init__(self, autopilot, may_arm, seed):
        self.rng, self.now_s = random.Random(seed), 100.0
        self.autopilot, self.may_arm, self.fed = autopilot, may_arm, 0
        stand_in, safe = STAND_INS[autopilot]
        self.vehicle = stand_in(PointBodies(), parameters=safe)
        limits = Limits(speed_mps=1.0)
        traits = AUTOPILOTS[autopilot].traits
        self.machine = VehicleMachine(1.2, limits, traits, Permissions(may_arm=may_arm))
        lidar = Lidar(is_obstacle_distance=True)
        vehicle = Vehicle(
            0, "mavlink", autopilot, "udpin:127.0.0.1:0", altitude_m=1.2, limits=limits, lidar=lidar
        )
        self.link = MavlinkLink(vehicle, self.machine, lambda: self.now_s)
        self.link.close()
        self.socket = self.link._connection = FakeSocket()
        self.link.adapter.fail = _raise
        self.commands = self.is_mad = self.is_asked = False
        self.orders, self.sent = [], []
        # A few kinds at a time get further than all of them.
        self._kinds = self.rng.sample(KINDS_OF_MESSAGES, self.rng.randint(1, len(HANDLED)))
        self._mute_s = 0.0
        self._encoder = ardupilotmega.MAVLink(None, 1, 1)
        self._parser = ardupilotmega.MAVLink(None)
        self._next_command_s = 0.0

    def feed(self, steps, sources):
        """Let time pass while somebody sends."""
        for _ in range(steps):
            queue = [
                (datagram(self.rng, self.now_s, self._kinds), self.rng.choice(sources))
                for _ in range(PER_STEP)
            ]
            self.fed += PER_STEP
            self.step(queue)

    def run(self, seconds, until):
        """Let time pass in peace; assert that something becomes true."""
        for _ in range(round(seconds / STEP_S)):
            self.step([])
            if until():
                return
        raise AssertionError((self.machine.state, self.machine.reason))

    def step(self, queue):
        """Let 8 ms pass."""
        self.now_s += STEP_S
        told = [(self._encoded(*one), VEHICLE) for one in self.vehicle.advance(STEP_S)]
        if self.now_s > self._mute_s:
            middle = self.rng.randrange(len(queue) + 1)
            queue[middle:middle] = told
        self.socket.queue = queue
        while queue:
            self.link.read(0.0)
        before = self.machine.state
        if self.is_mad and self.rng.random() < 0.05:
            self._ask()
        if self.commands and self.now_s >= self._next_command_s:
            self._next_command_s = self.now_s + COMMAND_S
            self.link.follow(COMMAND)
        self.link.tick()
        self.link.pop_texts()
        self._check({before, self.machine.state})

    def _ask(self):
        """Ask for something, as people do; or the vehicle is not heard for a while."""
        what = self.rng.randrange(8)
        if what == 0:
            self.machine.land(self.now_s, "asked", is_stop_all=self.rng.random() < 0.5)
        elif what == 1:
            self._mute_s = self.now_s + self.rng.uniform(0.3, 4.0)
        elif what < 4:
            self.machine.resume(self.now_s)
        else:
            self.take_off()

    def take_off(self):
        """Ask for a take-off."""
        before = self.machine.state
        if self.machine.take_off(self.now_s).is_accepted and before in ON_GROUND:
            self.is_asked = True

    def _check(self, states):
        sent, self.socket.sent = self.socket.sent, []
        self.sent += sent
        for data, to in sent:
            assert to == self.socket.peer, to
            (message,) = self._parser.parse_buffer(data)
            fields, name = message.to_dict(), message.get_type()
            if name == SETPOINT:
                self._check_setpoint(message, states)
            elif name == "COMMAND_LONG" and message.command != SET_RATE:
                self.orders.append(message.command)
                arms = message.command == ARM and message.param1 == 1.0
                assert self.may_arm or not arms, "armed without permission"
                if arms or message.command == TAKE_OFF:
                    assert self.is_asked, "armed or took off without an order"
            if to == VEHICLE:
                del fields["mavpackettype"]
                self.vehicle.receive(name, fields, (OUR_SYSTEM, 191))
        if self.machine.state not in (State.ARMING, State.TAKING_OFF):
            self.is_asked = False

    def _check_setpoint(self, message, states):
        velocity = message.vx, message.vy, message.vz, message.yaw_rate
        assert all(map(math.isfinite, velocity)), velocity
        assert math.hypot(message.vx, message.vy) < 1.0 + 1e-6, velocity
        assert (message.coordinate_frame, message.type_mask) == (8, 1479)
        if not states & set(MOVING):
            assert State.TAKEN_OVER in states, states
            assert not any(velocity[:2]) and message.yaw_rate == 0.0, velocity

    def _encoded(self, name, fields):
        values = {k: v.encode() if isinstance(v, str) else v for k, v in fields.items()}
        return getattr(self._encoder, f"{name.lower()}_encode")(**values).pack(self._encoder)


def _raise(what, error, now_s):
    raise error


def on_the_ground(flight):
    """Nobody asks for anything: nothing leaves that moves it."""
    flight.commands = True
    flight.feed(STEPS, [VEHICLE, VEHICLE, STRANGERS[1]])
    assert flight.orders == [], flight.orders
    assert not flight.vehicle.armed and flight.vehicle.setpoints == []


def among_strangers(flight):
    """It flies on as without them, whatever others send."""
    alone = FuzzedFlight(flight.autopilot, flight.may_arm, 0)
    for one in (flight, alone):
        to_flight(one)
    flight.feed(STEPS, STRANGERS)
    for _ in range(STEPS):
        alone.step([])
    assert flight.sent == alone.sent and flight.machine.state is State.FLYING
    assert abs(flight.vehicle.height_m - 1.2) < 0.05, flight.vehicle.height_m
    assert flight.vehicle.speed_mps > 0.3, flight.vehicle.speed_mps


def out_of_its_mind(flight):
    """The vehicle itself sends anything, while people ask for this and that."""
    if flight.rng.random() < 0.8:
        to_flight(flight)
    flight.is_mad = True
    flight.feed(STEPS, [VEHICLE, VEHICLE, STRANGERS[1]])


def to_flight(flight):
    """Take off; the pilot arms if the bridge may not."""
    flight.run(15.0, lambda: flight.machine.state is State.READY)
    if not flight.may_arm:
        flight.vehicle._arm(ardupilotmega.MAVLink_command_long_message(*[1] * 4, 1, *[0] * 6))
        flight.run(1.0, lambda: flight.machine.inputs.status.is_armed)
    flight.take_off()
    flight.commands = True
    flight.run(20.0, lambda: flight.machine.state is State.FLYING)
    point = flight.vehicle
    flight.run(4.0, lambda: abs(point.height_m - 1.2) < 0.02 and point.speed_mps > 0.3)


FLIGHTS = (on_the_ground, out_of_its_mind, among_strangers, out_of_its_mind)
CASES = list(itertools.product(FLIGHTS, STAND_INS, (True, False)))


def fuzz(messages, seconds, seed, tell=print):
    """Fly until enough is fed; return how much was, in all and to bridges that may arm.

    Raises:
        AssertionError: The bridge did what it must not do; or whatever a message has raised.
    """
    begin_s = told_s = time.monotonic()
    fed, armed, number = 0, 0, seed
    while fed < messages and time.monotonic() - begin_s < seconds:
        case, autopilot, may_arm = CASES[number % len(CASES)]
        flight = FuzzedFlight(autopilot, may_arm, number)
        try:
            case(flight)
        except Exception:
            tell(f"fault: {case.__name__}, {autopilot}, seed {number}, arm {may_arm}")
            raise
        fed, armed, number = fed + flight.fed, armed + may_arm * flight.fed, number + 1
        now_s = time.monotonic()
        if now_s - told_s > 30.0:
            told_s = now_s
            tell(f"{fed} datagrams, {fed / (now_s - begin_s):.0f} a second")
    elapsed_s = time.monotonic() - begin_s
    tell(
        f"{fed} datagrams in {number - seed} flights, {armed} of them to bridges that may arm:"
        f" no exception, no arming without an order; {fed / elapsed_s:.0f} a second"
    )
    return fed, armed


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("seconds", type=float, nargs="?", default=math.inf)
    parser.add_argument("--messages", type=float, default=math.inf)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    if options.messages == options.seconds == math.inf:
        options.seconds = 60.0
    fuzz(options.messages, options.seconds, options.seed)  # an exception ends with status 1


if __name__ == "__main__":
    main()
