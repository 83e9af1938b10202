"""Ranges of the numbers that vehicles send; a message with a number outside of them is dropped.

A broken sender, a glitch of an estimator or a stranger sends any bits. NaN is in no range, so
nothing behind the adapters sees a number that is not finite.

Positions: beyond 100 km the 32 bits of a coordinate do not tell a centimetre. Velocities: 1000 m/s
is ArduPilot's own limit of a sane one. Angular velocities: gyroscopes end at 2000 or 4000 deg/s.
"""

from __future__ import annotations

import math
from types import MappingProxyType
from typing import Callable, Mapping, Optional, Tuple

Range = Tuple[float, float]
"""Smallest and largest value."""
Ranges = Mapping[str, Mapping[str, Range]]
"""Ranges by the names of a message and of its field."""


def _all(names: str, most: float, least: Optional[float] = None) -> Mapping[str, Range]:
    return dict.fromkeys(names.split(), (-most if least is None else least, most))


_POSITION_M, _VELOCITY_MPS, _RATE_RADPS = 1e5, 1e3, 100.0
_STAMP_NS = 2.0**32 * 1e6  # of TIMESYNC: as long as the 32 bits of a stamp in ms

MAVLINK: Ranges = MappingProxyType(
    {
        "ATTITUDE": {
            **_all("roll pitch yaw", math.tau),
            **_all("rollspeed pitchspeed yawspeed", _RATE_RADPS),
        },
        "LOCAL_POSITION_NED": {**_all("x y z", _POSITION_M), **_all("vx vy vz", _VELOCITY_MPS)},
        "OBSTACLE_DISTANCE": _all("increment_f angle_offset", 360.0),
        "SYS_STATUS": _all("battery_remaining", 100.0, -1.0),
        "TIMESYNC": _all("tc1", _STAMP_NS, 0.0),
    }
)
CRAZYFLIE: Ranges = MappingProxyType(
    {
        "pose": {
            **_all("stateEstimate.x stateEstimate.y stateEstimate.z", _POSITION_M),
            **_all("stateEstimate.roll stateEstimate.pitch stateEstimate.yaw", 360.0),
        },
        "motion": {
            **_all("stateEstimate.vx stateEstimate.vy stateEstimate.vz", _VELOCITY_MPS),
            **_all("gyro.x gyro.y gyro.z", math.degrees(_RATE_RADPS)),
        },
        "status": {
            **_all("supervisor.info", 65535.0, 0.0),
            **_all("pm.state", 128.0),
            **_all("pm.batteryLevel", 100.0, 0.0),
        },
        "ranges": _all("range.back range.right range.front range.left", 65535.0, 0.0),
    }
)


def fault(read: Callable[[str], float], ranges: Mapping[str, Range]) -> Optional[Tuple[str, str]]:
    """Return the first field that is outside of its range, and what is wrong with it.

    Args:
        read: Returns the value of a field.
        ranges: Ranges of the message's fields.
    """
    for field, (least, most) in ranges.items():
        value = read(field)
        if not least <= value <= most:
            return field, f"is {value:g}, expected {least:g} to {most:g}"
    return None
