#!/usr/bin/env python3
"""Run stand-in Crazyflies that cflib connects to: crazyflie_server.py [--scene FILE] PORT ...

Each listens on its port of this machine; its address is tcp://127.0.0.1:PORT. There cflib speaks
CRTP in the frames of CPX, as to a Crazyflie with an AI-deck. With a scene they stand at its start
poses, and touch its walls and each other; contacts are printed.
"""

from __future__ import annotations

import argparse
import socket
import struct
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from vehicles.bodies import EMPTY, Bodies, warm_up
from vehicles.crazyflie import AIRFRAME, Crazyflie
from vehicles.stand_in import advance

from quad_nav.geometry import Pose2D
from quad_nav.sim.scene_file import load_scene
from quad_nav.sim.simulation_params import STEP_S

APART_M = 20.0
PROTOCOL = 9  # from 9 on a yaw rate is counter-clockwise
PARAM, MEM, LOG, SETPOINT, PLATFORM, LINK = 2, 4, 5, 7, 13, 15  # ports of CRTP
STOP, HOVER = 0, 10  # types of set-points
_CPX_CRTP, _FROM_STM32_TO_HOST = 3, 1 << 3 | 3
_LOG_TYPES = {1: "B", 2: "H", 3: "L", 4: "b", 5: "h", 6: "i", 7: "f"}
_UINT8, _UINT16, _INT8, _FLOAT = 1, 2, 4, 7
_PARAM_UINT8 = 0x08


class Crtp:
    """The firmware's end of CRTP: packets in, packets out.

    Attributes:
        blocks: Started log blocks: (period in s, next time, [(type, variable), ...]) by number.
    """

    def __init__(self, crazyflie):
        self._crazyflie = crazyflie
        self._variables = sorted(crazyflie.values())
        self._parameters = sorted(crazyflie.parameters)
        self.blocks, self._made = {}, {}

    def answer(self, port, channel, data):
        """Return the packets (port, channel, bytes) that answer one."""
        if port in (LOG, PARAM) and channel == 0:
            return [(port, 0, self._contents(port, data))]
        handlers = {
            PARAM: self._parameter,
            MEM: self._memory,
            LOG: self._log,
            SETPOINT: self._setpoint,
            PLATFORM: self._platform,
            LINK: self._link,
        }
        found = handlers[port](channel, data) if port in handlers else None
        return [] if found is None else [(port, channel, found)]

    def _contents(self, port, data):
        """Tables of contents: how many there are, or one of them."""
        names = self._variables if port == LOG else self._parameters
        if data[0] == 3:
            return struct.pack("<BHI", 3, len(names), 0x51AD + port + len(names))
        number = struct.unpack("<H", data[1:3])[0]
        kind = _type(names[number]) if port == LOG else _PARAM_UINT8
        text = names[number].replace(".", "\0").encode() + b"\0"
        return struct.pack("<BHB", 2, number, kind) + text

    def _parameter(self, channel, data):
        number = struct.unpack("<H", data[:2])[0]
        value = self._crazyflie.parameters[self._parameters[number]]
        return bytes(data[:2]) + struct.pack("<BB", 0, value) if channel == 1 else None

    def _memory(self, channel, data):
        return bytes([1, 0]) if (channel, data[0]) == (0, 1) else None

    def _log(self, channel, data):
        if channel != 1:
            return None
        command, number = data[0], data[1] if len(data) > 1 else 0
        if command == 5:
            self.blocks, self._made = {}, {}
        elif command in (6, 7):
            rows = struct.iter_unpack("<BH", data[2:])
            wanted = [(kind & 15, self._variables[one]) for kind, one in rows]
            self._made[number] = self._made.get(number, []) * (command == 7) + wanted
        elif command == 3:
            self.blocks[number] = [data[2] / 100.0, 0.0, self._made[number]]
        elif command in (2, 4):
            self.blocks.pop(number, None)
        return bytes([command, number, 0])

    def _setpoint(self, channel, data):
        if channel == 0 and data[0] == HOVER:
            self._crazyflie.hover(*struct.unpack("<ffff", data[1:17]))
        elif channel == 0 and data[0] == STOP:
            self._crazyflie.stop()

    def _platform(self, channel, data):
        if channel == 1 and data[0] == 0:
            return bytes([0, PROTOCOL])
        if channel == 0 and data[0] == 1:
            self._crazyflie.arm(bool(data[1]))
        return None

    def _link(self, channel, data):
        return b"Bitcraze Crazyflie\0" if channel == 1 else bytes(data)

    def due(self, now_s):
        """Return the packets of the log blocks that are due."""
        packets = []
        for number, block in self.blocks.items():
            if now_s >= block[1]:
                block[1] = now_s + block[0] - 1e-6
                stamp = struct.pack("<I", int(now_s * 1e3) % (1 << 24))[:3]
                values = self._crazyflie.values()
                body = b"".join(
                    struct.pack(f"<{_LOG_TYPES[kind]}", _held(kind, values[name]))
                    for kind, name in block[2]
                )
                packets.append((LOG, 2, bytes([number]) + stamp + body))
        return packets


def _type(name):
    if name.startswith("range.") or name == "supervisor.info":
        return _UINT16
    return {"pm.state": _INT8, "pm.batteryLevel": _UINT8}.get(name, _FLOAT)


def _held(kind, value):
    return value if _LOG_TYPES[kind] == "f" else int(value)


class Server:
    """One Crazyflie on a port, for one client at a time."""

    def __init__(self, port, crazyflie):
        self._crazyflie = crazyflie
        self._listener = socket.create_server(("127.0.0.1", port))
        self._listener.setblocking(False)
        self.port = self._listener.getsockname()[1]
        self._client, self._crtp, self._bytes = None, None, b""

    def serve(self):
        """Take what has come, and send what is due."""
        if self._client is None:
            self._accept()
            return
        try:
            data = self._client.recv(65536)
            if not data:
                self.drop()
                return
            self._bytes += data
        except BlockingIOError:
            pass
        except OSError:
            self.drop()
            return
        for port, channel, packet in self._packets():
            self._send(self._crtp.answer(port, channel, packet))
        self._send(self._crtp.due(self._crazyflie.now_s))

    def _accept(self):
        try:
            self._client, _ = self._listener.accept()
        except BlockingIOError:
            return
        self._client.setblocking(False)
        self._crtp, self._bytes = Crtp(self._crazyflie), b""

    def drop(self):
        """End the connection."""
        if self._client is not None:
            self._client.close()
        self._client = None

    def close(self):
        """End everything."""
        self.drop()
        self._listener.close()

    def _packets(self):
        """Cut what has come into CRTP packets; other functions of CPX are left out."""
        found = []
        while len(self._bytes) >= 2:
            length = struct.unpack("<H", self._bytes[:2])[0]
            if len(self._bytes) < 2 + length:
                break
            frame, self._bytes = self._bytes[2 : 2 + length], self._bytes[2 + length :]
            if frame[1] & 0x3F == _CPX_CRTP and len(frame) > 3:
                found.append((frame[2] >> 4, frame[2] & 3, frame[3:]))
        return found

    def _send(self, packets):
        for port, channel, data in packets:
            if self._client is None:
                return
            body = bytes([_FROM_STM32_TO_HOST, _CPX_CRTP, port << 4 | 0xC | channel]) + data
            try:
                self._client.send(struct.pack("<H", len(body)) + body)
            except OSError:
                self.drop()


def fly(bodies, servers, crazyflies, is_over=lambda: False):
    """Serve in real time."""
    told, next_s = 0, time.monotonic()
    while not is_over():
        for server in servers:
            server.serve()
        advance(bodies, crazyflies, 2 * STEP_S)
        for contact in bodies.contacts[told:]:
            print(contact, flush=True)
        told = len(bodies.contacts)
        next_s = max(next_s + 2 * STEP_S, time.monotonic() - 0.2)
        time.sleep(max(next_s - time.monotonic(), 0.0))


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--scene", default="")
    parser.add_argument("ports", nargs="+", type=int, metavar="PORT")
    options = parser.parse_args()
    count = len(options.ports)
    if options.scene:
        scene = load_scene(options.scene)
        bodies = Bodies(scene, scene.starts[:count], [AIRFRAME])
    else:
        middle = EMPTY.size_x_m / 2.0
        starts = [Pose2D(middle + APART_M * k, middle) for k in range(count)]
        bodies = Bodies(EMPTY, starts, [AIRFRAME])
    warm_up()
    crazyflies = [Crazyflie(bodies, robot) for robot in range(count)]
    servers = [Server(port, one) for port, one in zip(options.ports, crazyflies)]
    fly(bodies, servers, crazyflies)


if __name__ == "__main__":
    main()
