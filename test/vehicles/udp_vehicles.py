#!/usr/bin/env python3
"""Run point vehicles over UDP: udp_vehicles.py KIND:PORT:NORTH:EAST:HEADING_DEG ...

Each sends to its port on this machine, where a bridge listens (`address: udpin:127.0.0.1:PORT`).
The signal SIGUSR1 changes the mode of the first one, as its pilot would.
"""

from __future__ import annotations

import math
import os
import signal
import sys
import time

os.environ["MAVLINK20"] = "1"
from point_vehicle import ARDUPILOT, PX4, PointVehicle
from pymavlink import mavutil

STEP_S = 0.01


class UdpVehicle:
    """One vehicle and its socket."""

    def __init__(self, text):
        kind, port, north, east, heading = text.split(":")
        self.vehicle = PointVehicle(
            {"ardupilot": ARDUPILOT, "px4": PX4}[kind],
            (float(north), float(east)),
            math.radians(float(heading)),
            boot_s=60.0,
        )
        self._link = mavutil.mavlink_connection(
            f"udpout:127.0.0.1:{port}",
            source_system=1,
            source_component=1,
            dialect="ardupilotmega",
        )

    def receive(self):
        """Take the messages that have come."""
        while True:
            message = self._link.recv_msg()
            if message is None:
                break
            fields = message.to_dict()
            self.vehicle.receive(fields.pop("mavpackettype"), fields)

    def step(self):
        """Take the messages that have come, fly on, and send."""
        self.receive()
        for name, fields in self.vehicle.advance(STEP_S):
            if "param_id" in fields:
                fields["param_id"] = fields["param_id"].encode()
            if "text" in fields:
                fields["text"] = fields["text"].encode()
            getattr(self._link.mav, f"{name.lower()}_send")(**fields)


def main():
    vehicles = [UdpVehicle(text) for text in sys.argv[1:]]
    first = vehicles[0].vehicle
    signal.signal(signal.SIGUSR1, lambda *_: first.set_mode(first.kind["other"]))
    next_s = time.monotonic()
    while True:
        for one in vehicles:
            one.step()
        next_s += STEP_S
        time.sleep(max(next_s - time.monotonic(), 0.0))


if __name__ == "__main__":
    main()
