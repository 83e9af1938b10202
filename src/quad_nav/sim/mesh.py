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
from quad_nav.geometry import Pose2D, Pose3D
from quad_nav.sim.obstacles import Box

Floats = NDArray[np.float64]

FLOOR_M = 1e-3
"""Height up to which planes and solids count as part of the floor."""
MAX_BYTES = 64 * 1024 * 1024
MAX_BOXES = 10_000
"""Boxes of one mesh; one with more details has coarser cells."""
CELL_M, MAX_CELL_M = 0.05, 0.4
_MAX_CELLS = 64 * 1024 * 1024
_THINNEST_M = 0.01
"""Thickness of a flat mesh: a box has a volume."""
_FORMATS = (".dae", ".stl", ".obj")
_LFS_POINTER = b"version https://git-lfs"
_INSTALL = "pip install 'quad-nav[meshes]', in a checkout .venv/bin/pip install trimesh pycollada"


class NotRepresented(Exception):
    """Reason in a few words why a part of a world is left out of the scene."""


def read_triangles(path: Path) -> Floats:
    """Return the triangles float64[n, 3, 3] of a mesh file, in m.

    Raises:
        InputError: The file cannot be read.
        NotRepresented: It is no mesh, or the extra is not installed.
    """
    suffix = path.suffix.lower()
    if suffix not in _FORMATS:
        raise NotRepresented(f"mesh that is no {', '.join(_FORMATS)}")
    content = read_bytes(path, MAX_BYTES)
    if content.startswith(_LFS_POINTER):
        raise NotRepresented("mesh of which only Git LFS's pointer is there: git lfs pull")
    try:
        triangles = _collada(content) if suffix == ".dae" else _stl_or_obj(content, suffix[1:])
    except ImportError as error:
        raise NotRepresented(f"mesh, which needs {error.name}: {_INSTALL}") from error
    except Exception as error:  # of any kind: its readers trust their files
        raise NotRepresented(f"mesh that cannot be read: {error}") from error
    if not np.isfinite(triangles).all():
        raise NotRepresented("mesh with coordinates that are no numbers")
    return triangles


def _stl_or_obj(content: bytes, file_type: str) -> Floats:
    import trimesh

    mesh = trimesh.load_mesh(io.BytesIO(content), file_type=file_type, process=False)
    return np.asarray(mesh.triangles, float).reshape(-1, 3, 3)


def _collada(content: bytes) -> Floats:
    """Read a COLLADA file; as in Gazebo, its unit counts, and its upward axis does not."""
    import collada

    if b"<!DOCTYPE" in content or b"<COLLADA" not in content:  # the reader expands entities
        raise ValueError("expected <COLLADA> without a DOCTYPE")
    file = collada.Collada(io.BytesIO(content), ignore=[collada.common.DaeError])
    parts = [np.zeros((0, 3, 3))]
    for geometry in file.scene.objects("geometry"):
        for primitive in geometry.primitives():
            if isinstance(primitive, collada.polylist.BoundPolylist):
                primitive = primitive.triangleset()
            if isinstance(primitive, collada.triangleset.BoundTriangleSet) and len(primitive):
                parts.append(primitive.vertex[primitive.vertex_index])
    return np.concatenate(parts).astype(float) * (file.assetInfo.unitmeter or 1.0)


def prism(outline: Floats, is_closed: bool = True) -> Floats:
    """Return the triangles float64[n, 3, 3] of an upright prism from z = -0.5 to 0.5.

    Args:
        outline: Corners float64[k, 2]; convex, if the prism is closed above and below.
        is_closed: It has a top and a bottom.
    """
    here = np.insert(outline, 2, -0.5, axis=1)
    after, up = np.roll(here, -1, axis=0), (0.0, 0.0, 1.0)
    triangles = [(here, after, after + up), (here, after + up, here + up)]
    if is_closed:
        middle = np.broadcast_to(here.mean(axis=0), here.shape)
        triangles += [(here, after, middle), (here + up, after + up, middle + up)]
    return np.concatenate([np.stack(corners, axis=1) for corners in triangles])


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
