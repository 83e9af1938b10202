#!/usr/bin/env python3
"""Run stand-in vehicles over UDP: udp_vehicles.py [OPTION ...] KIND:PORT:NORTH:EAST:HEADING ...

Each sends to its port on this machine, where a bridge listens (`address: udpin:127.0.0.1:PORT`).
North, east (m) and heading (degrees) are the vehicle's place in its own local frame. With a scene
the vehicles stand at its start poses, and touch its walls and each other; contacts are printed.
With `--drift` odometry drifts as recorded, and LIDARs are topics of ROS, see `truth_topics`.
`--gcs-timeout` is how long ArduPilot waits for a silent ground station.
KIND is `ardupilot` or `px4`.
The signal SIGUSR1 changes the mode of the first one, as its pilot would.
"""

from __future__ import annotations

import argparse
import math
import os
import signal
import sys
import time
from pathlib import Path

os.environ["MAVLINK20"] = "1"
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from pymavlink import mavutil
from vehicles.bodies import EMPTY, Bodies, warm_up
from vehicles.estimator import LocalFrame
from vehicles.stand_in import advance
from vehicles.virtual_flight import AIRFRAMES, STAND_INS

from quad_nav.geometry import Pose2D
from quad_nav.sim.scene_file import load_scene
from quad_vehicles.vehicle_file import OUR_SYSTEM

STEP_S = 1.0 / 120.0
BOOT_S = 60.0
APART_M = 20.0


class UdpVehicle:
    """One vehicle and its socket."""

    def __init__(self, text, bodies, number, gcs_timeout_s):
        kind, port, north, east, heading = text.split(":")
        place, heading_rad = (float(north), float(east)), math.radians(float(heading))
        stand_in, safe = STAND_INS[kind]
        if "SYSID_MYGCS" in safe:
            station = float(OUR_SYSTEM - number)
            safe = {**safe, "SYSID_MYGCS": station, "FS_GCS_TIMEOUT": gcs_timeout_s}
        frame = LocalFrame(*place, heading_rad)
        self.vehicle = stand_in(bodies, number, frame, number, BOOT_S, safe)
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
            sender = message.get_srcSystem(), message.get_srcComponent()
            self.vehicle.receive(fields.pop("mavpackettype"), fields, sender)

    def send(self):
        """Send what the vehicle has to say."""
        for name, fields in self.vehicle.messages():
            values = dict(fields)
            if "param_id" in values:
                values["param_id"] = values["param_id"].encode()
            if "text" in values:
                values["text"] = values["text"].encode()
            getattr(self._link.mav, f"{name.lower()}_send")(**values)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--scene", default="")
    parser.add_argument("--drift", action="store_true")
    parser.add_argument("--gcs-timeout", type=float, default=5.0, metavar="S")
    parser.add_argument("vehicles", nargs="+", metavar="KIND:PORT:NORTH:EAST:HEADING")
    options = parser.parse_args()
    count = len(options.vehicles)
    airframes = [AIRFRAMES[text.split(":")[0]] for text in options.vehicles]
    if options.scene:
        scene = load_scene(options.scene)
        bodies = Bodies(scene, scene.starts[:count], airframes)
    else:
        middle = EMPTY.size_x_m / 2.0
        starts = [Pose2D(middle + APART_M * k, middle) for k in range(count)]
        bodies = Bodies(EMPTY, starts, airframes)
    warm_up()
    links = [
        UdpVehicle(text, bodies, k, options.gcs_timeout) for k, text in enumerate(options.vehicles)
    ]
    vehicles = [link.vehicle for link in links]
    first, told, topics = vehicles[0], 0, None
    if options.drift:
        from vehicles.truth_topics import TruthTopics  # it needs ROS

        topics = TruthTopics(scene, bodies)
        for vehicle in vehicles:
            vehicle.estimator.drifts = True
    signal.signal(signal.SIGUSR1, lambda *_: first.set_mode(first.kind["other"]))
    next_s = time.monotonic()
    while True:
        for link in links:
            link.receive()
        advance(bodies, vehicles, STEP_S)
        for link in links:
            link.send()
        if topics is not None:
            topics.publish()
        for contact in bodies.contacts[told:]:
            print(contact, flush=True)
        told = len(bodies.contacts)
        next_s = max(next_s + STEP_S, time.monotonic() - 0.2)
        time.sleep(max(next_s - time.monotonic(), 0.0))


if __name__ == "__main__":
    main()
