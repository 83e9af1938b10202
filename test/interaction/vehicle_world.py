"""Real bridges, the node of all vehicles and a sequencer, with stand-in vehicles.

The vehicles are the stand-ins of `test/vehicles` with bodies that are points. Navigators fly
straight. All runs on a virtual clock, which is the time of the machine, too.
"""

from __future__ import annotations

import math
from collections import deque
from types import SimpleNamespace

import rospy
from geometry_msgs.msg import Twist
from interaction.sequenced import SPACING_M, SequencedWorld
from nav_msgs.msg import Odometry
from vehicles.estimator import LocalFrame
from vehicles.point_bodies import PointBodies
from vehicles.stand_in import advance
from vehicles.virtual_flight import GROUND_STATION, STAND_INS, STATION_HEARTBEAT

from quad_nav.geometry import Pose2D
from quad_vehicles.autopilots import AUTOPILOTS
from quad_vehicles.link import VehicleLink
from quad_vehicles.mavlink_adapter import MavlinkAdapter
from quad_vehicles.orders import Permissions
from quad_vehicles.ros import node
from quad_vehicles.ros.fleet import VehicleFleet
from quad_vehicles.states import VehicleMachine
from quad_vehicles.telemetry import Limits
from quad_vehicles.vehicle_file import OUR_SYSTEM, Vehicle

VEHICLES = 2
STEP_S = 0.05
node.TICK_S = STEP_S  # a quicker bridge would see no more
EPOCH_S = 1_700_000_000
SYSTEM = 1
STARTS = [Pose2D(SPACING_M * number, 0.0, 0.3) for number in range(VEHICLES)]
FRAME = LocalFrame(3.0, -2.0, 0.6)


class Radio:
    """The link of one vehicle, to its bridge and to a ground station.

    Attributes:
        hears: Whether what the vehicle sends arrives.
        is_heard: Whether what is sent to the vehicle arrives.
        has_station: Whether a common ground station is on the link, too.
        inbox: (name, fields) for the bridge.
        orders: (time, fields) of the commands that the bridge has sent.
        setpoints: (time, fields) of its set-points.
    """

    def __init__(self, vehicle, threads):
        self.vehicle, self._threads = vehicle, threads
        self.hears = self.is_heard = True
        self.has_station = False
        self.inbox, self.orders, self.setpoints = deque(), [], []
        self._beat_s = 0.0

    def send(self, name, fields):
        """Send what the bridge says to the vehicle."""
        if name == "COMMAND_LONG":
            self.orders.append((self._threads.now_s, fields))
        elif name == "SET_POSITION_TARGET_LOCAL_NED":
            self.setpoints.append((self._threads.now_s, fields))
        if self.is_heard:
            self.vehicle.receive(name, fields, (OUR_SYSTEM, 191))

    def exchange(self):
        """Carry what has been sent by now."""
        arrived = self.vehicle.messages()
        self.inbox.extend(arrived if self.hears else ())
        if self.has_station and self._threads.now_s >= self._beat_s + 1.0:
            self._beat_s = self._threads.now_s
            self.vehicle.receive("HEARTBEAT", STATION_HEARTBEAT, GROUND_STATION)


class RadioLink(VehicleLink):
    """The bridge's end of a radio."""

    def __init__(self, vehicle, machine, radio, threads):
        super().__init__(vehicle, MavlinkAdapter(vehicle, machine), lambda: threads.now_s)
        self._radio, self._threads = radio, threads

    def read(self, timeout_s):
        inbox = self._radio.inbox
        if self._threads.wait(lambda: inbox, timeout_s):
            while inbox:
                name, fields = inbox.popleft()
                message = SimpleNamespace(**{"id": 0, **fields})
                with self.lock:
                    self._adapter.receive(name, 1, message, self._clock())

    def _send(self, messages):
        for name, fields in messages:
            self._radio.send(name, fields)

    def close(self):
        pass


class VehicleWorld(SequencedWorld):
    """The vehicles, their bridges, and the mission.

    Attributes:
        bodies: Of the vehicles.
        vehicles: The autopilots.
        radios: Their links.
        offset_s: What somebody has added to the clock of this machine.
        commanded_s: When each vehicle's last velocity command came, on the virtual clock.
        odometry_s: Stamp of each vehicle's last odometry.
        on_step: Called after each step.
    """

    parameters = {
        "simulation": False,
        "start_service": "/vehicles/take_off",
        "end_service": "/vehicles/land",
    }

    def __init__(self, autopilot):
        self.offset_s, self._clock_s = 0.0, lambda: EPOCH_S + self.graph.threads.now_s
        super().__init__(VEHICLES, lambda: rospy.Time.from_sec(self._clock_s() + self.offset_s))
        self.bodies, self.on_step = PointBodies(STARTS), lambda: None
        kind, safe = STAND_INS[autopilot]
        self.vehicles = [
            kind(self.bodies, number, FRAME, number, 60.0, safe) for number in range(VEHICLES)
        ]
        self.radios = [Radio(vehicle, self.graph.threads) for vehicle in self.vehicles]
        limits = Limits(speed_mps=1.0)
        self._files = [
            Vehicle(number, "mavlink", autopilot, map_from_start=start, limits=limits)
            for number, start in enumerate(STARTS)
        ]
        self.commanded_s, self.odometry_s = [-math.inf] * VEHICLES, [-math.inf] * VEHICLES
        self.graph.start("/physics", self._move)
        self.bridges, self.machines = {}, {}
        for number in range(VEHICLES):
            self.start_bridge(number, False)
            self.start_pilot(number)
        self.start_fleet()
        self.start_sequencer(False)

    def pose(self, robot):
        return self.bodies.pose(robot).to_2d()

    def is_flying(self, number):
        return self.bodies.height_m(number) > 0.1

    def start_bridge(self, number, is_respawned):
        """Start it, as the launch file does, or its supervisor after it was killed."""
        vehicle, threads = self._files[number], self.graph.threads
        traits = AUTOPILOTS[vehicle.autopilot].traits
        machine = VehicleMachine(
            vehicle.altitude_m, vehicle.limits, traits, Permissions(may_arm=True)
        )
        self.machines[number] = machine

        def main():
            link = RadioLink(vehicle, machine, self.radios[number], threads)
            node.VehicleNode(vehicle, link, is_respawned).run()

        self.radios[number].inbox.clear()
        self.bridges[number] = self.graph.start(f"/vehicle{number}", main)

    def kill_bridge(self, number):
        self.graph.kill(self.bridges.pop(number))
        del self.machines[number]

    def start_fleet(self):
        """Start the node of all vehicles."""

        def main():
            self._fleet = VehicleFleet(self._files, True)
            self.graph.threads.wait(lambda: False)

        self._fleet_node = self.graph.start("/vehicles", main)

    def ask(self, name):
        """Call a service in the background; return a list that takes its response."""
        responses = []
        self.graph.start("/person", lambda: responses.append(self.call(name)))
        return responses

    def _move(self):
        self.hear_events()
        for number in range(VEHICLES):
            rospy.Subscriber(f"/cmd_vel{number}", Twist, self._on_command, number)
            rospy.Subscriber(f"/odom{number}", Odometry, self._on_odometry, number)
        while True:
            advance(self.bodies, self.vehicles, STEP_S)
            for radio in self.radios:
                radio.exchange()
            self.on_step()
            self.graph.threads.sleep(STEP_S)

    def _on_command(self, _, number):
        self.commanded_s[number] = self.graph.threads.now_s

    def _on_odometry(self, message, number):
        self.odometry_s[number] = message.header.stamp.to_sec()
