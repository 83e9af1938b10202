"""What the autopilot does when it is left alone: checked before the motors are armed.

The bridge writes the fence, the limit of height and the time-out of the stream, which are its own
business. The failsafes are the pilot's: they are read, and a take-off is refused if the autopilot
would do nothing, or would climb under a roof. With ``failsafes: set`` in the file of the vehicles
they are written too.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from types import MappingProxyType
from typing import Callable, Dict, List, Mapping, Optional, Tuple

from quad_vehicles.telemetry import Limits
from quad_vehicles.vehicle_file import OUR_SYSTEM, Vehicle

STREAM_TIMEOUT_S = 0.5
FENCE_MARGIN_M = 0.5
"""The autopilot's fence lies this far behind ours, which lands first."""
RENAMED: Mapping[str, Tuple[str, ...]] = MappingProxyType(
    {"SYSID_MYGCS": ("MAV_GCS_SYSID", "MAV_GCS_SYSID_HI"), "MAV_GCS_SYSID": ("SYSID_MYGCS",)}
)
"""An autopilot that has a parameter does not have these: ArduPilot 4.7 has renamed it."""

Values = Mapping[str, Optional[float]]
"""Parameters by name; None for one that the autopilot does not have."""


@dataclass(frozen=True)
class Failsafe:
    """A parameter that a pilot sets, and the values with which we fly.

    Attributes:
        parameter: Its name.
        problem: Returns what is wrong with the values of all parameters, "" if nothing is.
        safe: Value that the bridge proposes; None if only the pilot can know it.
        is_needed: Whether an autopilot without the parameter is refused.
        older: Its name in older versions, if it had another one.
    """

    parameter: str
    problem: Callable[[Values, Vehicle], str]
    safe: Optional[float]
    is_needed: bool = True
    older: str = ""

    def safe_for(self, vehicle: Vehicle) -> Optional[float]:
        """Return the proposed value: without a radio its loss means nothing."""
        if self.parameter == "MAV_GCS_SYSID":
            return float(vehicle.bridge_system)
        return 0.0 if self.parameter == "FS_THR_ENABLE" and not vehicle.has_radio else self.safe

    def name_in(self, values: Values) -> str:
        """Return the name under which the autopilot has it."""
        is_old = bool(self.older) and values.get(self.parameter) is None
        return self.older if is_old else self.parameter


def own_parameters(autopilot: str, limits: Limits) -> Dict[str, float]:
    """Return the parameters that the bridge writes, with their values."""
    height_m, radius_m = limits.height_m + FENCE_MARGIN_M, limits.radius_m + FENCE_MARGIN_M
    if autopilot == "px4":
        return {
            "COM_OF_LOSS_T": STREAM_TIMEOUT_S,
            "GF_ACTION": 5.0,  # land
            "GF_MAX_HOR_DIST": radius_m,
            "GF_MAX_VER_DIST": height_m,
        }
    return {
        "GUID_TIMEOUT": STREAM_TIMEOUT_S,
        "FENCE_TYPE": 3.0,  # greatest height, circle
        "FENCE_ACTION": 2.0,  # land
        "FENCE_ALT_MAX": height_m,
        "FENCE_RADIUS": radius_m,
        "FENCE_MARGIN": FENCE_MARGIN_M / 2.0,  # it slows down this far before the fence
        "FENCE_ENABLE": 1.0,
    }


def names(vehicle: Vehicle) -> Tuple[str, ...]:
    """Return the parameters to read."""
    read = [
        name
        for failsafe in _FAILSAFES[vehicle.autopilot]
        for name in (failsafe.parameter, failsafe.older)
        if name
    ]
    return (*own_parameters(vehicle.autopilot, vehicle.limits), *read, *_ALSO[vehicle.autopilot])


def wanted(values: Values, vehicle: Vehicle) -> Dict[str, float]:
    """Return the parameters to write, those that have another value now."""
    ours = own_parameters(vehicle.autopilot, vehicle.limits)
    if vehicle.sets_failsafes:
        for failsafe in _FAILSAFES[vehicle.autopilot]:
            name, safe = failsafe.name_in(values), failsafe.safe_for(vehicle)
            if safe is not None and failsafe.problem(values, vehicle):
                ours[name] = safe
    return {
        name: value
        for name, value in ours.items()
        if values.get(name) is not None and not is_equal(values[name], value)
    }


def faults(values: Values, vehicle: Vehicle) -> List[str]:
    """Return why the vehicle must not take off with these parameters."""
    found = []
    for name, value in own_parameters(vehicle.autopilot, vehicle.limits).items():
        if values.get(name) is None:
            found.append(f"{name}: the autopilot does not answer, expected {value:g}")
        elif not is_equal(values[name], value):
            found.append(f"{name}: is {values[name]:g}, the autopilot does not take {value:g}")
    for failsafe in _FAILSAFES[vehicle.autopilot]:
        name = failsafe.name_in(values)
        value_ = values.get(name)
        if value_ is None:
            if failsafe.is_needed:
                found.append(f"{name}: the autopilot does not answer")
            continue
        problem = failsafe.problem(values, vehicle)
        if problem:
            safe = failsafe.safe_for(vehicle)
            advice = "" if safe is None else f"; set it to {safe:g}"
            found.append(f"{name}: is {value_:g}: {problem}{advice}")
    return found


def uses_receiver(values: Values) -> bool:
    """Return whether the estimator takes its position from a satellite receiver."""
    return values.get("EK3_SRC1_POSXY") in (None, 3.0) and values.get("EKF2_GPS_CTRL") != 0.0


def is_equal(value: Optional[float], other: float) -> bool:
    """Return whether a parameter has a value, up to the rounding of its 32 bits."""
    return value is not None and abs(value - other) <= 1e-5 * max(1.0, abs(other))


def _value(values: Values, name: str) -> float:
    """Return a parameter; 0 for one that is missing or no finite number."""
    value = values.get(name)
    return value if value is not None and math.isfinite(value) else 0.0


def _climb(values: Values, vehicle: Vehicle) -> str:
    """Say that a return to launch climbs under a roof; "" if it may."""
    if not vehicle.has_roof:
        return ""
    is_px4 = vehicle.autopilot == "px4"
    name = "RTL_RETURN_ALT" if is_px4 else "RTL_ALT"
    value = values.get(name)
    if value is None:
        return "it returns to launch at a height that it does not tell"
    height_m = value if is_px4 else value / 100.0
    if height_m <= vehicle.limits.height_m:
        return ""
    return f"it climbs to {height_m:g} m ({name}), expected {vehicle.limits.height_m:g} m or less"


# ArduPilot: 0 nothing, 1 return to launch, 3 return by the same way or straight, 4 return by the
# same way or land, 5 land (link) and 1 return, 3 land, 4 and 5 return by the same way (radio).


def _ardupilot_link(values: Values, vehicle: Vehicle) -> str:
    value = _value(values, "FS_GCS_ENABLE")
    if value == 5.0:
        return ""
    if value in (1.0, 2.0, 3.0, 4.0):
        return _climb(values, vehicle)
    return "it does nothing when the link to this machine is lost"


def _ardupilot_station(values: Values, vehicle: Vehicle) -> str:
    if vehicle.bridge_system in (values.get("MAV_GCS_SYSID"), values.get("SYSID_MYGCS")):
        return ""
    return (
        "it does not notice when the bridge dies, because it counts another station's heartbeats,"
        f" not those of the bridge, system {vehicle.bridge_system}"
    )


def _ardupilot_more_stations(values: Values, vehicle: Vehicle) -> str:
    if _value(values, "MAV_GCS_SYSID_HI") <= vehicle.bridge_system:
        return ""
    return "it does not notice when the bridge dies, because it counts other stations' heartbeats"


def _ardupilot_radio(values: Values, vehicle: Vehicle) -> str:
    value = _value(values, "FS_THR_ENABLE")
    if value == 3.0 or (value and int(_value(values, "FS_OPTIONS")) & 4):
        return ""  # it lands, or flies on under our control
    if value == 0.0:
        return "it does nothing when the radio is lost" if vehicle.has_radio else ""
    return _climb(values, vehicle)


def _ardupilot_estimate(values: Values, _: Vehicle) -> str:
    lands = _value(values, "FS_EKF_ACTION") in (1.0, 3.0)
    return "" if lands else "it does not land when it loses its position"


def _ardupilot_battery(values: Values, vehicle: Vehicle) -> str:
    """0 nothing, 1 land, 2, 3, 4 and 6 return to launch, 5 stop the motors."""
    value = _value(values, "BATT_FS_LOW_ACT")
    if value in (2.0, 3.0, 4.0, 6.0):
        return _climb(values, vehicle)
    return "" if value == 1.0 else "it does not land when the battery is low"


def _ardupilot_voltage(values: Values, _: Vehicle) -> str:
    if _value(values, "BATT_LOW_VOLT") > 0.0:
        return ""
    return "it does not notice a low voltage; set it to 3.5 for each cell of the battery"


# PX4: 0 nothing, 1 hold, 2 return, 3 land, 5 terminate, 6 disarm. Lost offboard control: 0
# position, 1 altitude, 2 manual, 3 return, 4 land, 5 hold, 6 terminate, 7 disarm.


def _px4_link(values: Values, vehicle: Vehicle) -> str:
    value = _value(values, "NAV_DLL_ACT")
    if value == 2.0:
        return _climb(values, vehicle)
    return "" if value == 3.0 else "it does not land when the link to this machine is lost"


def _px4_offboard(values: Values, vehicle: Vehicle) -> str:
    value = _value(values, "COM_OBL_RC_ACT")
    if value == 3.0:
        return _climb(values, vehicle)
    if value == 5.0:  # NAV_DLL_ACT counts the heartbeats of every ground station
        return "it holds for ever when the bridge dies beside another ground station"
    return "" if value == 4.0 else "it does not land or hold when the set-points stop"


def _px4_radio(values: Values, vehicle: Vehicle) -> str:
    value = _value(values, "NAV_RCL_ACT")
    if value == 3.0 or int(_value(values, "COM_RCL_EXCEPT")) & 4 or not vehicle.has_radio:
        return ""  # it lands, or flies on under our control
    if value == 2.0:
        return _climb(values, vehicle)
    return "it does not land when the radio is lost"


def _px4_battery(values: Values, vehicle: Vehicle) -> str:
    """0 nothing, 2 land, 3 return to launch, at last land."""
    value = _value(values, "COM_LOW_BAT_ACT")
    if value == 3.0:
        return _climb(values, vehicle)
    return "" if value == 2.0 else "it does not land when the battery is low"


_FAILSAFES: Mapping[str, Tuple[Failsafe, ...]] = {
    "ardupilot": (
        Failsafe("FS_GCS_ENABLE", _ardupilot_link, 5.0),
        Failsafe("MAV_GCS_SYSID", _ardupilot_station, OUR_SYSTEM, older="SYSID_MYGCS"),
        Failsafe("MAV_GCS_SYSID_HI", _ardupilot_more_stations, 0.0, is_needed=False),
        Failsafe("FS_THR_ENABLE", _ardupilot_radio, 3.0),
        Failsafe("FS_EKF_ACTION", _ardupilot_estimate, 1.0, is_needed=False),
        Failsafe("BATT_FS_LOW_ACT", _ardupilot_battery, 1.0, is_needed=False),
        Failsafe("BATT_LOW_VOLT", _ardupilot_voltage, None, is_needed=False),
    ),
    "px4": (
        Failsafe("NAV_DLL_ACT", _px4_link, 3.0),
        Failsafe("COM_OBL_RC_ACT", _px4_offboard, 4.0),
        Failsafe("NAV_RCL_ACT", _px4_radio, 3.0),
        Failsafe("COM_LOW_BAT_ACT", _px4_battery, 2.0, is_needed=False),
    ),
}
_ALSO: Mapping[str, Tuple[str, ...]] = {
    "ardupilot": ("FS_OPTIONS", "RTL_ALT", "EK3_SRC1_POSXY"),
    "px4": ("COM_RCL_EXCEPT", "RTL_RETURN_ALT", "EKF2_GPS_CTRL"),
}
