"""Sectors: the bearings of a planar LIDAR at which a solid can be seen.

A sector is (first bearing, width), counter-clockwise, radians in the LIDAR's frame; a negative
width is an empty one, 2 pi is all around. Sectors may be too wide but never too narrow. Kinds and
sizes of solids as in ``rays``.
"""

from __future__ import annotations

import math
from typing import Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.files.kernel_cache import njit
from quad_nav.sim.rays import CYLINDER, SPHERE, Triple, dot, enter_box

Axes = Tuple[Triple, Triple, Triple]  # a LIDAR's x, y and z in ``map``

EMPTY = (0.0, -1.0)
FULL = (-math.pi, 2.0 * math.pi)
_STANDING = 0.5  # cosine of the angle between its axis and the plane's normal
_ROUGH_RAD = 0.005  # more than the error of a rough bearing


@njit(cache=True, nogil=True)
def sector_around(
    kind: int,
    eye: Triple,
    ahead: Triple,
    left: Triple,
    up: Triple,
    sizes: Triple,
    near_m: float,
) -> Tuple[float, float]:
    """Return the sector of the box around a solid that is near to the LIDAR or around it.

    All beams lie in the LIDAR's plane, so a box is seen between the bearings that bound its shadow
    on that plane. The shadow is convex: if the eye is outside it, all corners lie within half a
    turn and "further left" is the sign of a cross product.

    Args:
        kind: Kind of the solid.
        eye: The LIDAR's position in the solid's own frame.
        ahead: Its x axis there.
        left: Its y axis there.
        up: Its z axis there.
        sizes: Sizes of the solid.
        near_m: Distance at which beams begin.
    """
    if abs(dot(up, eye)) > abs(up[0]) * sizes[0] + abs(up[1]) * sizes[1] + abs(up[2]) * sizes[2]:
        return EMPTY
    inscribed = min(sizes[0], sizes[1], sizes[2]) - near_m
    if kind == CYLINDER and inscribed > 0.0 and dot(eye, eye) < inscribed * inscribed:
        return EMPTY  # a quadcopter's own guard: no beam begins outside
    if enter_box(eye, up, sizes) < math.inf:
        return FULL
    middle_x, middle_y = -dot(ahead, eye), -dot(left, eye)
    left_x, left_y = middle_x, middle_y
    right_x, right_y = middle_x, middle_y
    for corner in range(8):
        hx = sizes[0] if corner & 1 else -sizes[0]
        hy = sizes[1] if corner & 2 else -sizes[1]
        hz = sizes[2] if corner & 4 else -sizes[2]
        x = middle_x + ahead[0] * hx + ahead[1] * hy + ahead[2] * hz
        y = middle_y + left[0] * hx + left[1] * hy + left[2] * hz
        if left_x * y - left_y * x > 0.0:
            left_x, left_y = x, y
        if right_x * y - right_y * x < 0.0:
            right_x, right_y = x, y
    first = math.atan2(right_y, right_x)
    width = math.atan2(left_y, left_x) - first
    return first, width if width >= 0.0 else width + 2.0 * math.pi


@njit(cache=True, nogil=True)
def columns_of(
    kinds: NDArray[np.int64],
    centres: NDArray[np.float64],
    rotations: NDArray[np.float64],
    sizes: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return what ``rough_sectors`` needs of solids; the arguments are those of ``lidar.Solids``.

    Returns:
        float64[8, s]: centres x, y and z, the solids' z axes x, y and z in ``map``, and the radii
        of a tube around each axis and of a ball.
    """
    count = kinds.shape[0]
    columns = np.empty((8, count))
    for k in range(count):
        for axis in range(3):
            columns[axis, k] = centres[k, axis]
            columns[3 + axis, k] = rotations[k, 2, axis]
        square = sizes[k, 0] * sizes[k, 0]
        if kinds[k] != CYLINDER and kinds[k] != SPHERE:
            square += sizes[k, 1] * sizes[k, 1]
        columns[6, k] = math.sqrt(square)
        columns[7, k] = math.sqrt(square + sizes[k, 2] * sizes[k, 2])
    return columns


@njit(cache=True, nogil=True, error_model="numpy")  # nothing is divided by 0
def rough_sectors(
    columns: NDArray[np.float64], origin: Triple, axes: Axes, rough: NDArray[np.float64]
) -> None:
    """Find how near solids can be to a LIDAR, and sectors that hold those of the solids.

    A disc in the LIDAR's plane holds all of a solid in the plane: the plane cuts the tube around a
    standing solid in an ellipse with the long half radius / cos(tilt). Around a lying solid there
    is a ball. There are no branches, so that the compiler makes vectors of the solids.

    Args:
        columns: float64[8, s], of ``columns_of``.
        origin: Position of the LIDAR in ``map``, metres.
        axes: Axes of the LIDAR.
        rough: float64[3, s], filled with the distance to the disc, negative inside of it, and the
            sector's first bearing and width, which count outside of the disc alone.
    """
    ahead, left, up = axes
    for k in range(columns.shape[1]):
        offset = (columns[0, k] - origin[0], columns[1, k] - origin[1], columns[2, k] - origin[2])
        axis = (columns[3, k], columns[4, k], columns[5, k])
        cosine = dot(up, axis)
        stands = abs(cosine) > _STANDING
        divisor = cosine if stands else 1.0
        along = -dot(up, offset) / divisor if stands else 0.0  # to where the axis meets the plane
        x = dot(ahead, offset) + along * dot(ahead, axis)
        y = dot(left, offset) + along * dot(left, axis)
        radius = columns[6, k] / abs(divisor) if stands else columns[7, k]
        distance = math.sqrt(x * x + y * y)
        sine = radius / (distance if distance > radius else radius)
        # The arcsine is convex: below 1/2 at most pi/3 times its sine.
        half_rad = (1.05 if sine < 0.5 else 0.5 * math.pi) * sine + _ROUGH_RAD
        rough[0, k] = distance - radius
        rough[1, k] = _rough_bearing(x, y) - half_rad
        rough[2, k] = 2.0 * half_rad


@njit(cache=True, nogil=True, error_model="numpy")
def _rough_bearing(x: float, y: float) -> float:
    """Return atan2(y, x) to 0.004 rad (Rajan et al., IEEE Signal Processing Magazine, 2006)."""
    along, across = max(abs(x), abs(y)), min(abs(x), abs(y))
    z = across / (along if along > 0.0 else 1.0)
    angle = z * (math.pi / 4.0 + 0.273 * (1.0 - z))
    angle = math.pi / 2.0 - angle if abs(y) > abs(x) else angle
    angle = math.pi - angle if x < 0.0 else angle
    return -angle if y < 0.0 else angle
