"""Markers as rerun's solids. It draws nothing translucent: that becomes an outline."""

from __future__ import annotations

import math
from typing import Any, List

import numpy as np

from quad_nav.geometry import quaternion_from_yaw, rotation_from_quaternion
from quad_nav.topics.markers import CUBE, CUBE_LIST, CYLINDER, SPHERE, Marker

_SIDES = 24
_LINE_M = 0.01  # radius of an outline
_OPAQUE_FROM = 0.5


def solid(rr: Any, marker: Marker) -> Any:
    """What to log for a marker, in its frame."""
    colour = colour_of(marker)
    is_opaque = marker.rgba[3] >= _OPAQUE_FROM
    if marker.kind == CUBE:
        fill = rr.components.FillMode.Solid if is_opaque else rr.components.FillMode.MajorWireframe
        return rr.Boxes3D(
            centers=[marker.place_m],
            sizes=[marker.size_m],
            quaternions=[_turn(rr, marker)],
            colors=[colour],
            radii=[_LINE_M],
            fill_mode=fill,
        )
    if marker.kind == CUBE_LIST:
        points = (
            np.array(marker.points_m)
            @ rotation_from_quaternion(quaternion_from_yaw(marker.yaw_rad)).T
        )
        return rr.Boxes3D(
            centers=points,
            sizes=[marker.size_m] * len(points),
            quaternions=[_turn(rr, marker)] * len(points),
            colors=[colour],
            fill_mode=rr.components.FillMode.Solid,
        )
    if marker.kind == SPHERE:
        return rr.Ellipsoids3D(
            centers=[marker.place_m],
            colors=[colour],
            half_sizes=[np.array(marker.size_m) / 2],
            fill_mode=rr.components.FillMode.Solid,
        )
    assert marker.kind == CYLINDER, marker
    lower, upper = (_ring(marker, side) for side in (-0.5, 0.5))
    if not is_opaque:
        return rr.LineStrips3D([_closed(lower), _closed(upper)], colors=[colour], radii=[_LINE_M])
    points = np.vstack((lower, upper, *_centres(marker)))
    return rr.Mesh3D(
        vertex_positions=points,
        triangle_indices=_triangles(),
        vertex_colors=np.tile(np.array(colour, dtype=np.uint8), (len(points), 1)),
    )


def colour_of(marker: Marker) -> List[int]:
    return [round(255 * part) for part in marker.rgba[:3]]


def _turn(rr: Any, marker: Marker) -> Any:
    return rr.Quaternion(xyzw=quaternion_from_yaw(marker.yaw_rad))


def _ring(marker: Marker, side: float) -> np.ndarray:
    """The lower or upper edge of a cylinder, float64[n, 3]."""
    angles = np.arange(_SIDES) * 2.0 * math.pi / _SIDES
    unit = np.column_stack((np.cos(angles) / 2.0, np.sin(angles) / 2.0, np.full(_SIDES, side)))
    ring: np.ndarray = unit * marker.size_m + marker.place_m
    return ring


def _centres(marker: Marker) -> np.ndarray:
    return np.array([[0.0, 0.0, -0.5], [0.0, 0.0, 0.5]]) * marker.size_m + marker.place_m


def _closed(ring: np.ndarray) -> np.ndarray:
    return np.vstack((ring, ring[:1]))


def _triangles() -> np.ndarray:
    """Of the points: lower ring, upper ring, the two centres; seen from outside."""
    here = np.arange(_SIDES)
    after = (here + 1) % _SIDES
    bottom, top = np.full(_SIDES, 2 * _SIDES), np.full(_SIDES, 2 * _SIDES + 1)
    return np.vstack(
        [
            np.column_stack(corners)
            for corners in (
                (here, after, here + _SIDES),
                (after, after + _SIDES, here + _SIDES),
                (bottom, after, here),
                (top, here + _SIDES, after + _SIDES),
            )
        ]
    )
