"""Translate between a Crazyflie's log variables and set-points and the state machine.

The Crazyflie's world frame has z up and is right-handed, its body frame is FLU; angles are in
degrees (crazyflie-firmware, `stabilizer.c`). A hover set-point is a velocity in the body frame, a
yaw rate counter-clockwise in deg/s, and a height (`crtp_commander_generic.c`).

Set-points alone start the motors of a Crazyflie that arms itself. So none leaves before the state
machine has ordered to arm. Without set-points the firmware levels out after 0.5 s and stops the
motors after 2 s (`supervisor.c`); it has no order to land for this kind of set-point. So landing is
ours: set-points that sink. They are sent too when nothing is heard any more: it may still hear us.
"""

from __future__ import annotations

import math
from types import MappingProxyType
from typing import Callable, Dict, List, Mapping, Optional, Tuple

import numpy as np

from quad_nav.geometry import Scan
from quad_nav.topics.vehicle_states import State
from quad_vehicles.adapter import VehicleAdapter
from quad_vehicles.arrival_clock import ArrivalClock
from quad_vehicles.frames import crazyflie_quaternion
from quad_vehicles.orders import Order, Output, Traits
from quad_vehicles.ranges import CRAZYFLIE
from quad_vehicles.setpoints import limited
from quad_vehicles.states import VehicleMachine
from quad_vehicles.telemetry import Estimate, Landed, Status, Vector, Velocity
from quad_vehicles.vehicle_file import Vehicle

TRAITS = Traits(takes_off_by_command=False, lands_by_itself=False)
Values = Mapping[str, float]
Call = Tuple[str, Tuple[float, ...]]
"""What to send, and its arguments: hover (vx, vy, yaw rate in deg/s, z), stop (), arm (0 or 1)."""

_POSITION = tuple(f"stateEstimate.{name}" for name in ("x", "y", "z"))
_ANGLES = tuple(f"stateEstimate.{name}" for name in ("roll", "pitch", "yaw"))
_VELOCITY = tuple(f"stateEstimate.{name}" for name in ("vx", "vy", "vz"))
_RATES = tuple(f"gyro.{name}" for name in ("x", "y", "z"))
_RANGES = tuple(f"range.{name}" for name in ("back", "right", "front", "left"))
_INFO, _POWER, _CHARGE = "supervisor.info", "pm.state", "pm.batteryLevel"

BLOCKS: Mapping[str, Tuple[int, Mapping[str, str]]] = MappingProxyType(
    {
        "pose": (30, dict.fromkeys(_POSITION + _ANGLES, "float")),
        "motion": (30, dict.fromkeys(_VELOCITY + _RATES, "float")),
        "status": (100, {_INFO: "uint16_t", _POWER: "int8_t", _CHARGE: "uint8_t"}),
        "ranges": (50, dict.fromkeys(_RANGES, "uint16_t")),
    }
)
"""Period in ms and types of the variables of each block; the firmware allows 26 bytes in one."""
RANGES = "ranges"
"""The block of the Multi-ranger, which is there only with this deck."""
POSITIONING = ("deck.bcFlow2", "deck.bcFlow", "deck.bcLighthouse4", "deck.bcLoco", "deck.bcDWM1000")
MULTIRANGER = "deck.bcMultiranger"

_MOTION_S = 0.2  # oldest velocity that belongs to a position
_LOW_POWER = 3  # of pm.state
_RANGE_M = (0.02, 4.0)
_BOTTOM_M = 0.05
"""The motors stop at this height; the Flow deck measures from 0.04 m on."""
_LANDING_EXTRA_S = 3.0
_CAN_BE_ARMED, _ARMED, _CAN_FLY, _FLYING = 1 << 0, 1 << 1, 1 << 3, 1 << 4
_STOPPED: Mapping[int, str] = MappingProxyType(
    {1 << 5: "it is tumbled", 1 << 6: "it is locked, restart it", 1 << 7: "it has crashed"}
)


class CrazyflieAdapter(VehicleAdapter[Call]):
    """The bridge of one Crazyflie; its scans are those of the Multi-ranger."""

    def __init__(self, vehicle: Vehicle, machine: VehicleMachine) -> None:
        """Start without a link."""
        super().__init__(vehicle, machine)
        self._clock = ArrivalClock()
        self._motion: Tuple[Vector, Vector, float] = ((0.0,) * 3, (0.0,) * 3, -math.inf)
        self._info = 0
        self._is_armed = False  # by us
        self._landing_s: Optional[float] = None  # when our landing began
        self._height_m, self._height_s = 0.0, -math.inf  # of the last set-point, and its time

    # From the vehicle.

    def connected(self, parameters: Values) -> None:
        """Note a new connection.

        Args:
            parameters: The values of its parameters, by their complete names.
        """
        self._clock = ArrivalClock()
        self._is_armed, self._landing_s = False, None
        faults = []
        if not any(parameters.get(one) for one in POSITIONING):
            faults.append("no deck that measures the position: expected Flow, Lighthouse or Loco")
        if self.has_ranges and not parameters.get(MULTIRANGER):
            faults.append("no Multi-ranger deck, expected one because of lidar.multiranger")
        self.machine.inputs.faults = faults

    @property
    def has_ranges(self) -> bool:
        """Whether the Multi-ranger is wanted."""
        return self._vehicle.lidar is not None and self._vehicle.lidar.is_multiranger

    def receive(self, block: str, stamp_ms: int, values: Values, now_s: float) -> None:
        """Take the values of a log block.

        Args:
            block: One of ``BLOCKS``.
            stamp_ms: The Crazyflie's time, modulo 2^24.
            values: Values by the variables' names.
            now_s: Time.
        """
        self.machine.inputs.hear(now_s)

        def handle() -> None:
            stamp_s = self._clock.ours_s(stamp_ms, now_s)
            self._HANDLERS[block](self, values, stamp_s, now_s)

        self._handle(block, values.__getitem__, CRAZYFLIE.get(block, {}), handle, now_s)

    def _on_pose(self, values: Values, stamp_s: float, now_s: float) -> None:
        velocity, rates, at_s = self._motion
        if now_s - at_s > _MOTION_S:
            return
        roll, pitch, yaw = (values[name] for name in _ANGLES)
        x_m, y_m, z_m = (values[name] for name in _POSITION)
        quaternion = crazyflie_quaternion(roll, pitch, yaw)
        estimate = Estimate.of(stamp_s, (x_m, y_m, z_m), quaternion, velocity, rates)
        if estimate.is_finite:
            self.estimate = estimate
            self.machine.inputs.take_estimate(estimate, now_s)

    def _on_motion(self, values: Values, _: float, now_s: float) -> None:
        vx, vy, vz = (values[name] for name in _VELOCITY)
        wx, wy, wz = (math.radians(values[name]) for name in _RATES)
        self._motion = (vx, vy, vz), (wx, wy, wz), now_s

    def _on_status(self, values: Values, _: float, now_s: float) -> None:
        info, inputs = int(values[_INFO]), self.machine.inputs
        for bit, text in _STOPPED.items():
            if info & bit and not self._info & bit:
                self.take_text(f"the firmware has stopped the motors: {text}")
        self._info = info
        inputs.landed = Landed.IN_AIR if info & _FLYING else Landed.ON_GROUND
        is_low = values[_POWER] >= _LOW_POWER
        inputs.take_battery(0.0 if is_low else values[_CHARGE] / 100.0, now_s)
        if not info & (_CAN_BE_ARMED | _CAN_FLY):
            inputs.refuse(f"the firmware does not allow a flight: {self._mode}", now_s)
        self._take_status(now_s)

    def _take_status(self, now_s: float) -> None:
        is_armed = self._is_armed and bool(self._info & _ARMED and self._info & _CAN_FLY)
        status = Status(self._mode, True, self._landing_s is not None, is_armed)
        self.machine.inputs.take_status(status, now_s)

    @property
    def _mode(self) -> str:
        for bit, text in _STOPPED.items():
            if self._info & bit:
                return text
        known = ((_FLYING, "flying"), (_CAN_FLY, "ready to fly"), (_CAN_BE_ARMED, "disarmed"))
        return next((text for bit, text in known if self._info & bit), "not ready")

    def _on_ranges(self, values: Values, stamp_s: float, _: float) -> None:
        """Four beams from behind on, counter-clockwise; one without a return is +inf."""
        ranges_m = np.array([values[name] for name in _RANGES]) / 1000.0
        ranges_m[ranges_m >= _RANGE_M[1]] = np.inf
        ranges_m[ranges_m <= 0.0] = np.nan
        quarter_rad = math.pi / 2.0
        self.scan = Scan(stamp_s, -math.pi, quarter_rad, *_RANGE_M, ranges_m.astype(np.float32))

    _HANDLERS: Dict[str, Callable[[CrazyflieAdapter, Values, float, float], None]] = {
        "pose": _on_pose,
        "motion": _on_motion,
        "status": _on_status,
        "ranges": _on_ranges,
    }

    # To the vehicle.

    def tick(self, now_s: float) -> Tuple[Output, List[Call]]:
        """Return what the state machine says, and what to send now."""
        output = self.machine.tick(now_s)
        calls: List[Call] = []
        for order in output.orders:
            calls += self._obey(order, now_s)
        if self.machine.state in (State.FLYING, State.HOLDING):
            self._landing_s = None  # a link that came back has ended our blind landing
        elif self.machine.state is State.NO_LINK and self._is_armed and self._landing_s is None:
            self._landing_s = now_s
        if self._landing_s is not None:
            calls += self._land(now_s)
        elif self._setpoints.is_due(now_s):
            calls += self._setpoint(output.velocity, now_s, by_command=False)
        return output, calls

    def _obey(self, order: Order, now_s: float) -> List[Call]:
        if order is Order.ARM:
            self._is_armed = True
            return [("arm", (1.0,))]
        if order is Order.LAND and self._landing_s is None:
            self._landing_s = now_s
            self._take_status(now_s)
        return self._stop(now_s) if order is Order.DISARM else []

    def _setpoint(self, wanted: Optional[Velocity], now_s: float, by_command: bool) -> List[Call]:
        """Return a hover set-point; its height changes no faster than the limit."""
        velocity = None if wanted is None else limited(wanted, self._vehicle.limits)
        if velocity is None or not self._is_armed:
            return []
        self._setpoints.sent(now_s, by_command)
        target_m = self.machine.ground_m + velocity.height_m
        return [self._hover_call(velocity, target_m, now_s)]

    def _hover_call(self, velocity: Velocity, target_m: float, now_s: float) -> Call:
        elapsed_s = now_s - self._height_s
        if elapsed_s > 1.0:  # the first one: from where it is
            self._height_m, elapsed_s = self._present_m(), 0.0
        most_m = self._vehicle.limits.climb_mps * elapsed_s
        self._height_m += min(max(target_m - self._height_m, -most_m), most_m)
        self._height_s = now_s
        rate_degps = math.degrees(velocity.vyaw_radps)
        return "hover", (velocity.vx_mps, velocity.vy_mps, rate_degps, self._height_m)

    def _present_m(self) -> float:
        return 0.0 if self.estimate is None else self.estimate.odom_from_base.z_m

    def _land(self, now_s: float) -> List[Call]:
        """Sink to the ground, then stop the motors."""
        assert self._landing_s is not None
        ground_m = self.machine.ground_m
        longest_s = self._vehicle.limits.height_m / self._vehicle.limits.climb_mps
        is_down = self._present_m() - ground_m < _BOTTOM_M
        if is_down or now_s - self._landing_s > longest_s + _LANDING_EXTRA_S:
            return self._stop(now_s)
        if not self._setpoints.is_due(now_s):
            return []
        self._setpoints.sent(now_s, by_command=False)
        return [self._hover_call(Velocity(), ground_m, now_s)]

    def _stop(self, now_s: float) -> List[Call]:
        self._is_armed, self._landing_s = False, None
        self._take_status(now_s)
        return [("stop", ()), ("arm", (0.0,))]
