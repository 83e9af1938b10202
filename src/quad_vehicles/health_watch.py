"""Judge what an autopilot says about its battery and its position.

ArduPilot's charge is consumed charge, 100 % after each start, even of an empty battery: the voltage
counts. When its receiver loses the satellites, its position goes on for 8 s by dead reckoning.
"""

from __future__ import annotations

import math
from typing import Any, Dict, Tuple

from quad_vehicles.autopilots import Autopilot
from quad_vehicles.exchanges import Parameters
from quad_vehicles.failsafes import uses_receiver

TEXT_S = 5.0
"""How long a text about the position counts; the flags of the estimator tell whether it lasts."""
_BATTERY = 1 << 25  # MAV_SYS_STATUS_SENSOR_BATTERY
_UNKNOWN_MV = (0, 65535)
_FIX_3D = 3  # GPS_FIX_TYPE
# EKF_STATUS_FLAGS of ArduPilot, ESTIMATOR_STATUS_FLAGS of PX4: relative or absolute horizontal
# position; constant position, not initialised (ArduPilot) or glitch (PX4), glitch (ArduPilot).
_HAS_POSITION, _IS_DOUBTFUL = 1 << 3 | 1 << 4, 1 << 7 | 1 << 10 | 1 << 15


class HealthWatch:
    """Problems of battery and position, each in words; "" for none."""

    def __init__(self, autopilot: Autopilot, parameters: Parameters) -> None:
        """Start without problems."""
        self._autopilot, self._parameters = autopilot, parameters
        self.forget()

    def forget(self) -> None:
        """Forget everything: the autopilot has started again."""
        self._battery_text = ""
        self._had_fix = False
        self._doubts: Dict[str, Tuple[str, float]] = {}  # source -> problem, until when it counts

    def take_text(self, text: str, now_s: float) -> bool:
        """Take a text; return whether it tells a low battery."""
        if self._autopilot.lost_position.match(text):
            self._doubts["text"] = (text, now_s + TEXT_S)
        is_low = self._autopilot.low_battery.match(text) is not None
        self._battery_text = text if is_low else self._battery_text
        return is_low

    def take_receiver(self, message: Any) -> None:
        """Take GPS_RAW_INT; a receiver that has never had a position does not count."""
        has_fix = message.fix_type >= _FIX_3D
        self._had_fix |= has_fix
        counts = self._had_fix and uses_receiver(self._parameters.values)
        problem = f"the GPS has lost its position ({message.satellites_visible} satellites)"
        self._doubts["receiver"] = (problem if counts and not has_fix else "", math.inf)

    def take_estimator(self, message: Any) -> None:
        """Take EKF_STATUS_REPORT of ArduPilot or ESTIMATOR_STATUS of PX4."""
        flags, problem = message.flags, ""
        if not flags & _HAS_POSITION or flags & _IS_DOUBTFUL:
            problem = f"the estimator has no position that counts (flags {flags})"
        elif any(getattr(message, ratio) >= 1.0 for ratio in self._autopilot.estimator[2]):
            problem = "the estimator rejects its measurements of position or velocity"
        self._doubts["estimator"] = (problem, math.inf)

    def position_problem(self, now_s: float) -> str:
        """Return why the position does not count although it goes on."""
        return "; ".join(text for text, end_s in self._doubts.values() if text and now_s < end_s)

    def battery_problem(self, message: Any, is_armed: bool) -> str:
        """Return why the battery is low, whatever its charge.

        Args:
            message: SYS_STATUS.
            is_armed: Whether the motors are armed; on the ground an earlier text does not count.
        """
        if not is_armed:
            self._battery_text = ""
        least = self._parameters.values.get("BATT_LOW_VOLT")
        millivolts = message.voltage_battery
        if least and millivolts not in _UNKNOWN_MV and millivolts < 1e3 * least:
            return f"battery at {millivolts / 1e3:.2f} V, expected {least:g} V or more"
        present, enabled = (
            message.onboard_control_sensors_present,
            message.onboard_control_sensors_enabled,
        )
        if present & enabled & ~message.onboard_control_sensors_health & _BATTERY:
            return self._battery_text or "the autopilot says that the battery is low or broken"
        return self._battery_text
