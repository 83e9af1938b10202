"""Entry of rays into solids.

A ray is ``origin + t * direction``. Each function takes it in the solid's own frame, with the
origin in its centre, as triples in metres, and returns the t at which it enters: negative when the
ray begins inside or beyond, inf for a miss. A solid is a kind and three sizes in metres, half of
its extent along x, y, z. The axis of a CYLINDER is z.

A convex solid is the intersection of pieces (slabs between two parallel faces, a tube). A ray is in
all of them from its last entry to its first exit, if that is later.
"""

from __future__ import annotations

import math
from typing import Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.files.kernel_cache import njit

Triple = Tuple[float, float, float]

BOX, CYLINDER, SPHERE = 0, 1, 2
KINDS = {"box": BOX, "cylinder": CYLINDER, "sphere": SPHERE}
"""Kinds by ``Obstacle.shape``."""
_PARALLEL = 1e-12  # of a direction of length 1; it strays from the faces by less than 1 nm


@njit(cache=True, nogil=True)
def through_slab(origin: float, direction: float, low: float, high: float) -> Tuple[float, float]:
    """Return (entry, exit) of a coordinate's interval [low, high]; (inf, -inf) for a miss."""
    if abs(direction) < _PARALLEL:
        if low <= origin <= high:
            return -math.inf, math.inf
        return math.inf, -math.inf
    per_metre = 1.0 / direction
    a, b = (low - origin) * per_metre, (high - origin) * per_metre
    return (a, b) if a < b else (b, a)


@njit(cache=True, nogil=True)
def enter_box(origin: Triple, direction: Triple, sizes: Triple) -> float:
    """Return the entry into the slabs abs(x, y, z) <= sizes."""
    in_x, out_x = through_slab(origin[0], direction[0], -sizes[0], sizes[0])
    in_y, out_y = through_slab(origin[1], direction[1], -sizes[1], sizes[1])
    in_z, out_z = through_slab(origin[2], direction[2], -sizes[2], sizes[2])
    entry = in_x if in_x > in_y else in_y
    entry = in_z if in_z > entry else entry
    leave = out_x if out_x < out_y else out_y
    leave = out_z if out_z < leave else leave
    return entry if entry <= leave else math.inf


@njit(cache=True, nogil=True)
def enter_ball(squared: float, along: float, excess: float) -> Tuple[float, float]:
    """Return (entry, exit) of ``squared t^2 + 2 along t + excess <= 0``; (inf, -inf) if none."""
    if squared == 0.0:
        return (-math.inf, math.inf) if excess <= 0.0 else (math.inf, -math.inf)
    discriminant = along * along - squared * excess
    if discriminant < 0.0:
        return math.inf, -math.inf
    root = math.sqrt(discriminant)
    return (-along - root) / squared, (-along + root) / squared


@njit(cache=True, nogil=True)
def enter_cylinder(origin: Triple, direction: Triple, sizes: Triple) -> float:
    """Return the entry into the tube x^2 + y^2 <= sizes[0]^2 and the slab abs(z) <= sizes[2]."""
    x, y, dx, dy, radius = origin[0], origin[1], direction[0], direction[1], sizes[0]
    in_tube, out_tube = enter_ball(
        dx * dx + dy * dy, x * dx + y * dy, x * x + y * y - radius * radius
    )
    in_z, out_z = through_slab(origin[2], direction[2], -sizes[2], sizes[2])
    entry = max(in_tube, in_z)
    return entry if entry <= min(out_tube, out_z) else math.inf


@njit(cache=True, nogil=True)
def enter_sphere(origin: Triple, direction: Triple, sizes: Triple) -> float:
    """Return the entry into x^2 + y^2 + z^2 <= sizes[0]^2."""
    entry, _ = enter_ball(
        dot(direction, direction), dot(origin, direction), dot(origin, origin) - sizes[0] * sizes[0]
    )
    return entry


@njit(cache=True, nogil=True)
def enter_solid(kind: int, origin: Triple, direction: Triple, sizes: Triple) -> float:
    """Return the entry into a solid of any kind."""
    if kind == BOX:
        return enter_box(origin, direction, sizes)
    if kind == CYLINDER:
        return enter_cylinder(origin, direction, sizes)
    if kind == SPHERE:
        return enter_sphere(origin, direction, sizes)
    raise ValueError("solid of an unknown kind")


@njit(cache=True, nogil=True)
def dot(a: Triple, b: Triple) -> float:
    """Return the scalar product of two triples."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True, nogil=True)
def turn(rotation: NDArray[np.float64], vector: Triple) -> Triple:
    """Return ``rotation @ vector`` of float64[3, 3] and a triple."""
    return (
        rotation[0, 0] * vector[0] + rotation[0, 1] * vector[1] + rotation[0, 2] * vector[2],
        rotation[1, 0] * vector[0] + rotation[1, 1] * vector[1] + rotation[1, 2] * vector[2],
        rotation[2, 0] * vector[0] + rotation[2, 1] * vector[1] + rotation[2, 2] * vector[2],
    )


@njit(cache=True, nogil=True)
def triple(row: NDArray[np.float64]) -> Triple:
    """Return the three numbers of float64[3]."""
    return row[0], row[1], row[2]
