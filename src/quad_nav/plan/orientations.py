"""Headings for the points of a path, as ``global_planner/GlobalPlanner`` gives them."""

from __future__ import annotations

import enum
import math
from typing import List, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.geometry import wrap_angle
from quad_nav.parameter import Choice

# A turn of more than this between two points ends the last straight part of a path.
_STRAIGHT_RAD = 0.35


class OrientationMode(enum.IntEnum):
    """Headings along a path; the last point keeps the goal's heading."""

    NONE = 0
    FORWARD = 1
    INTERPOLATE = 2
    FORWARD_THEN_INTERPOLATE = 3
    BACKWARD = 4
    LEFTWARD = 5
    RIGHTWARD = 6


ORIENTATIONS = (
    Choice("None", OrientationMode.NONE, "No heading but the goal's"),
    Choice("Forward", OrientationMode.FORWARD, "Along the path"),
    Choice("Interpolate", OrientationMode.INTERPOLATE, "From the start's to the goal's heading"),
    Choice(
        "ForwardThenInterpolate",
        OrientationMode.FORWARD_THEN_INTERPOLATE,
        "Along the path until the last straight part, which turns to the goal's heading",
    ),
    Choice("Backward", OrientationMode.BACKWARD, "Against the path"),
    Choice("Leftward", OrientationMode.LEFTWARD, "The left side along the path"),
    Choice("Rightward", OrientationMode.RIGHTWARD, "The right side along the path"),
)

# From the path's direction to the robot's heading.
_TURNED_RAD = {
    OrientationMode.BACKWARD: math.pi,
    OrientationMode.LEFTWARD: -math.pi / 2,
    OrientationMode.RIGHTWARD: math.pi / 2,
}


def with_headings(
    plan: NDArray[np.float64], start_yaw_rad: float, mode: int, window: int, turns_from_bend: bool
) -> NDArray[np.float64]:
    """Return a plan, float64[n, 3], with new yaws; the last one is the goal's.

    Args:
        plan: float64[n, 3], n >= 1, rows x, y, yaw.
        start_yaw_rad: Heading of the robot, with which modes that interpolate begin.
        mode: One of ``OrientationMode``.
        window: The direction at a point is that from the point ``window`` points before to the one
            so many after it.
        turns_from_bend: The last straight part of a path turns from its own heading to the goal's.
            False restores upstream behaviour: its first point has turned as if the whole path
            did, so its last one has turned too far.
    """
    plan = plan.copy()
    mode, yaws = OrientationMode(mode), plan[:, 2]
    if mode not in (OrientationMode.NONE, OrientationMode.INTERPOLATE):
        yaws[:-1] = _directions(plan[:, :2].tolist(), window)[:-1]
    if mode in _TURNED_RAD:
        turned_rad = _TURNED_RAD[mode]
        yaws[:-1] = [wrap_angle(_as_sent(yaw) + turned_rad) for yaw in yaws[:-1].tolist()]
    if mode is OrientationMode.INTERPOLATE:
        _interpolate(yaws, start_yaw_rad, 0, turns_from_bend)
    elif mode is OrientationMode.FORWARD_THEN_INTERPOLATE and len(plan) > 2:
        straight = _start_of_last_straight(yaws[:-1].tolist())
        first_rad = _as_sent(yaws[straight]) if straight else start_yaw_rad
        yaws[0] = start_yaw_rad
        _interpolate(yaws, first_rad, straight, turns_from_bend)
    return plan


def _directions(points: List[Tuple[float, float]], window: int) -> List[float]:
    """Return the path's direction at each of its points, in radians."""
    # Not numpy's: the last bits of its arctan2 depend on the processor.
    last = len(points) - 1
    found = []
    for k in range(len(points)):
        (x0, y0), (x1, y1) = points[max(k - window, 0)], points[min(k + window, last)]
        found.append(math.atan2(y1 - y0, x1 - x0))
    return found


def _as_sent(yaw_rad: float) -> float:
    """Return a yaw as upstream reads it back from the quaternion of a pose."""
    z, w = math.sin(0.5 * yaw_rad), math.cos(0.5 * yaw_rad)
    return math.atan2(2.0 * (w * z), w * w - z * z)


def _interpolate(
    yaws: NDArray[np.float64], first_rad: float, first: int, turns_from_bend: bool
) -> None:
    """Set equal turns from a point to the last one, the short way, in float64[n]."""
    turn_rad = wrap_angle(yaws[-1] - first_rad) / max(1, len(yaws) - 1 - first)
    steps = np.arange(len(yaws) - first) + (0 if turns_from_bend else first)
    yaws[first:] = first_rad + turn_rad * steps


def _start_of_last_straight(yaws: List[float]) -> int:
    """Return the first point from which on the path keeps its last direction."""
    k = len(yaws) - 2
    last_rad = _as_sent(yaws[k])
    while k > 0 and abs(wrap_angle(last_rad - _as_sent(yaws[k - 1]))) <= _STRAIGHT_RAD:
        k -= 1
    return k
