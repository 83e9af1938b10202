"""Whether a scan tells what is around the robot now, or a broken LIDAR's tale.

A scan that is not believed counts as none: the sensor is silent, and silence stops the
robot. What is not believed is what cannot be:

* a scan that is as old as the sensor may be silent when it comes;
* one without a single beam that says anything: all of them are NaN or below the least range;
* one equal to the bit to one that was taken elsewhere: the LIDAR repeats itself;
* one in which a quarter of all beams have lost what they had met nearer than half the
  LIDAR's range, though the robot has hardly moved: a wall does not vanish. What leaves a
  smaller field of view in a turn may be missing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Iterable, Optional, Tuple

import numpy as np

from quad_nav.costmap.observation import SourceParams
from quad_nav.geometry import Pose2D, Pose3D, Scan, angle_difference
from quad_nav.kernels.projection import count_returns

_ELSEWHERE_M, _ELSEWHERE_RAD = 0.05, 0.05
# A step of the pose from one scan to the next that is no flight but a correction.
_CORRECTION_M, _CORRECTION_RAD = 0.25, 0.3
_LOST_SHARE = 0.25
_HARDLY_MOVED_M = 2.0
_ALL_AROUND_RAD = 2.0 * math.pi * 0.98


@dataclass(frozen=True)
class ScanValidatorParams:
    """Parameters of the scan validation."""

    reject_implausible_scans: bool = True


class ScanValidator:
    """Looks at the scans of one sensor, one after the other.

    ``sources`` are those of the layers that take them: how old a scan may be is how long the
    strictest lets it be silent.
    """

    def __init__(self, sources: Iterable[SourceParams]):
        periods_s = [source.expected_update_period_s for source in sources]
        self._timeout_s = min((one for one in periods_s if one > 0.0), default=0.0)
        self.restart()

    def restart(self) -> None:
        """Forget what was seen: for a clock that has jumped."""
        self._last: Optional[Tuple[bytes, Pose2D]] = None  # where such a scan was first taken
        self._before: Optional[Pose2D] = None
        self._good: Optional[Tuple[Pose2D, int, int]] = None  # pose, beams, near returns

    def why_not(self, scan: Scan, global_from_sensor: Pose3D, now_s: float) -> str:
        """Why a scan that came now is not to be believed; "" when it is."""
        here = global_from_sensor.to_2d()
        ranges = np.ascontiguousarray(scan.ranges_m, dtype=np.float32)
        returns, near = count_returns(
            ranges,
            np.float32(scan.range_min_m),
            np.float32(scan.range_max_m),
            np.float32(0.5 * scan.range_max_m),
        )
        reason = (
            self._why_late(scan, now_s)
            or _why_empty(ranges, returns)
            or self._why_repeated(ranges, here, returns)
            or self._why_lost(scan, here, returns)
        )
        if not reason:
            self._good = here, len(ranges), near
        return reason

    def _why_late(self, scan: Scan, now_s: float) -> str:
        late_s = now_s - scan.stamp_s
        return f"it is {late_s:.2f} s old" if 0.0 < self._timeout_s <= late_s else ""

    def _why_repeated(self, ranges: np.ndarray, here: Pose2D, returns: int) -> str:
        content, before, self._before = ranges.tobytes(), self._before, here
        if (
            self._last is None
            or self._last[0] != content
            or (before is not None and _differ(here, before, _CORRECTION_M, _CORRECTION_RAD))
        ):
            self._last = content, here
        first = self._last[1]
        if returns and _differ(here, first, _ELSEWHERE_M, _ELSEWHERE_RAD):
            return (
                f"it is the very one that was taken {here.distance_to(first):.2f} m and "
                f"{abs(angle_difference(here.yaw_rad, first.yaw_rad)):.2f} rad from here"
            )
        return ""

    def _why_lost(self, scan: Scan, here: Pose2D, returns: int) -> str:
        beams = len(scan.ranges_m)
        if self._good is None or self._good[1] != beams:
            return ""
        there, _, near = self._good
        if here.distance_to(there) > min(_HARDLY_MOVED_M, 0.25 * scan.range_max_m):
            return ""
        field_rad = beams * abs(scan.angle_increment_rad)
        may_leave = (
            0.0
            if field_rad >= _ALL_AROUND_RAD
            else (abs(angle_difference(here.yaw_rad, there.yaw_rad)) / field_rad)
        )
        if near - returns <= (_LOST_SHARE + may_leave) * beams:
            return ""
        return f"{near - returns} of {beams} beams have lost what they met"


def _why_empty(ranges: np.ndarray, returns: int) -> str:
    if returns or np.isposinf(ranges).any():
        return ""
    return f"none of its {len(ranges)} beams says anything"


def _differ(a: Pose2D, b: Pose2D, by_m: float, by_rad: float) -> bool:
    return a.distance_to(b) > by_m or abs(angle_difference(a.yaw_rad, b.yaw_rad)) > by_rad
