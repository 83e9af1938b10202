"""ArduPilot and PX4: one table of what differs.

ArduPilot's values were measured on ArduCopter 4.5.3 in software. PX4's are from its documentation
(flight modes, offboard control, parameter reference of v1.14); the project has not measured them.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Dict, FrozenSet, Mapping, Pattern, Tuple

from quad_vehicles.orders import Order, Traits
from quad_vehicles.telemetry import Status

ARMED = 128  # bit of HEARTBEAT.base_mode
AUTOPILOT_COMPONENT = 1
DO_SET_MODE, NAV_TAKEOFF, COMPONENT_ARM_DISARM, SET_MESSAGE_INTERVAL = 176, 22, 400, 511
_CUSTOM_MODE = 1.0  # of DO_SET_MODE: the mode is given by the autopilot's own numbers

Command = Tuple[int, Tuple[float, ...]]
"""Number of a MAV_CMD, and its first parameters."""


def _px4(main: int, sub: int = 0) -> int:
    return main << 16 | sub << 24


@dataclass(frozen=True)
class Autopilot:
    """One kind of autopilot.

    Attributes:
        name: Name in files of vehicles.
        number: Its ``MAV_AUTOPILOT``.
        traits: What the state machine has to know.
        modes: Names by ``HEARTBEAT.custom_mode``.
        control: Mode in which it obeys set-points.
        land: Mode that lands.
        settling: Modes that it passes through by itself on the way to ours.
        commands: Commands of the orders.
        sends_bits: Whether parameters that are whole numbers travel as the bits of the number, and
            not as its value.
        refusals: Beginnings of texts with a reason for a refused order.
        complaints: Beginnings of texts with a reason for not being ready.
        estimator: Number and name of the message with the state of its estimator, and its fields
            that are 1 or more when the estimator rejects measurements.
        low_battery: Texts that tell a low battery.
        lost_position: Texts that tell a position which does not count any more.
        acts: Texts that tell why it changes its mode or stops the motors by itself.
        turn_lead_s: Time by which its velocity follows a set-point. It turns a set-point by its
            heading at the arrival, so in a turn it would fly behind its heading.
    """

    name: str
    number: int
    traits: Traits
    modes: Mapping[int, str]
    control: int
    land: int
    settling: FrozenSet[int]
    commands: Mapping[Order, Command]
    sends_bits: bool
    refusals: Tuple[str, ...]
    complaints: Tuple[str, ...]
    estimator: Tuple[int, str, Tuple[str, ...]]
    low_battery: Pattern[str]
    lost_position: Pattern[str]
    acts: Pattern[str]
    turn_lead_s: float = 0.0

    def status(self, base_mode: int, custom_mode: int) -> Status:
        """Return what a heartbeat says."""
        return Status(
            self.modes.get(custom_mode, f"mode {custom_mode}"),
            custom_mode == self.control,
            custom_mode == self.land,
            bool(base_mode & ARMED),
            custom_mode in self.settling,
        )

    def command_fields(self, order: Order, altitude_m: float) -> Dict[str, Any]:
        """Return the fields of COMMAND_LONG for an order, without the target."""
        number, parameters = self.commands[order]
        fields = command_fields(number, *parameters)
        if order is Order.TAKE_OFF:
            fields["param7"] = altitude_m
        return fields


def command_fields(number: int, *parameters: float) -> Dict[str, Any]:
    """Return the fields of COMMAND_LONG, without the target; further parameters are 0."""
    values = (*parameters, *(0.0,) * (7 - len(parameters)))
    return {
        "command": number,
        "confirmation": 0,
        **{f"param{k}": float(value) for k, value in enumerate(values, 1)},
    }


_ARM: Mapping[Order, Command] = {
    Order.ARM: (COMPONENT_ARM_DISARM, (1.0,)),
    Order.DISARM: (COMPONENT_ARM_DISARM, (0.0,)),
    Order.TAKE_OFF: (NAV_TAKEOFF, ()),
}

ARDUPILOT = Autopilot(
    "ardupilot",
    3,
    Traits(streams_before_control=False, takes_off_by_command=True),
    MappingProxyType(
        {
            0: "STABILIZE",
            2: "ALT_HOLD",
            3: "AUTO",
            4: "GUIDED",
            5: "LOITER",
            6: "RTL",
            9: "LAND",
            16: "POSHOLD",
            17: "BRAKE",
            21: "SMART_RTL",
        }
    ),
    control=4,
    land=9,
    settling=frozenset(),
    commands=MappingProxyType(
        {
            **_ARM,
            Order.TAKE_CONTROL: (DO_SET_MODE, (_CUSTOM_MODE, 4.0)),
            Order.LAND: (DO_SET_MODE, (_CUSTOM_MODE, 9.0)),
        }
    ),
    sends_bits=False,
    refusals=("Arm: ", "Mode change to "),
    complaints=("PreArm: ",),
    estimator=(193, "EKF_STATUS_REPORT", ("velocity_variance", "pos_horiz_variance")),
    low_battery=re.compile(r"Battery (Failsafe|\d+ is (low|critical))"),
    lost_position=re.compile(
        r"EKF variance|EKF3? IMU\d stopped aiding|GPS Glitch|Dead Reckoning started"
    ),
    acts=re.compile(r"^(?!.*Cleared).*(Failsafe|EKF variance|[Ff]ence|Crash)"),
    turn_lead_s=0.6,
)

PX4 = Autopilot(
    "px4",
    12,
    Traits(streams_before_control=True, takes_off_by_command=False),
    MappingProxyType(
        {
            _px4(1): "MANUAL",
            _px4(2): "ALTCTL",
            _px4(3): "POSCTL",
            _px4(4, 1): "AUTO.READY",
            _px4(4, 2): "AUTO.TAKEOFF",
            _px4(4, 3): "AUTO.LOITER",
            _px4(4, 4): "AUTO.MISSION",
            _px4(4, 5): "AUTO.RTL",
            _px4(4, 6): "AUTO.LAND",
            _px4(5): "ACRO",
            _px4(6): "OFFBOARD",
            _px4(7): "STABILIZED",
        }
    ),
    control=_px4(6),
    land=_px4(4, 6),
    settling=frozenset(),
    commands=MappingProxyType(
        {
            **_ARM,
            Order.TAKE_CONTROL: (DO_SET_MODE, (_CUSTOM_MODE, 6.0, 0.0)),
            Order.LAND: (DO_SET_MODE, (_CUSTOM_MODE, 4.0, 6.0)),
        }
    ),
    sends_bits=True,
    refusals=("Preflight Fail", "Arming denied", "Switching to ", "Takeoff denied"),
    complaints=("Preflight Fail", "Preflight:"),
    estimator=(230, "ESTIMATOR_STATUS", ("vel_ratio", "pos_horiz_ratio")),
    low_battery=re.compile(r"(Low|Critical|Dangerous|Emergency) battery|Battery \d+( disc|: )"),
    lost_position=re.compile(r"(GNSS|GPS) (data fusion stopped|signal spoofed|signal jammed)"),
    acts=re.compile(r"[Ff]ailsafe|[Ff]ence| lost|terminat"),
    turn_lead_s=0.56,  # 1 / MPC_XY_VEL_P_ACC, whose default is 1.8/s; not measured
)

AUTOPILOTS: Mapping[str, Autopilot] = MappingProxyType(
    {autopilot.name: autopilot for autopilot in (ARDUPILOT, PX4)}
)
