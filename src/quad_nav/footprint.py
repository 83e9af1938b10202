"""Footprints: the robot's outline as a polygon, float64[n, 2], in metres.

A footprint is convex, in the robot's frame unless said otherwise. The numbers are those of
costmap_2d to the last bit, because radii decide costs.
"""

from __future__ import annotations

import math
from typing import Sequence, Tuple, Union

import numpy as np
from numpy.typing import NDArray

from quad_nav.geometry import Pose2D

Footprint = Union["NDArray[np.float64]", Sequence[Tuple[float, float]]]

CIRCLE_POINTS = 16


def circle(radius_m: float) -> NDArray[np.float64]:
    """Return a circle as 16 points, float64[16, 2], the first on the x axis, counter-clockwise."""
    angles = [k * 2.0 * math.pi / CIRCLE_POINTS for k in range(CIRCLE_POINTS)]
    return np.array([(math.cos(a) * radius_m, math.sin(a) * radius_m) for a in angles])


def pad(footprint: Footprint, padding_m: float) -> NDArray[np.float64]:
    """Move every non-zero coordinate of a footprint away from zero by the padding.

    costmap_2d keeps the padding as float32, so 0.01 m is 0.009999999776 m here too.
    """
    points = _points(footprint)
    return points + np.sign(points) * float(np.float32(padding_m))


def radii(footprint: Footprint) -> Tuple[float, float]:
    """Return the inscribed and the circumscribed radius of a footprint, in metres.

    They are the least and greatest distance of the outline from (0, 0), and 0 for fewer than
    three points. For a footprint that does not contain the origin the inscribed radius is the
    distance to its nearest edge.
    """
    points = _points(footprint).tolist()
    if len(points) <= 2:
        return 0.0, 0.0
    corners = [_length(x, y) for x, y in points]
    edges = [_origin_to_segment(a, b) for a, b in zip(points, points[1:] + points[:1])]
    return min(corners + edges), max(corners + edges)


def oriented(footprint: Footprint, pose: Pose2D) -> NDArray[np.float64]:
    """Return the footprint of a robot at a pose, float64[n, 2] in the frame of the pose."""
    return pose.transform_points(_points(footprint))


def _points(footprint: Footprint) -> NDArray[np.float64]:
    return np.asarray(footprint, dtype=np.float64).reshape(-1, 2)


def _origin_to_segment(a: Sequence[float], b: Sequence[float]) -> float:
    (ax, ay), (bx, by) = a, b
    dx, dy = bx - ax, by - ay
    length_squared = dx * dx + dy * dy
    if length_squared == 0.0:
        return _length(ax, ay)
    along = min(1.0, max(0.0, (-ax * dx - ay * dy) / length_squared))
    return _length(ax + along * dx, ay + along * dy)


def _length(x: float, y: float) -> float:
    """Return the C library's hypot, as costmap_2d has it; Python's own rounds by version."""
    return float(np.hypot(x, y))
