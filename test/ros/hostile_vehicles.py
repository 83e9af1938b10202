"""Nodes `vehicle`, with a stand-in on a virtual clock, and `vehicles`, for `hostile_messages`."""

from __future__ import annotations

import math
import sys
import threading
from pathlib import Path
from types import SimpleNamespace
from typing import Dict
from unittest import mock

import genpy
import rospy
from actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from fake_ros import FakePublisher, FakeRos, FakeService, deliver
from geometry_msgs.msg import Twist, Vector3
from own_messages import event_message, state_message
from quad.msg import TakeOffActionGoal, VehicleState
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Empty

sys.path.insert(1, str(Path(__file__).resolve().parents[1]))
from vehicles.virtual_flight import Flight  # noqa: E402

from quad_nav.geometry import Pose2D
from quad_nav.mission.actions import Event
from quad_nav.topics.vehicle_states import State
from quad_vehicles.orders import Output
from quad_vehicles.ros import fleet, maneuvers, node, topics
from quad_vehicles.vehicle_file import Lidar, Vehicle

DRIVER_TOPIC = "/rplidar/scan"
START = Pose2D(1.5, 1.5, 0.0)


class VirtualBridge:
    """The connection of the node, to a vehicle on a virtual clock."""

    def __init__(self) -> None:
        self.flight = Flight().to_hover()
        self.lock = threading.Lock()
        self.machine = self.flight.machine
        self.scan = None

    @property
    def estimate(self):
        return self.flight.adapter.estimate

    def pop_texts(self):
        return self.flight.adapter.pop_texts()

    def tick(self) -> Output:
        """Let 10 ms pass; assert that only finite numbers within the limits have left."""
        told, sent = len(self.flight.news), len(self.flight.sent)
        self.flight._step()
        self._check(sent)
        return Output(news=tuple(line for _, line in self.flight.news[told:]))

    def follow(self, twist) -> bool:
        is_finite, messages = self.flight.adapter.follow(twist, self.flight.now_s)
        sent = len(self.flight.sent)
        self.flight.sent += [(self.flight.now_s, *message) for message in messages]
        self._check(sent)
        for message in messages:
            self.flight.vehicle.receive(*message)
        return is_finite

    def _check(self, first: int) -> None:
        for _, name, fields in self.flight.sent[first:]:
            numbers = [value for value in fields.values() if isinstance(value, (int, float))]
            assert all(map(math.isfinite, numbers)), (name, fields)
            if name == "SET_POSITION_TARGET_LOCAL_NED":
                assert math.hypot(fields["vx"], fields["vy"]) <= 1.0 + 1e-9, fields


class VehicleUnderTest:
    """The node `vehicle` of robot 0, which hovers."""

    def __init__(self, ros: FakeRos) -> None:
        """Take off."""
        self._bridge = VirtualBridge()
        clock = SimpleNamespace(monotonic=lambda: self.now_s, time=lambda: self.now_s)
        clock.sleep = lambda _: self._node._tick()
        for module in (node, topics, maneuvers):
            patch = mock.patch.object(module, "time", clock)
            patch.start()
            ros.exit_stack.callback(patch.stop)
        lidar = Lidar(topic=DRIVER_TOPIC)
        vehicle = Vehicle(0, "mavlink", lidar=lidar, map_from_start=START)
        with mock.patch.object(node, "MissionPause"):  # there is no sequencer
            self._node = node.VehicleNode(vehicle, self._bridge)
        self.valid = {
            "/cmd_vel0": self._command,
            "/move_base0/status": self._status,
            node.LAND_ALL_TOPIC: Empty,
            DRIVER_TOPIC: self._scan,
            "/vehicle0/take_off/goal": self._goal,
            "/vehicle0/take_off/cancel": self._cancel,
            "/vehicle0/land/goal": self._goal,
            "/vehicle0/land/cancel": self._cancel,
        }

    @property
    def now_s(self) -> float:
        """The virtual clock."""
        return self._bridge.flight.now_s

    def settle(self) -> None:
        """Let 10 ms pass: less than 0.5 s between two flights by good commands."""
        self._node._tick()

    def fly(self) -> None:
        """Fly by good commands for 0.1 s."""
        for _ in range(10):
            deliver("/cmd_vel0", self._command(), "/move_base0")
            self._node._tick()

    def recover(self) -> None:
        """After a landing take off again; good commands move the vehicle."""
        machine = self._bridge.machine
        for _ in range(6000):
            if machine.state in (State.LANDED, State.READY):
                machine.take_off(self.now_s)
            if machine.state in (State.HOLDING, State.FLYING):
                break
            self._node._tick()
        for _ in range(30):
            self.fly()
        assert machine.state is State.FLYING, (machine.state, machine.reason)
        last = self._bridge.flight.setpoints_since(self.now_s - 0.1)[-1]
        assert abs(last["yaw_rate"] + 0.2) < 1e-9, last

    def untouched(self, number: int) -> bool:
        """There is one vehicle."""
        return True

    def requests(self) -> Dict[str, genpy.Message]:
        """Return a request for each service."""
        return {name: one.service_class._request_class() for name, one in FakeService.all.items()}

    def _command(self) -> Twist:
        return Twist(Vector3(0.0, 0.0, 0.0), Vector3(0.0, 0.0, 0.2))

    def _status(self) -> GoalStatusArray:
        return GoalStatusArray(status_list=[GoalStatus(status=GoalStatus.ACTIVE)])

    def _goal(self) -> TakeOffActionGoal:
        return TakeOffActionGoal(goal_id=self._cancel())

    def _cancel(self) -> GoalID:
        return GoalID(rospy.Time.now(), f"test {self.now_s}")

    def _scan(self) -> LaserScan:
        return LaserScan(angle_increment=0.5, range_max=8.0, ranges=[1.0] * 12)


class FleetUnderTest:
    """The node `vehicles` of two vehicles in the air."""

    def __init__(self, ros: FakeRos) -> None:
        """Advertise everything."""
        self.now_s = 1.0
        vehicles = [Vehicle(k, "mavlink", map_from_start=START) for k in (0, 1)]
        with mock.patch.object(fleet.threading, "Timer") as self._timer:
            self._node = fleet.VehicleFleet(vehicles, lands_when_done=True)
        patch = mock.patch.object(fleet.threading, "Timer", self._timer)
        patch.start()
        ros.exit_stack.callback(patch.stop)
        self.valid = {
            "/vehicle0/state": self._state,
            "/vehicle1/state": self._state,
            fleet.EVENTS_TOPIC: lambda: event_message(0, Event.SENT),
        }

    def settle(self) -> None:
        """It has no loop."""

    def fly(self) -> None:
        """It has no loop."""

    def recover(self) -> None:
        """A landing in good messages is heard, and the end of both missions lands all."""
        deliver("/vehicle0/state", self._state())
        deliver("/vehicle1/state", state_message("landed"))
        assert self._node._is_in_the_air(0) and not self._node._is_in_the_air(1)
        for robot in (0, 1):
            deliver(fleet.EVENTS_TOPIC, event_message(robot, Event.SENT))
        before = self._timer.call_count
        for robot in (0, 7, 0):  # 7 is no robot of this fleet
            deliver(fleet.EVENTS_TOPIC, event_message(robot, Event.DONE))
        assert self._timer.call_count == before
        deliver(fleet.EVENTS_TOPIC, event_message(1, Event.DONE))
        assert self._timer.call_count == before + 1
        assert FakePublisher.all[node.LAND_ALL_TOPIC]

    def untouched(self, number: int) -> bool:
        """States do not mix: `recover` asserts it."""
        return True

    def requests(self) -> Dict[str, genpy.Message]:
        """Their requests are empty, and they wait for vehicles."""
        return {}

    def _state(self) -> VehicleState:
        return state_message("flying")
