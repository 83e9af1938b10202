"""Sectors: the bearings of a planar LIDAR at which a solid can be seen.

All beams lie in the LIDAR's plane, so a solid is seen between the bearings that bound its
shadow on that plane. A sector is (first bearing, width), counter-clockwise, radians in the
LIDAR's frame; a negative width is an empty one, 2 pi is all around. Sectors may be too wide
but never too narrow.

A view of a solid is given in the solid's own frame: ``eye``, the LIDAR's position in metres, and
its axes ``ahead``, ``left`` and ``up``, as triples. Kinds and sizes as in ``rays``.
"""

from __future__ import annotations

import math
from typing import Tuple

from quad_nav.kernels.jit import njit
from quad_nav.kernels.rays import BOX, CYLINDER, Triple, dot, enter_box

EMPTY = (0.0, -1.0)
FULL = (-math.pi, 2.0 * math.pi)
_STANDING = 0.5  # cosine of the angle between its axis and the plane's normal


@njit(cache=True, nogil=True)
def sector_of(
    kind: int, eye: Triple, ahead: Triple, left: Triple, up: Triple, sizes: Triple
) -> Tuple[float, float]:
    """Return the sector of a solid."""
    height = abs(dot(up, eye))
    if kind == BOX:
        if height > abs(up[0]) * sizes[0] + abs(up[1]) * sizes[1] + abs(up[2]) * sizes[2]:
            return EMPTY
        return _box_sector(eye, ahead, left, up, sizes)
    if kind == CYLINDER:
        if height > abs(up[2]) * sizes[2] + math.sqrt(up[0] * up[0] + up[1] * up[1]) * sizes[0]:
            return EMPTY
        return _cylinder_sector(eye, ahead, left, up, sizes)
    if height > sizes[0]:
        return EMPTY
    return _disc_sector(
        -dot(ahead, eye), -dot(left, eye), math.sqrt(sizes[0] * sizes[0] - height * height)
    )


@njit(cache=True, nogil=True)
def _box_sector(
    eye: Triple, ahead: Triple, left: Triple, up: Triple, sizes: Triple
) -> Tuple[float, float]:
    """Return the sector between the outermost corners, unless the eye is above or below the box.

    The shadow on the plane is convex: if the eye is outside it, all corners lie within
    half a turn and "further left" is the sign of a cross product.
    """
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
def _cylinder_sector(
    eye: Triple, ahead: Triple, left: Triple, up: Triple, sizes: Triple
) -> Tuple[float, float]:
    """Return the sector of a cylinder.

    The plane cuts a standing cylinder in an ellipse around its axis, with the long half
    radius / cos(tilt). A lying one is replaced by its bounding sphere.
    """
    if abs(up[2]) > _STANDING:
        z = dot(up, eye) / up[2]  # where the axis meets the plane
        return _disc_sector(
            ahead[2] * z - dot(ahead, eye), left[2] * z - dot(left, eye), sizes[0] / abs(up[2])
        )
    return _disc_sector(-dot(ahead, eye), -dot(left, eye), math.hypot(sizes[0], sizes[2]))


@njit(cache=True, nogil=True)
def _disc_sector(x: float, y: float, radius: float) -> Tuple[float, float]:
    """Return the sector of a disc around (x, y) seen from (0, 0)."""
    distance = math.sqrt(x * x + y * y)
    if distance <= radius:
        return FULL
    half = math.asin(radius / distance)
    return math.atan2(y, x) - half, 2.0 * half
