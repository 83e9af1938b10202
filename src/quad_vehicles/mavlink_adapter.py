"""Translate between MAVLink's messages and the state machine, without a socket.

Messages are names and fields, so that recordings can take the place of an autopilot.
"""

from __future__ import annotations

import math
from dataclasses import replace
from types import MappingProxyType
from typing import Any, Callable, Dict, List, Mapping, Optional, Set, Tuple

from quad_nav.errors import printable
from quad_nav.geometry import Quaternion
from quad_nav.topics.vehicle_states import IN_FLIGHT, State
from quad_vehicles import failsafes
from quad_vehicles.adapter import VehicleAdapter
from quad_vehicles.autopilots import AUTOPILOT_COMPONENT, AUTOPILOTS
from quad_vehicles.exchanges import BEGIN_S, ClockSync, Message, MessageRates, Parameters
from quad_vehicles.frames import (
    enu_from_flu,
    enu_from_ned,
    flu_from_frd,
    mavlink_quaternion,
    scan_from_obstacle_distance,
)
from quad_vehicles.health_watch import HealthWatch
from quad_vehicles.orders import Answer, Order, Output
from quad_vehicles.ranges import MAVLINK
from quad_vehicles.setpoints import led, limited, setpoint_fields
from quad_vehicles.states import VehicleMachine
from quad_vehicles.telemetry import Estimate, Landed, Velocity
from quad_vehicles.vehicle_file import Vehicle

ESTIMATE_HZ = 30.0
ESTIMATOR_HZ = 5.0
HEARTBEAT_PERIOD_S = 1.0
ANSWER_WAIT_S = 0.2
"""A refusal waits this long for the texts with its reasons, which come after it."""
_RATES_HZ: Mapping[int, Tuple[str, float]] = MappingProxyType(
    {
        32: ("LOCAL_POSITION_NED", ESTIMATE_HZ),
        30: ("ATTITUDE", ESTIMATE_HZ),
        245: ("EXTENDED_SYS_STATE", 5.0),
        1: ("SYS_STATUS", 1.0),
        65: ("RC_CHANNELS", 5.0),
        24: ("GPS_RAW_INT", ESTIMATOR_HZ),
    }
)
_DISTANCE_RATE = {330: ("OBSTACLE_DISTANCE", 10.0)}
_PREARM_CHECK = 1 << 28  # MAV_SYS_STATUS_PREARM_CHECK
_STATION_S = 5.0
"""A ground station that has not been heard for this long has gone."""
_ATTITUDE_S = 0.2  # oldest attitude that belongs to a position
_STICKS = MappingProxyType({1: "roll", 2: "pitch", 3: "throttle", 4: "yaw"})
_STICK_US, _VALID_US = 120, (900, 2100)
_IN_PROGRESS = 5  # MAV_RESULT
# A ground station without an autopilot, active: both autopilots' failsafes count its heartbeats.
_OUR_TYPE, _NO_AUTOPILOT, _ACTIVE = 6, 8, 4
_REBOOT_MS = 1000
_TEXT_BYTES = 50
_MOST_TEXT = 5 * _TEXT_BYTES
_MOST_REASONS = 10


class MavlinkAdapter(VehicleAdapter[Message]):
    """The bridge of one vehicle that speaks MAVLink; its scans are those of OBSTACLE_DISTANCE.

    Attributes:
        clock: The autopilot's clock against ours.
        parameters: The autopilot's parameters that matter.
    """

    def __init__(self, vehicle: Vehicle, machine: VehicleMachine) -> None:
        """Start without a link."""
        super().__init__(vehicle, machine)
        self._autopilot = AUTOPILOTS[vehicle.autopilot]
        self.clock = ClockSync()
        self.parameters = Parameters(
            failsafes.names(vehicle), self._autopilot.sends_bits, failsafes.RENAMED
        )
        number, name, _ = self._autopilot.estimator
        has_distances = vehicle.lidar is not None and vehicle.lidar.is_obstacle_distance
        self._rates = MessageRates(
            {
                **_RATES_HZ,
                number: (name, ESTIMATOR_HZ),
                **(_DISTANCE_RATE if has_distances else {}),
            }
        )
        self._first_s: Optional[float] = None  # first heartbeat
        self._boot_ms = 0
        self._attitude: Tuple[Quaternion, Tuple[float, float, float], float] = (
            (0.0, 0.0, 0.0, 1.0),
            (0.0, 0.0, 0.0),
            -math.inf,
        )
        self._sent: Dict[int, Order] = {}  # command -> order
        self._refused: Optional[Tuple[Order, float]] = None
        self._reasons: List[str] = []
        self._chunks: Dict[int, str] = {}
        self._sticks: Dict[int, int] = {}
        self._heartbeat_s = -math.inf
        self._replies: List[Message] = []
        self._health = HealthWatch(self._autopilot, self.parameters)
        self._systems: Set[int] = set()  # other vehicles that are heard
        self._station_s = -math.inf  # last heartbeat of another station with our number
        self._news: List[str] = []

    # From the vehicle.

    def receive(self, name: str, component: int, message: Any, now_s: float) -> None:
        """Take a message of the vehicle's system.

        Args:
            name: Name of the message.
            component: Sender.
            message: Has the fields as attributes.
            now_s: Time.
        """
        if component != AUTOPILOT_COMPONENT and name != "OBSTACLE_DISTANCE":
            return
        self._rates.count(name)
        if self._first_s is not None:
            self.machine.inputs.hear(now_s)
        is_estimator = name == self._autopilot.estimator[1]
        handler = self._HANDLERS.get("estimator" if is_estimator else name)
        if handler is not None:
            self._handle(
                name,
                lambda field: getattr(message, field),
                MAVLINK.get(name, {}),
                lambda: handler(self, message, now_s),
                now_s,
            )

    def receive_other(self, system: int, message: Any, now_s: float) -> None:
        """Take a heartbeat of another system than the vehicle's."""
        if system == self._vehicle.bridge_system:
            if now_s - self._station_s > _STATION_S:
                self._news.append(self._station_fault)
            self._station_s = now_s
        elif message.autopilot != _NO_AUTOPILOT:
            self._systems.add(system)
            numbers = ", ".join(map(str, sorted(self._systems)))
            self.machine.inputs.heartbeat_problem = (
                f"heartbeats of system {numbers}, expected {self._vehicle.system}"
            )

    @property
    def _station_fault(self) -> str:
        return (
            f"another station sends heartbeats as system {self._vehicle.bridge_system}, as the"
            " bridge does, so the autopilot does not notice when the bridge dies; give one of them"
            " another number (bridge_system)"
        )

    def _on_heartbeat(self, message: Any, now_s: float) -> None:
        if message.autopilot != self._autopilot.number:
            self.machine.inputs.heartbeat_problem = (
                f"the autopilot's number is {message.autopilot}, expected"
                f" {self._autopilot.number} ({self._autopilot.name})"
            )
            return
        if self._first_s is None:
            self._first_s = now_s
        status = self._autopilot.status(message.base_mode, message.custom_mode)
        self.machine.inputs.take_status(status, now_s)

    def _on_position(self, message: Any, now_s: float) -> None:
        if message.time_boot_ms + _REBOOT_MS < self._boot_ms:
            self._rebooted()
        self._boot_ms = message.time_boot_ms
        quaternion, rates, at_s = self._attitude
        if now_s - at_s > _ATTITUDE_S:
            return
        stamp_s = self.clock.ours_s(message.time_boot_ms / 1e3, now_s)
        position_m = enu_from_ned((message.x, message.y, message.z))
        velocity = enu_from_ned((message.vx, message.vy, message.vz))
        estimate = Estimate.of(stamp_s, position_m, quaternion, velocity, rates)
        if estimate.is_finite:
            self.estimate = estimate
            problem = self._health.position_problem(now_s)
            self.machine.inputs.take_estimate(estimate, now_s, problem)

    def _rebooted(self) -> None:
        self.clock.forget()
        self.parameters.forget()
        self.machine.inputs.faults = None
        self._health.forget()

    def _on_attitude(self, message: Any, now_s: float) -> None:
        attitude = enu_from_flu(mavlink_quaternion(message.roll, message.pitch, message.yaw))
        rates = flu_from_frd((message.rollspeed, message.pitchspeed, message.yawspeed))
        self._attitude = attitude, rates, now_s

    def _on_landed(self, message: Any, _: float) -> None:
        known = message.landed_state in Landed.__members__.values()
        self.machine.inputs.landed = Landed(message.landed_state) if known else Landed.UNKNOWN

    def _on_system(self, message: Any, now_s: float) -> None:
        inputs, share = self.machine.inputs, message.battery_remaining
        is_armed = inputs.status is not None and inputs.status.is_armed
        problem = self._health.battery_problem(message, is_armed)
        inputs.take_battery(share / 100.0 if share >= 0 else None, now_s, problem)
        if message.onboard_control_sensors_present & _PREARM_CHECK:
            if message.onboard_control_sensors_health & _PREARM_CHECK:
                inputs.clear_texts()
            elif self.machine.state in (State.NOT_READY, State.READY, State.LANDED):
                inputs.take_text("the autopilot's pre-arm checks fail", now_s)

    def _on_sticks(self, message: Any, _: float) -> None:
        """Compare the sticks with those at take-off."""
        now = {k: getattr(message, f"chan{k}_raw") for k in _STICKS}
        valid = {k: us for k, us in now.items() if _VALID_US[0] <= us <= _VALID_US[1]}
        if self.machine.state not in IN_FLIGHT or not self._vehicle.has_radio:
            self._sticks = valid
            return
        moved = [
            _STICKS[k]
            for k, us in valid.items()
            if k in self._sticks and abs(us - self._sticks[k]) > _STICK_US
        ]
        if moved:
            self.machine.inputs.moved_sticks = ", ".join(moved)

    def _on_text(self, message: Any, now_s: float) -> None:
        text = self._whole_text(message)
        if text is None:
            return
        self.take_text(text, message.severity)
        autopilot, inputs = self._autopilot, self.machine.inputs
        if text.startswith(autopilot.complaints):
            inputs.take_text(text, now_s)
        if text.startswith(autopilot.refusals):
            self._reasons = [*self._reasons, text][:_MOST_REASONS]
        if self._health.take_text(text, now_s):
            inputs.take_battery(inputs.battery, now_s, text)
        if autopilot.acts.search(text):
            inputs.take_act(text, now_s)

    def _whole_text(self, message: Any) -> Optional[str]:
        """Return the text, joined if it came in parts of 50 bytes; None before the last part."""
        number = message.id
        text = f"{self._chunks.pop(number, '') if number else ''}{message.text}"[:_MOST_TEXT]
        if not number or len(message.text) < _TEXT_BYTES:
            return printable(text.rstrip())  # PX4 marks some with a tab at their end
        self._chunks = {number: text}
        return None

    def _on_answer(self, message: Any, now_s: float) -> None:
        order = self._sent.get(message.command)
        if order is None or message.result == _IN_PROGRESS:
            return
        if message.result == 0:
            self.machine.answer(Answer(order, True), now_s)
        else:
            self._refused = order, now_s + ANSWER_WAIT_S

    def _on_parameter(self, message: Any, now_s: float) -> None:
        name, value = str(message.param_id).rstrip("\0"), message.param_value
        if not self.parameters.take(name, value, message.param_type):
            line = f"PARAM_VALUE: {name} is {value}, expected a finite number"
            self.drop(f"PARAM_VALUE {name}", line, now_s)

    def _on_time(self, message: Any, now_s: float) -> None:
        reply = self.clock.take(message.tc1, message.ts1, now_s)
        if reply is not None:
            self._replies.append(reply)

    def _on_distances(self, message: Any, now_s: float) -> None:
        heading_rad = 0.0 if self.estimate is None else self.estimate.odom_from_base.yaw_rad
        scan = scan_from_obstacle_distance(message, now_s, math.pi / 2.0 - heading_rad)
        self.scan = scan or self.scan

    _HANDLERS: Dict[str, Callable[[MavlinkAdapter, Any, float], None]] = {
        "HEARTBEAT": _on_heartbeat,
        "LOCAL_POSITION_NED": _on_position,
        "ATTITUDE": _on_attitude,
        "EXTENDED_SYS_STATE": _on_landed,
        "SYS_STATUS": _on_system,
        "GPS_RAW_INT": lambda self, message, _: self._health.take_receiver(message),
        # Each autopilot has its own message.
        "estimator": lambda self, message, _: self._health.take_estimator(message),
        "RC_CHANNELS": _on_sticks,
        "STATUSTEXT": _on_text,
        "COMMAND_ACK": _on_answer,
        "PARAM_VALUE": _on_parameter,
        "TIMESYNC": _on_time,
        "OBSTACLE_DISTANCE": _on_distances,
    }

    # To the vehicle.

    def tick(self, now_s: float) -> Tuple[Output, List[Message]]:
        """Return what the state machine says, and the messages to send now."""
        self._answer_refused(now_s)
        self._check_parameters(now_s)
        output = self.machine.tick(now_s)
        output, self._news = replace(output, news=(*output.news, *self._news)), []
        messages, self._replies = self._replies, []
        if output.sends_heartbeat and now_s - self._heartbeat_s >= HEARTBEAT_PERIOD_S:
            self._heartbeat_s = now_s
            messages.append(("HEARTBEAT", _heartbeat()))
        for order in output.orders:
            fields = self._autopilot.command_fields(order, self.machine.altitude_m)
            self._sent[fields["command"]] = order
            self._reasons = []
            messages.append(("COMMAND_LONG", fields))
        if self._setpoints.is_due(now_s):
            messages += self._setpoint(output.velocity, now_s, by_command=False)
        if self._first_s is not None:
            messages += self.clock.requests(now_s)
            if now_s - self._first_s >= BEGIN_S:
                messages += self._rates.requests(now_s)
                messages += self.parameters.requests(now_s)
        return output, messages

    def _setpoint(
        self, wanted: Optional[Velocity], now_s: float, by_command: bool
    ) -> List[Message]:
        velocity = None if wanted is None else limited(wanted, self._vehicle.limits)
        if velocity is None:
            return []
        self._setpoints.sent(now_s, by_command)
        velocity = led(velocity, self._autopilot.turn_lead_s)
        fields = setpoint_fields(velocity, int(now_s * 1e3))
        return [("SET_POSITION_TARGET_LOCAL_NED", fields)]

    def _answer_refused(self, now_s: float) -> None:
        if self._refused is None or now_s < self._refused[1]:
            return
        order, self._refused = self._refused[0], None
        self.machine.answer(Answer(order, False, "; ".join(self._reasons)), now_s)
        self._reasons = []

    def _check_parameters(self, now_s: float) -> None:
        """Write what is ours and find faults, on the ground."""
        parameters, status = self.parameters, self.machine.inputs.status
        if not parameters.is_read or not parameters.is_written or status is None:
            return
        if status.is_armed:
            if self.machine.inputs.faults is None:
                self.machine.inputs.faults = failsafes.faults(parameters.values, self._vehicle)
            return
        missing = failsafes.wanted(parameters.values, self._vehicle)
        if missing and not parameters.has_given_up:
            parameters.write(missing)
            return
        faults = failsafes.faults(parameters.values, self._vehicle)
        if now_s - self._station_s < _STATION_S:
            faults.append(self._station_fault)
        self.machine.inputs.faults = faults


def _heartbeat() -> Dict[str, Any]:
    return {
        "type": _OUR_TYPE,
        "autopilot": _NO_AUTOPILOT,
        "base_mode": 0,
        "custom_mode": 0,
        "system_status": _ACTIVE,
    }
