"""Node `vehicle`: the bridge of one vehicle of any kind.

One thread reads the link and publishes the estimates as they come. The main thread ticks the state
machine and sends. A velocity command is sent on from the callback that receives it.
"""

from __future__ import annotations

import math
import sys
import threading
import time
from typing import Callable, Dict, List, Optional, Tuple

import rospy
from actionlib_msgs.msg import GoalStatus, GoalStatusArray
from geometry_msgs.msg import Twist
from std_msgs.msg import Empty
from std_srvs.srv import Trigger, TriggerRequest, TriggerResponse
from tf2_msgs.msg import TFMessage

from quad_nav.errors import InputError, excerpt, printable
from quad_nav.files.values import is_whole
from quad_nav.geometry import Scan
from quad_nav.mission.respawn import RESPAWNED
from quad_nav.ros.common.conversions import pose_from_transform, twist_from_message
from quad_nav.ros.common.diagnostics import ThrottledWarnings, publish_health
from quad_nav.ros.common.readiness import init_node
from quad_nav.ros.common.rospy_repairs import sender_of
from quad_nav.topics.health import Health
from quad_nav.topics.validation import CommandLease, pose_problem, twist_problem
from quad_nav.topics.vehicle_states import IN_FLIGHT, State
from quad_vehicles import crazyflie_adapter
from quad_vehicles.autopilots import AUTOPILOTS
from quad_vehicles.crazyflie_link import CrazyflieLink
from quad_vehicles.link import VehicleLink
from quad_vehicles.localizers import name_of
from quad_vehicles.mavlink_link import MavlinkLink
from quad_vehicles.orders import Permissions, Response
from quad_vehicles.ros.maneuvers import (
    LAND,
    LAND_TYPES,
    RESUMPTION,
    TAKE_OFF,
    TAKE_OFF_TYPES,
    Maneuver,
    ManeuverAction,
)
from quad_vehicles.ros.topics import MissionPause, VehicleTopics, vehicle_health
from quad_vehicles.safety import COMMAND_HOVER_S
from quad_vehicles.states import VehicleMachine
from quad_vehicles.telemetry import Estimate
from quad_vehicles.vehicle_file import FIXED, Vehicle, load_vehicles

TICK_S = 0.025
READ_S = 0.1
STATE_PERIOD_S = 1.0
MANEUVER_WAIT_S = 30.0
SHUTDOWN_WAIT_S = 12.0
"""For a vehicle that needs us until it is down; roslaunch kills nodes after 15 s."""
LAND_ALL_TOPIC = "/vehicles/land_all"
_TF = {"/tf": 0.0, "/tf_static": math.inf}  # how long a transform holds, s
_BUSY = (GoalStatus.PENDING, GoalStatus.ACTIVE, GoalStatus.PREEMPTING, GoalStatus.RECALLING)


class VehicleNode:
    """Topics and services of one vehicle."""

    def __init__(self, vehicle: Vehicle, bridge: VehicleLink, respawned: bool = False) -> None:
        """Advertise everything.

        Args:
            vehicle: The vehicle.
            bridge: Its connection.
            respawned: Whether the bridge before was killed.
        """
        i = vehicle.number
        self._vehicle, self._bridge = vehicle, bridge
        self._topics = VehicleTopics(vehicle, respawned)
        self._pause = MissionPause(i, lambda: bridge.machine.state is State.TAKEN_OVER)
        self._lease = CommandLease(COMMAND_HOVER_S)
        self._warnings, self._texts = ThrottledWarnings(), ThrottledWarnings()
        self._state: Optional[Tuple[State, str]] = None
        self._next_state_s = 0.0
        self._subscribers = [
            rospy.Subscriber(f"/cmd_vel{i}", Twist, self._follow, queue_size=1, tcp_nodelay=True),
            rospy.Subscriber(
                f"/move_base{i}/status", GoalStatusArray, self._on_navigator, queue_size=1
            ),
            rospy.Subscriber(LAND_ALL_TOPIC, Empty, self._land_all, queue_size=1),
        ]
        for topic, lasts_s in _TF.items() if vehicle.localization != FIXED else ():
            self._subscribers.append(
                rospy.Subscriber(topic, TFMessage, self._on_transforms, lasts_s, queue_size=100)
            )
        self._services = [
            rospy.Service(f"/vehicle{i}/{name}", Trigger, handler)
            for name, handler in (
                ("take_off", self._take_off),
                ("land", self._land),
                ("resume", self._resume),
            )
        ]
        self._actions = [
            ManeuverAction(f"/vehicle{i}/take_off", TAKE_OFF_TYPES, TAKE_OFF, bridge, self._warn),
            ManeuverAction(f"/vehicle{i}/land", LAND_TYPES, LAND, bridge, self._warn),
        ]
        publish_health(self._health)

    def run(self) -> None:
        """Run until ROS shuts down."""
        reader = threading.Thread(target=self._read, name="link", daemon=True)
        reader.start()
        next_s = time.monotonic()
        while not rospy.is_shutdown():
            if not reader.is_alive():
                raise RuntimeError(f"{self._vehicle.name}: the thread that reads the link has died")
            self._tick()
            next_s = max(next_s + TICK_S, time.monotonic())
            time.sleep(max(next_s - time.monotonic(), 0.0))

    def stop(self) -> None:
        """Land before the node shuts down: without us the autopilot's failsafe would."""
        with self._bridge.lock:
            machine = self._bridge.machine
            if machine.state in IN_FLIGHT and machine.state is not State.LANDING:
                machine.land(time.monotonic(), "the bridge shuts down")
        end_s = time.monotonic() + SHUTDOWN_WAIT_S
        while time.monotonic() < end_s and self._is_flying():
            time.sleep(TICK_S)

    def _is_flying(self) -> bool:
        with self._bridge.lock:
            machine = self._bridge.machine
            status = machine.inputs.status
            if machine.state not in IN_FLIGHT or status is None:
                return False
            return not (status.is_landing and machine.traits.lands_by_itself)

    # The link's thread.

    def _read(self) -> None:
        published: Optional[Estimate] = None
        scanned: Optional[Scan] = None
        while not rospy.is_shutdown():
            try:
                self._bridge.read(READ_S)
                with self._bridge.lock:
                    estimate, scan = self._bridge.estimate, self._bridge.scan
                if estimate is not None and estimate is not published:
                    published = estimate
                    self._topics.publish_estimate(estimate, self._bridge.machine)
                if scan is not None and scan is not scanned:
                    scanned = scan
                    self._topics.publish_scan(scan)
            except Exception as error:  # nothing that comes ends the flight
                if not rospy.core.is_shutdown_requested():  # at shutdown rospy closes the topics
                    name = self._vehicle.name
                    self._warnings.error(f"{name}: link: {type(error).__name__}: {error}; going on")
                    time.sleep(TICK_S)

    # The main thread.

    def _tick(self) -> None:
        output = self._bridge.tick()
        for action in self._actions:
            action.poll()
        if output.pauses_mission:
            self._pause.pause()
        for line in output.news:
            log = rospy.logwarn if output.pauses_mission else rospy.loginfo
            log("%s: %s", self._vehicle.name, excerpt(line))
        with self._bridge.lock:
            texts = self._bridge.pop_texts()
            machine = self._bridge.machine
            self._topics.starts.update(machine)
            state = (machine.state, machine.reason)
        for severity, text in texts:
            log = rospy.logwarn if severity <= 4 else rospy.loginfo
            self._texts.log(log, f"{self._vehicle.name}: autopilot: {excerpt(text)}")
        now_s = time.monotonic()
        if state != self._state or now_s >= self._next_state_s:
            self._state, self._next_state_s = state, now_s + STATE_PERIOD_S
            self._topics.publish_state(machine)

    def _health(self) -> List[Health]:
        with self._bridge.lock:
            return [vehicle_health(self._vehicle, self._bridge.machine)]

    # Callbacks.

    def _follow(self, message: Twist) -> None:
        twist = twist_from_message(message)
        problem = twist_problem(twist)
        if not problem:
            node = excerpt(sender_of(message) or "an unnamed node")
            holder = self._lease.holder(self._vehicle.number, node, time.monotonic())
            if holder == node:
                self._bridge.follow(twist)
                return
            problem = f"from {node}: {holder} controls this vehicle, expected one node at a time"
        self._warn(f"command dropped: {problem}")

    def _warn(self, line: str) -> None:
        self._warnings.warn(f"{self._vehicle.name}: {line}")

    def _on_navigator(self, message: GoalStatusArray) -> None:
        if not any(status.status in _BUSY for status in message.status_list):
            with self._bridge.lock:
                self._bridge.machine.inputs.take_idle(time.monotonic())

    def _on_transforms(self, message: TFMessage, lasts_s: float) -> None:
        """Take the pose of the odometry frame from whoever localizes the vehicle."""
        for one in message.transforms:
            if one.child_frame_id.lstrip("/") == f"odom{self._vehicle.number}":
                pose = pose_from_transform(one)
                problem = pose_problem(pose)
                if problem:
                    self._warn(f"transform of {one.child_frame_id} dropped: {problem}")
                    continue
                with self._bridge.lock:
                    inputs = self._bridge.machine.inputs
                    inputs.take_frame(pose.to_2d(), time.monotonic() + lasts_s)

    def _land_all(self, _: Empty) -> None:
        with self._bridge.lock:
            self._bridge.machine.land(time.monotonic(), "all vehicles land", is_stop_all=True)

    def _land(self, _: TriggerRequest) -> TriggerResponse:
        """Begin to land; the action waits for the end."""
        with self._bridge.lock:
            return _reply(LAND.begin(self._bridge.machine, time.monotonic()))

    def _resume(self, _: TriggerRequest) -> TriggerResponse:
        """Take control again, and resume the mission."""
        with self._bridge.lock:
            machine = self._bridge.machine
            if machine.state is State.TAKEN_OVER and self._topics.is_lost(machine):
                return TriggerResponse(False, "its place in map is not known: land it")
        response = self._finish(RESUMPTION)
        if response.is_accepted:
            self._pause.resume()
        return _reply(response)

    def _take_off(self, _: TriggerRequest) -> TriggerResponse:
        """Take off, and respond when the vehicle hovers or has given up."""
        return _reply(self._finish(TAKE_OFF))

    def _finish(self, maneuver: Maneuver) -> Response:
        """Begin a maneuver, and wait for its end."""
        machine = self._bridge.machine
        with self._bridge.lock:
            response = maneuver.begin(machine, time.monotonic())
        if not response.is_accepted:
            return response
        end_s = time.monotonic() + MANEUVER_WAIT_S
        while time.monotonic() < end_s and not rospy.is_shutdown():
            with self._bridge.lock:
                outcome = maneuver.outcome(machine)
            if outcome is not None:
                return outcome
            time.sleep(TICK_S)
        return Response(False, f"still {machine.state.value} after {MANEUVER_WAIT_S:g} s")


def _reply(response: Response) -> TriggerResponse:
    return TriggerResponse(response.is_accepted, response.text)


def read_vehicle(parameters: Dict) -> Tuple[Vehicle, Permissions]:
    """Read the vehicle that a node's private parameters name.

    Raises:
        InputError: Parameters or the file of the vehicles are not valid.
    """
    name = rospy.get_name().lstrip("/")
    problems = [
        f"{name}: {key}: is {parameters.get(key)!r}; expected {what}"
        for key, what, is_sound in (
            ("vehicles", "the file of the vehicles", isinstance(parameters.get("vehicles"), str)),
            ("number", "the number of a vehicle", is_whole(parameters.get("number"))),
            ("arm", "true or false", isinstance(parameters.get("arm", False), bool)),
            ("dry", "true or false", isinstance(parameters.get("dry", False), bool)),
        )
        if not is_sound
    ]
    if problems:
        raise InputError(problems)
    vehicles = {one.number: one for one in load_vehicles(parameters["vehicles"])}
    if parameters["number"] not in vehicles:
        raise InputError([f"{name}: number: {parameters['number']}, expected one of the file's"])
    permissions = Permissions(parameters.get("arm", False), parameters.get("dry", False))
    return vehicles[parameters["number"]], permissions


def make_bridge(
    vehicle: Vehicle, permissions: Permissions, clock: Callable[[], float]
) -> VehicleLink:
    """Open the connection of a vehicle.

    Args:
        vehicle: The vehicle.
        permissions: What the person at the desk allows.
        clock: Returns monotonic time in s.

    Raises:
        InputError: If a package is missing, or the address cannot be opened.
    """
    is_crazyflie = vehicle.kind == "crazyflie"
    traits = crazyflie_adapter.TRAITS if is_crazyflie else AUTOPILOTS[vehicle.autopilot].traits
    machine = VehicleMachine(
        vehicle.altitude_m, vehicle.limits, traits, permissions, name_of(vehicle)
    )
    if is_crazyflie:
        return CrazyflieLink(vehicle, machine, clock)
    return MavlinkLink(vehicle, machine, clock)


def main() -> int:
    """Run the node of one vehicle.

    Returns:
        0 after a shutdown, 2 if parameters or files are not valid.
    """
    nodes: List[VehicleNode] = []

    def land() -> None:
        for node in nodes:
            node.stop()

    init_node("vehicle", land)
    try:
        vehicle, permissions = read_vehicle(rospy.get_param("~", {}))
        if vehicle.kind == "simulated":
            rospy.loginfo("%s: the node vehicles flies it", vehicle.name)
            return 0
        bridge = make_bridge(vehicle, permissions, time.monotonic)
    except InputError as error:
        rospy.logfatal("%s", printable(error, "\n"))
        return 2
    nodes.append(VehicleNode(vehicle, bridge, RESPAWNED in sys.argv))
    try:
        nodes[0].run()
    except rospy.ROSException:
        if not rospy.core.is_shutdown_requested():  # at shutdown rospy closes the topics
            raise
    finally:
        bridge.close()
    return 0
