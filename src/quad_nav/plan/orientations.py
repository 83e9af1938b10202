"""Headings for the points of a path, as ``global_planner/GlobalPlanner`` gives them."""

from __future__ import annotations

import enum

import numpy as np
from numpy.typing import NDArray

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
    OrientationMode.FORWARD: 0.0,
    OrientationMode.FORWARD_THEN_INTERPOLATE: 0.0,
    OrientationMode.BACKWARD: np.pi,
    OrientationMode.LEFTWARD: -np.pi / 2,
    OrientationMode.RIGHTWARD: np.pi / 2,
}


def with_headings(
    plan: NDArray[np.float64], start_yaw_rad: float, mode: int, window: int
) -> NDArray[np.float64]:
    """Return a plan, float64[n, 3], with new yaws in all rows but the last.

    Modes that interpolate begin with the robot's heading. The direction at a point is that from the
    point ``window`` points before to the one so many after it.
    """
    plan = plan.copy()
    mode = OrientationMode(mode)
    if mode in _TURNED_RAD:
        turned = directions(plan[:, :2], window) + _TURNED_RAD[mode]
        plan[:-1, 2] = np.arctan2(np.sin(turned), np.cos(turned))[:-1]
    if mode is OrientationMode.INTERPOLATE:
        plan[0, 2] = start_yaw_rad
        _interpolate(plan[:, 2])
    elif mode is OrientationMode.FORWARD_THEN_INTERPOLATE and len(plan) > 2:
        straight = _start_of_last_straight(plan[:-1, 2])
        plan[0, 2] = start_yaw_rad
        _interpolate(plan[straight:, 2])
    return plan


def directions(points: NDArray[np.float64], window: int) -> NDArray[np.float64]:
    """Return the path's direction at each of its points, float64[n, 2]: float64[n], radians."""
    index = np.arange(len(points))
    before = points[np.maximum(index - window, 0)]
    after = points[np.minimum(index + window, len(points) - 1)]
    dx, dy = (after - before).T
    return np.arctan2(dy, dx)


def _interpolate(yaws: NDArray[np.float64]) -> None:
    """Set equal turns from the first yaw to the last, the short way, in float64[n]."""
    turn = np.arctan2(np.sin(yaws[-1] - yaws[0]), np.cos(yaws[-1] - yaws[0]))
    blended = yaws[0] + np.linspace(0.0, turn, len(yaws))
    yaws[1:-1] = np.arctan2(np.sin(blended), np.cos(blended))[1:-1]


def _start_of_last_straight(yaws: NDArray[np.float64]) -> int:
    """Return the first point from which on the path keeps its last direction."""
    k = len(yaws) - 2
    turns = yaws - yaws[k]
    bends = np.abs(np.arctan2(np.sin(turns), np.cos(turns))) > _STRAIGHT_RAD
    while k > 0 and not bends[k - 1]:
        k -= 1
    return k
