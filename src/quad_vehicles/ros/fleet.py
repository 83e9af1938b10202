"""Node `vehicles`: what concerns all vehicles together, in the simulator's place.

It takes all vehicles off when the mission starts, lands them when it has ended or when somebody
asks for it, and publishes the scene. The vehicles fly on without it.
"""

from __future__ import annotations

import math
import threading
import time
from functools import partial
from typing import Any, Dict, List, Mapping, Optional, Sequence, Set, Tuple

import rospy
from quad.msg import MissionEvent, VehicleState
from std_msgs.msg import Empty
from std_srvs.srv import Trigger, TriggerRequest, TriggerResponse

from quad_nav.errors import InputError, printable
from quad_nav.files.values import (
    BOOLEAN,
    Rule,
    choice,
    number,
    optional,
    text,
    value_faults,
)
from quad_nav.mission.actions import Event
from quad_nav.ros.common.diagnostics import ThrottledWarnings
from quad_nav.ros.common.readiness import init_node
from quad_nav.sim.lidar import LidarParams
from quad_nav.sim.scene import Scene
from quad_nav.sim.scene_file import load_scene, outside_problem
from quad_nav.topics.mission_events import EVENTS_TOPIC, mission_event_from_message
from quad_nav.topics.vehicle_states import IN_FLIGHT, ON_GROUND, State, state_from_message
from quad_vehicles.ros.node import LAND_ALL_TOPIC
from quad_vehicles.ros.scene_topics import PoseListener, SceneLidars, SceneTopics
from quad_vehicles.ros.topics import call_trigger
from quad_vehicles.starts import starts_of
from quad_vehicles.vehicle_file import AMCL, FIXED, LOCALIZATIONS, Vehicle, load_vehicles

READY_WAIT_S = 90.0
"""Longest wait for all vehicles to be ready: a GPS takes 45 s from its start."""
CALL_WAIT_S = 40.0
LAND_WAIT_S = 30.0
LAND_AFTER_S = 1.0
_IN_THE_AIR = (*IN_FLIGHT, State.TAKEN_OVER)
_CAN_FLY = (State.READY, State.LANDED, State.FLYING, State.HOLDING)
SILENT_S = 3.0
"""Bridges publish their states once a second; one that is silent for this long has died."""
_DEFAULTS: Dict[str, Any] = {
    "vehicles": "",
    "scene": "",
    "localization": "",
    "lidar_for": "none",
    "lidar_rate": 10.0,
    "scan_range": LidarParams().scan_range_rad,
    "step_size": LidarParams().step_size_rad,
    "range_noise": 0.0,
    "map_resolution": 0.0,
    "land_when_done": True,
}
_RULES: Dict[str, Rule] = {
    "vehicles": text("the file of the vehicles"),
    "scene": optional(text("a scene's file")),
    "localization": optional(choice(LOCALIZATIONS)),
    "lidar_for": choice(("none", "vehicles")),
    "lidar_rate": number(above=0.0, at_most=100.0, unit="Hz"),
    "scan_range": number(above=0.0, unit="radians"),
    "step_size": number(above=0.0, unit="radians"),
    "range_noise": number(at_least=0.0, unit="metres"),
    "map_resolution": number(at_least=0.0, unit="metres"),
    "land_when_done": BOOLEAN,
}


class VehicleFleet:
    """Services for all vehicles."""

    def __init__(self, vehicles: Sequence[Vehicle], lands_when_done: bool) -> None:
        """Advertise everything.

        Args:
            vehicles: All vehicles of the file.
            lands_when_done: Whether to land when the missions of all robots have ended.
        """
        self._real = [one for one in vehicles if one.kind != "simulated"]
        self._robots = len(vehicles)
        self._done: Set[int] = set()
        self._lands_when_done = lands_when_done
        self._states: Dict[int, Tuple[State, str, float]] = {}  # state, reason, monotonic time
        self._warnings = ThrottledWarnings()
        self._lock = threading.Lock()
        self._is_over = False  # the missions of all that fly for them
        self._land_all = rospy.Publisher(LAND_ALL_TOPIC, Empty, queue_size=1)
        self._subscribers = [
            rospy.Subscriber(
                f"/vehicle{one.number}/state", VehicleState, self._on_state, one.number
            )
            for one in self._real
        ]
        self._events = rospy.Subscriber(EVENTS_TOPIC, MissionEvent, self._on_event, queue_size=100)
        self._services = [
            rospy.Service("/vehicles/take_off", Trigger, self._take_off),
            rospy.Service("/vehicles/land", Trigger, self._land),
        ]

    def _on_state(self, message: VehicleState, number: int) -> None:
        try:
            state = state_from_message(message)
        except ValueError as error:
            self._warnings.warn(f"/vehicle{number}/state: message dropped: {error}")
            return
        self._states[number] = state, message.reason, time.monotonic()
        self._land_at_end()

    def _on_event(self, message: MissionEvent) -> None:
        try:
            event = mission_event_from_message(message, message.header.stamp.to_sec())
        except ValueError as error:
            self._warnings.warn(f"{EVENTS_TOPIC}: message dropped: {error}")
            return
        if event.robot >= self._robots:
            return
        (self._done.add if event.event is Event.DONE else self._done.discard)(event.robot)
        self._land_at_end()

    def _land_at_end(self) -> None:
        """Land once when every robot has flown all its goals, or does not fly for its mission."""
        with self._lock:
            was_over = self._is_over
            self._is_over = bool(self._done) and all(
                robot in self._done or self._is_away(robot) for robot in range(self._robots)
            )
            is_end = self._is_over and not was_over and self._lands_when_done
        if is_end:
            rospy.loginfo("vehicles: all missions have ended; landing")
            threading.Timer(LAND_AFTER_S, self._land_all.publish, (Empty(),)).start()

    def _is_away(self, robot: int) -> bool:
        """Return whether a pilot has a vehicle, or it stands on the ground, its mission stopped."""
        is_down = self._is(robot, *ON_GROUND)
        return self._is(robot, State.TAKEN_OVER) or (is_down and _is_stopped(robot))

    def _land(self, _: TriggerRequest) -> TriggerResponse:
        """Land all vehicles, and respond when none is in the air, or nothing is known of them."""
        self._land_all.publish(Empty())
        end_s = time.monotonic() + LAND_WAIT_S
        while time.monotonic() < end_s and not rospy.is_shutdown():
            flying = [one for one in self._real if self._is_in_the_air(one.number)]
            if not flying:
                return TriggerResponse(True, "all vehicles have landed")
            if all(self._is_silent(one.number) for one in flying):
                break
            time.sleep(0.1)
        states = (f"{one.name} ({self._state(one.number)})" for one in flying)
        return TriggerResponse(False, f"still in the air: {', '.join(states)}")

    def _is_in_the_air(self, number: int) -> bool:
        """Return whether a vehicle was in the air when its bridge told its state last."""
        return self._is(number, *_IN_THE_AIR)

    def _is(self, number: int, *states: State) -> bool:
        """Return whether a vehicle is in one of some states, as its bridge told last."""
        return number in self._states and self._states[number][0] in states

    def _is_silent(self, number: int) -> bool:
        told_s = self._states[number][2] if number in self._states else -math.inf
        return time.monotonic() - told_s > SILENT_S

    def _state(self, number: int) -> str:
        """Describe the state of a vehicle; that of a bridge that has died is not known."""
        if number not in self._states:
            return "no bridge"
        state, reason, _ = self._states[number]
        text = state.value + (f": {reason}" if reason else "")
        return f"its bridge is silent, last state: {text}" if self._is_silent(number) else text

    def _take_off(self, _: TriggerRequest) -> TriggerResponse:
        """Take all vehicles off when all are ready; land all if one refuses.

        A vehicle is left out that a pilot has taken over, or whose mission is stopped meanwhile.
        """
        left_out: Dict[str, str] = {}
        landings: List[Empty] = []
        orders = rospy.Subscriber(LAND_ALL_TOPIC, Empty, landings.append, queue_size=1)
        problems = self._wait_ready(left_out, landings)
        if not problems:
            chosen = [one for one in self._real if one.name not in left_out]
            refused = self._call_all("take_off", chosen)
            taken_over = State.TAKEN_OVER.value
            for name in [one for one, text in refused.items() if text.startswith(taken_over)]:
                left_out[name] = refused.pop(name)
            problems = _lines(refused) + _ordered(landings)
            if problems:
                self._land_all.publish(Empty())
        orders.unregister()
        if not problems and len(left_out) == self._robots:
            problems = ["no vehicle is left to take off"]
        text = "; ".join(problems) or "all vehicles are in the air"
        if left_out:
            text += f"; left out: {'; '.join(_lines(left_out))}"
        return TriggerResponse(not problems, text)

    def _wait_ready(self, left_out: Dict[str, str], landings: Sequence[Empty]) -> List[str]:
        """Wait until every vehicle is ready or in the air; return why not.

        Args:
            left_out: Gets the vehicles that do not take off, with the reasons.
            landings: Orders to land all that come meanwhile.
        """
        end_s = time.monotonic() + READY_WAIT_S
        names = {one.number: one.name for one in self._real}
        were_stopped = set(filter(_is_stopped, names))
        while not rospy.is_shutdown():
            missing = {}
            for robot, name in names.items():
                text = self._state(robot)
                if self._is(robot, State.TAKEN_OVER):
                    left_out[name] = text
                elif name not in left_out and (
                    self._is_silent(robot) or not self._is(robot, *_CAN_FLY)
                ):
                    missing[name] = text
            if landings or not missing:
                stopped = set(filter(_is_stopped, names)) - were_stopped
                left_out.update({names[one]: "its mission was stopped" for one in sorted(stopped)})
                return _ordered(landings)
            if time.monotonic() > end_s:
                return _lines(missing)
            time.sleep(0.1)
        return ["shutdown"]

    def _call_all(self, action: str, vehicles: Sequence[Vehicle]) -> Dict[str, str]:
        """Call a service of some vehicles at the same time; return the refusals by their names."""
        refused = {one.name: f"no response within {CALL_WAIT_S:g} s" for one in vehicles}

        def call(vehicle: Vehicle) -> None:
            problem = call_trigger(f"/vehicle{vehicle.number}/{action}")
            if problem:
                refused[vehicle.name] = problem
            else:
                del refused[vehicle.name]

        threads = [threading.Thread(target=call, args=(one,), daemon=True) for one in vehicles]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(CALL_WAIT_S)
        return dict(refused)


def _lines(texts: Mapping[str, str]) -> List[str]:
    return [f"{name}: {text}" for name, text in texts.items()]


def _ordered(landings: Sequence[Empty]) -> List[str]:
    return ["all vehicles were ordered to land meanwhile"] if landings else []


def _is_stopped(robot: int) -> bool:
    """Return whether the mission of a robot is stopped."""
    return rospy.get_param(f"/mission/quad{robot}/stopped", False) is True


def read_setup(
    parameters: Mapping[str, Any], name: str
) -> Tuple[Dict[str, Any], Tuple[Vehicle, ...], Optional[Scene]]:
    """Read the node's private parameters, the vehicles and the scene.

    Raises:
        InputError: Every fault.
    """
    values = {**_DEFAULTS, **parameters}
    problems = value_faults(values, _RULES, name)
    vehicles: Tuple[Vehicle, ...] = ()
    scene: Optional[Scene] = None
    try:
        scene = load_scene(values["scene"]) if values["scene"] and not problems else None
    except InputError as error:
        problems += error.problems
    room = None if scene is None else partial(outside_problem, scene)
    try:
        vehicles = load_vehicles(values["vehicles"], room) if not problems else ()
        if scene is not None:
            starts_of(scene, vehicles)
    except InputError as error:
        problems += error.problems
    if values["lidar_for"] == "vehicles" and not values["scene"]:
        problems.append(f"{name}: lidar_for: vehicles needs a scene")
    if any(one.kind == "simulated" for one in vehicles) and not values["scene"]:
        problems.append(f"{name}: vehicles of kind simulated need a scene")
    problems += _localization_faults(values, vehicles, name)
    if problems:
        raise InputError(problems)
    return values, vehicles, scene


def _localization_faults(
    values: Mapping[str, Any], vehicles: Sequence[Vehicle], name: str
) -> List[str]:
    """Return how the node's parameters contradict the file, which says the same for all."""
    faults = []
    for one in vehicles[:1]:
        if values["localization"] not in ("", one.localization):
            given = f"{name}: localization {values['localization']}"
            faults.append(f"{given}, expected {one.localization}, as the file of the vehicles says")
        if one.localization == AMCL and not (one.map_file or values["scene"]):
            faults.append(f"{name}: localization amcl, expected map in the file, or a scene")
    return faults


def _poses(vehicles: Sequence[Vehicle]) -> PoseListener:
    """Listen to the poses of all vehicles."""
    localized = (one for one in vehicles if one.localization != FIXED and one.kind != "simulated")
    starts = {one.number: one.map_from_start for one in localized if one.map_from_start}
    return PoseListener(len(vehicles), starts)


def main() -> int:
    """Run the node.

    Returns:
        0 after a shutdown, 2 if parameters or files are not valid.
    """
    init_node("vehicles")
    try:
        values, vehicles, scene = read_setup(rospy.get_param("~", {}), "vehicles")
        lidar = LidarParams(
            values["scan_range"], values["step_size"], noise_std_m=values["range_noise"]
        )
    except InputError as error:
        rospy.logfatal("%s", printable(error, "\n"))
        return 2
    topics = SceneTopics(scene, len(vehicles), values["map_resolution"]) if scene else None
    fleet = VehicleFleet(vehicles, values["land_when_done"])
    lidars: Optional[SceneLidars] = None
    bodies: Any = None
    sees_scene = values["lidar_for"] == "vehicles"
    scanned = [one.number for one in vehicles if sees_scene or one.kind == "simulated"]
    if scene is not None and scanned:
        poses = _poses(vehicles)
        lidars = SceneLidars(scene, poses, scanned, lidar)
        from quad_vehicles.ros.simulated import SimulatedVehicles  # it loads the physics engine

        try:
            bodies = SimulatedVehicles(scene, vehicles, poses, sees_scene, time.monotonic())
        except InputError as error:
            rospy.logfatal("%s", printable(error, "\n"))
            return 2
    _run(lidars, bodies, 1.0 / values["lidar_rate"])
    del fleet, topics
    return 0


def _run(lidars: Optional[SceneLidars], bodies: Any, scan_period_s: float) -> None:
    """Advance the bodies and publish the scans until ROS shuts down."""
    next_s = next_scan_s = time.monotonic()
    tick_s = scan_period_s if bodies is None else bodies.tick_s
    while not rospy.is_shutdown():
        now_s = time.monotonic()
        if bodies is not None:
            bodies.advance(now_s)
        if lidars is not None and now_s >= next_scan_s:
            next_scan_s = max(next_scan_s + scan_period_s, now_s)
            lidars.publish()
        next_s = max(next_s + tick_s, now_s)
        time.sleep(max(next_s - time.monotonic(), 0.0))
    if bodies is not None:
        bodies.close()
