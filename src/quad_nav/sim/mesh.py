"""Meshes as obstacles: the surface in cells of 5 cm, which few boxes cover.

A closed mesh is hollow, as in Gazebo's engines, so a room that is one mesh stays a room. trimesh is
an extra: ``pip install 'quad-nav[meshes]'``. Importing this module does not need it.
"""

from __future__ import annotations

import io
import math
from pathlib import Path
from typing import List, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.files.user_files import read_bytes
from quad_nav.files.xml_tree import read_xml
from quad_nav.geometry import Pose2D, Pose3D
from quad_nav.sim.obstacles import Box
from quad_nav.sim.sdf import FLOOR_M, NotRepresented

Floats = NDArray[np.float64]

MAX_BYTES = 64 * 1024 * 1024
MAX_BOXES = 10_000
"""Boxes of one mesh; one with more details has coarser cells."""
CELL_M, MAX_CELL_M = 0.05, 0.4
_MAX_CELLS = 64 * 1024 * 1024
_THINNEST_M = 0.01
"""Thickness of a flat mesh: a box has a volume."""
_FORMATS = (".dae", ".stl", ".obj")
_INSTALL = "pip install 'quad-nav[meshes]', in a checkout .venv/bin/pip install trimesh pycollada"


def read_triangles(path: Path) -> Floats:
    """Return the triangles float64[n, 3, 3] of a mesh file, in m.

    As in Gazebo, the unit of a COLLADA file counts, and its upward axis does not.

    Raises:
        InputError: The file cannot be read.
        NotRepresented: It is no mesh, or trimesh is not installed.
    """
    suffix = path.suffix.lower()
    if suffix not in _FORMATS:
        raise NotRepresented(f"mesh that is no {', '.join(_FORMATS)}")
    if suffix == ".dae":
        read_xml(path)  # refuses entities, which the reader of meshes would expand
    try:
        import trimesh

        if suffix == ".dae":
            import collada  # noqa: F401
    except ImportError as error:
        raise NotRepresented(f"mesh, which needs {error.name}: {_INSTALL}") from error
    content = io.BytesIO(read_bytes(path, MAX_BYTES))
    try:
        mesh = trimesh.load_scene(content, file_type=suffix[1:], process=False).to_mesh()
        metres = trimesh.units.unit_conversion(mesh.units or "meters", "meters")
        triangles = np.asarray(mesh.triangles, float).reshape(-1, 3, 3) * metres
    except Exception as error:  # of any kind: its readers trust their files
        raise NotRepresented(f"mesh that cannot be read: {error}") from error
    if not np.isfinite(triangles).all():
        raise NotRepresented("mesh with coordinates that are no numbers")
    return triangles


def boxes_of(name: str, triangles: Floats, pose: Pose3D) -> List[Box]:
    """Cover the surface of a mesh above the floor with boxes, along the mesh's x axis.

    Args:
        name: Name of the boxes, to which a number is added.
        triangles: float64[n, 3, 3], corners in the mesh's frame.
        pose: Pose of the mesh's frame in ``map``.

    Raises:
        NotRepresented: There are too many details.
    """
    upright = Pose2D(pose.x_m, pose.y_m, math.atan2(pose.rotation[1, 0], pose.rotation[0, 0]))
    tilted = triangles @ pose.rotation.T
    x_m, y_m = upright.inverse_transform(tilted[:, :, 0] + pose.x_m, tilted[:, :, 1] + pose.y_m)
    placed = np.stack([x_m, y_m, tilted[:, :, 2] + pose.z_m], axis=2)
    placed = placed[placed[:, :, 2].max(axis=1) > FLOOR_M]
    if len(placed) == 0:
        raise NotRepresented("nothing above the floor")
    low, high = placed.min(axis=(0, 1)), placed.max(axis=(0, 1))
    low[2] = max(low[2], 0.0)
    thicker = np.maximum(_THINNEST_M - (high - low), 0.0)
    low, high = low - thicker / 2, high + thicker / 2
    cells, cell_m = _cells(placed, low, high)
    boxes = []
    for number, (first, end) in enumerate(cells):
        left_m, front_m, bottom_m = (low + first * cell_m).tolist()
        x_size_m, y_size_m, height_m = ((end - first) * cell_m).tolist()
        place = upright.transform(float(left_m + x_size_m / 2), float(front_m + y_size_m / 2))
        size = (x_size_m, y_size_m, height_m)
        boxes.append(Box(f"{name}_{number}", *place, *size, upright.yaw_rad, bottom_m))
    return boxes


def _cells(triangles: Floats, low: Floats, high: Floats) -> Tuple[NDArray[np.int64], Floats]:
    """Cover triangles between two corners with boxes of cells.

    Returns:
        int64[n, 2, 3], the first cell of each box and the one after its last; the cells' sizes.
    """
    from quad_nav.sim.voxels import cover_volume, fill  # here: scenes load without numba otherwise

    size_m = CELL_M
    while size_m <= MAX_CELL_M:
        shape = np.maximum(np.ceil((high - low) / size_m - 1e-6), 1.0)
        if shape.prod() <= _MAX_CELLS:
            cell_m = (high - low) / shape
            filled = np.zeros(shape.astype(int), bool)
            fill((triangles - low) / cell_m, filled)
            boxes = np.empty((MAX_BOXES, 2, 3), np.int64)
            count = cover_volume(filled, boxes)
            if count <= MAX_BOXES:
                return boxes[:count], cell_m
        size_m *= 2
    raise NotRepresented("mesh with too many details")
