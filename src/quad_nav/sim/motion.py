"""Motions along keyframes, as functions of time.

Between two keyframes a motion is a straight line at constant speed (``linear``), or a cubic spline
through the keyframes (``spline``), as Gazebo animates poses. With u from 0 to 1 from keyframe i to
the next one::

    p(u) = (2u^3 - 3u^2 + 1) P[i] + (u^3 - 2u^2 + u) M[i]
         + (3u^2 - 2u^3) P[i+1] + (u^3 - u^2) M[i+1]
    M[i] = (1 - tension) (P[i+1] - P[i-1]) / 2

At either end M is (1 - tension) times half of the only difference. If the first and the last
position are equal, both ends have M = (1 - tension) (P[1] - P[-2]) / 2. The tangents do not depend
on the keyframes' times, so that the velocity jumps at keyframes.

Source: ``ignition::math::Spline`` of ignition-math 4.0.0, and ``PoseAnimation`` of Gazebo 9, which
has tension 0. Unlike in Gazebo, the yaw is a number that is interpolated in the same way: from 0 to
6.28 is a whole turn.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional, Tuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

LINEAR, SPLINE = "linear", "spline"
INTERPOLATIONS = (LINEAR, SPLINE)


@dataclass(frozen=True)
class Motion:
    """Motion through keyframes.

    Before the first keyframe a body stands there, after the last one too. A motion that loops
    jumps from the last keyframe to time 0 instead.

    Attributes:
        times_s: Times of the keyframes, 0 or more, increasing.
        poses: Pose (x_m, y_m, yaw_rad) in ``map`` at each keyframe.
        loop: Whether it starts again after the last keyframe.
        interpolation: "linear" or "spline".
        tension: Of the spline, from 0 to 1: 1 is a stop at each keyframe.
        phase_s: Time by which it is ahead of the clock; None for a random part of its loop.
    """

    times_s: Tuple[float, ...]
    poses: Tuple[Tuple[float, float, float], ...]
    loop: bool = True
    interpolation: str = LINEAR
    tension: float = 0.0
    phase_s: Optional[float] = 0.0

    @property
    def length_s(self) -> float:
        """Time of the last keyframe: the length of a loop."""
        return self.times_s[-1]

    def tangents(self) -> Floats:
        """Return the tangents of the spline, float64[n, 3]."""
        points = np.array(self.poses, float).reshape(-1, 3)
        tangents = np.zeros_like(points)
        if len(points) < 2:
            return tangents
        tangents[1:-1] = points[2:] - points[:-2]
        tangents[0], tangents[-1] = points[1] - points[0], points[-1] - points[-2]
        if len(points) > 2 and np.array_equal(points[0, :2], points[-1, :2]):
            tangents[0, :2] = tangents[-1, :2] = points[1, :2] - points[-2, :2]
        return (1.0 - self.tension) * tangents / 2.0


@dataclass(frozen=True)
class Walkers:
    """People who walk between random places, see ``walkers``.

    Attributes:
        count: Number of people.
        speed_mps: Lowest and highest of their desired speeds.
        radius_m: Radius of a person.
        height_m: Height of a person.
        reacting: Whether they keep away from quadcopters as they do from each other.
    """

    count: int
    speed_mps: Tuple[float, float] = (0.5, 1.5)
    radius_m: float = 0.25
    height_m: float = 1.75
    reacting: bool = False
