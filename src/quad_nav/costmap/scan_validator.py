"""Reject scans that no working LIDAR can have taken.

A rejected scan counts as none: a sensor without valid scans counts as silent, and the
navigator stops the robot. The validator rejects

* a late scan: it is as old as the sensor may be silent;
* an empty scan: every beam is NaN or below the minimum range;
* a repeated scan: equal to the bit to one that was taken elsewhere;
* a scan in which a quarter of all beams lost the return that they had nearer than half of the
  LIDAR's range, although the robot has hardly moved. Returns that a turn takes out of a field
  of view below 360 degrees are not counted.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Dict, Optional, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.costmap.scan_filter import FilteredScan, ScanFilter, ScanSituation
from quad_nav.files.kernel_cache import njit
from quad_nav.geometry import Pose3D, Scan, angle_difference
from quad_nav.parameter import flag

_ELSEWHERE_M, _ELSEWHERE_RAD = 0.05, 0.05
CORRECTION_M, CORRECTION_RAD = 0.25, 0.3
"""A larger step of the pose from one scan to the next is a correction of the localisation."""
_LOST_SHARE = 0.25
_HARDLY_MOVED_M = 2.0
_ALL_AROUND_RAD = 2.0 * math.pi * 0.98


@dataclass(frozen=True)
class ScanValidatorParams:
    """Parameters of the scan validation."""

    reject_implausible_scans: bool = flag(
        "reject_implausible_scans", True, "Reject scans that cannot be true.", upstream=False
    )


class ScanValidator(ScanFilter):
    """Scan filter that rejects implausible scans.

    Attributes:
        params: The parameters; they may change in flight.
    """

    def __init__(self, params: ScanValidatorParams) -> None:
        self.params = params
        self._sensors: Dict[str, SensorValidator] = {}

    def filter(self, filtered: FilteredScan, situation: ScanSituation) -> FilteredScan:
        """Return the scan, rejected if no working LIDAR can have taken it."""
        if not self.params.reject_implausible_scans:
            return filtered
        sensor = self._sensors.setdefault(situation.sensor, SensorValidator())
        reason = sensor.rejection_reason(
            filtered.scan, situation.pose, situation.now_s, situation.expected_period_s
        )
        return replace(filtered, rejected=reason) if reason else filtered

    def reset(self) -> None:
        """Forget earlier scans, after the clock has jumped."""
        self._sensors.clear()


class SensorValidator:
    """Judge the scans of one sensor, one after the other."""

    def __init__(self) -> None:
        self._first_equal: Optional[Tuple[bytes, Pose3D]] = None  # content, pose of the first
        self._previous_pose: Optional[Pose3D] = None
        self._accepted: Optional[Tuple[Pose3D, int, int]] = None  # pose, beams, near returns

    def rejection_reason(
        self, scan: Scan, frame_from_sensor: Pose3D, now_s: float, expected_period_s: float
    ) -> str:
        """Return the reason to reject a scan that arrives now, "" to accept it.

        The LIDAR's pose at the scan's stamp is in a fixed frame. A scan of the expected period's
        age is late; with 0 none is.
        """
        here = frame_from_sensor
        ranges = np.ascontiguousarray(scan.ranges_m, dtype=np.float32)
        returns, near = _count_returns(
            ranges,
            np.float32(scan.range_min_m),
            np.float32(scan.range_max_m),
            np.float32(0.5 * scan.range_max_m),
        )
        reason = (
            late_reason(scan.stamp_s, now_s, expected_period_s)
            or _empty(ranges, returns)
            or self._repeated(ranges, here, returns)
            or self._lost_returns(scan, here, returns)
        )
        if not reason:
            self._accepted = here, len(ranges), near
        return reason

    def _repeated(self, ranges: NDArray[np.float32], here: Pose3D, returns: int) -> str:
        content, previous, self._previous_pose = ranges.tobytes(), self._previous_pose, here
        if (
            self._first_equal is None
            or self._first_equal[0] != content
            or (previous is not None and _differ(here, previous, CORRECTION_M, CORRECTION_RAD))
        ):
            self._first_equal = content, here
            return ""
        first = self._first_equal[1]
        if not returns or not _differ(here, first, _ELSEWHERE_M, _ELSEWHERE_RAD):
            return ""
        turn_rad = abs(angle_difference(here.yaw_rad, first.yaw_rad))
        return (
            f"it is identical to a scan taken {_distance_m(here, first):.2f} m and "
            f"{turn_rad:.2f} rad from here"
        )

    def _lost_returns(self, scan: Scan, here: Pose3D, returns: int) -> str:
        beams = len(scan.ranges_m)
        if self._accepted is None or self._accepted[1] != beams:
            return ""
        there, _, near = self._accepted
        if near - returns <= _LOST_SHARE * beams:  # as mostly: the rest can only allow more
            return ""
        if _distance_m(here, there) > min(_HARDLY_MOVED_M, 0.25 * scan.range_max_m):
            return ""
        field_rad = beams * abs(scan.angle_increment_rad)
        may_leave = (
            0.0
            if field_rad >= _ALL_AROUND_RAD
            else _share(abs(angle_difference(here.yaw_rad, there.yaw_rad)), field_rad)
        )
        if near - returns <= (_LOST_SHARE + may_leave) * beams:
            return ""
        return f"{near - returns} of {beams} beams lost their return at once"


def late_reason(stamp_s: float, now_s: float, expected_period_s: float) -> str:
    """Return why a scan with this stamp is too old now, "" if it is not."""
    age_s = now_s - stamp_s
    if not 0.0 < expected_period_s <= age_s:
        return ""
    return f"it is {age_s:.2f} s old, expected less than {expected_period_s:.2f} s"


def _empty(ranges: NDArray[np.float32], returns: int) -> str:
    if returns or np.isposinf(ranges).any():
        return ""
    return f"none of its {len(ranges)} beams is valid"


def _share(turn_rad: float, field_rad: float) -> float:
    """Return the share of a field of view that a turn takes out of sight."""
    return min(turn_rad / field_rad, 1.0) if field_rad > 0.0 else 1.0


def _distance_m(a: Pose3D, b: Pose3D) -> float:
    return math.hypot(b.x_m - a.x_m, b.y_m - a.y_m)


def _differ(a: Pose3D, b: Pose3D, by_m: float, by_rad: float) -> bool:
    return _distance_m(a, b) > by_m or abs(angle_difference(a.yaw_rad, b.yaw_rad)) > by_rad


@njit(cache=True, nogil=True)
def _count_returns(
    ranges: NDArray[np.float32], range_min: np.float32, range_max: np.float32, near: np.float32
) -> Tuple[int, int]:
    """Count the ranges, float32[n], in [range_min, range_max) and in [range_min, near)."""
    returns = nearer = 0
    for k in range(ranges.shape[0]):
        if ranges[k] >= range_min:
            returns += ranges[k] < range_max
            nearer += ranges[k] < near
    return returns, nearer
