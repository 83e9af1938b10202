"""Convert markers to rerun's solids; translucent markers become outlines.

rerun draws nothing translucent.
"""

from __future__ import annotations

import math
from typing import Any, List

import numpy as np
from numpy.typing import NDArray

from quad_nav.geometry import quaternion_from_yaw, rotation_from_quaternion
from quad_nav.topics.markers import CUBE, CUBE_LIST, CYLINDER, SPHERE, Marker

_SIDES = 24
_LINE_M = 0.01  # radius of an outline
_OPAQUE_FROM = 0.5


def solid(rr: Any, marker: Marker) -> Any:
    """Build the rerun archetype of a marker, in the marker's frame."""
    if marker.kind == CUBE:
        return _box(rr, marker)
    if marker.kind == CUBE_LIST:
        return _boxes(rr, marker)
    if marker.kind == SPHERE:
        return rr.Ellipsoids3D(
            centers=[marker.place_m],
            colors=[colour_of(marker)],
            half_sizes=[np.array(marker.size_m) / 2],
            fill_mode=rr.components.FillMode.Solid,
        )
    assert marker.kind == CYLINDER, marker
    return _cylinder(rr, marker)


def _is_opaque(marker: Marker) -> bool:
    return marker.rgba[3] >= _OPAQUE_FROM


def _box(rr: Any, marker: Marker) -> Any:
    modes = rr.components.FillMode
    return rr.Boxes3D(
        centers=[marker.place_m],
        sizes=[marker.size_m],
        quaternions=[_turn(rr, marker)],
        colors=[colour_of(marker)],
        radii=[_LINE_M],
        fill_mode=modes.Solid if _is_opaque(marker) else modes.MajorWireframe,
    )


def _boxes(rr: Any, marker: Marker) -> Any:
    rotation = rotation_from_quaternion(quaternion_from_yaw(marker.yaw_rad))
    points = np.array(marker.points_m) @ rotation.T
    return rr.Boxes3D(
        centers=points,
        sizes=[marker.size_m] * len(points),
        quaternions=[_turn(rr, marker)] * len(points),
        colors=[colour_of(marker)],
        fill_mode=rr.components.FillMode.Solid,
    )


def _cylinder(rr: Any, marker: Marker) -> Any:
    colour = colour_of(marker)
    lower, upper = (_ring(marker, side) for side in (-0.5, 0.5))
    if not _is_opaque(marker):
        return rr.LineStrips3D([_closed(lower), _closed(upper)], colors=[colour], radii=[_LINE_M])
    points = np.vstack((lower, upper, *_centres(marker)))
    return rr.Mesh3D(
        vertex_positions=points,
        triangle_indices=_triangles(),
        vertex_colors=np.tile(np.array(colour, dtype=np.uint8), (len(points), 1)),
    )


def colour_of(marker: Marker) -> List[int]:
    """Return the marker's colour as three numbers of 0 to 255."""
    return [round(255 * part) for part in marker.rgba[:3]]


def _turn(rr: Any, marker: Marker) -> Any:
    return rr.Quaternion(xyzw=quaternion_from_yaw(marker.yaw_rad))


def _ring(marker: Marker, side: float) -> NDArray[np.float64]:
    """Return the lower or upper edge of a cylinder, shape (n, 3)."""
    angles = np.arange(_SIDES) * 2.0 * math.pi / _SIDES
    unit = np.column_stack((np.cos(angles) / 2.0, np.sin(angles) / 2.0, np.full(_SIDES, side)))
    ring: NDArray[np.float64] = unit * marker.size_m + marker.place_m
    return ring


def _centres(marker: Marker) -> NDArray[np.float64]:
    return np.array([[0.0, 0.0, -0.5], [0.0, 0.0, 0.5]]) * marker.size_m + marker.place_m


def _closed(ring: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.vstack((ring, ring[:1]))


def _triangles() -> NDArray[np.int64]:
    """Return vertex indices of the triangles, shape (n, 3), seen from outside.

    Vertices are the lower ring, the upper ring and the two centres.
    """
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
