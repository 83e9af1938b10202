"""Map files of ``map_server``: read one, or draw one from a scene; save one.

Sources of the rules: ``image_loader.cpp`` and ``map_saver.cpp`` of map_server.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from quad_nav.errors import InputError
from quad_nav.files.document import read_yaml
from quad_nav.files.output import reason, write_bytes, write_text
from quad_nav.geometry import Pose2D
from quad_nav.scenario.scene_map import scene_map
from quad_nav.sim.map_file import load_map
from quad_nav.sim.scene import Scene
from quad_nav.sim.scene_file import load_scene

CELL_M = 0.05
"""Size of the cells of maps that are drawn, or made by slam."""
OCCUPIED_FROM, FREE_UP_TO = 65, 25
"""Occupancies, in percent, from which on and up to which a cell is saved as known."""
_OCCUPIED_PIXEL, _FREE_PIXEL, _UNKNOWN_PIXEL = 0, 254, 205


@dataclass(frozen=True)
class GridMap:
    """A map as in ``nav_msgs/OccupancyGrid``.

    Attributes:
        occupancy: int8[H, W], 0 to 100, or -1 for unknown; row 0 at the lower edge.
        resolution_m: Size of a cell.
        origin: Pose in ``map`` of the lower left corner of cell (0, 0).
    """

    occupancy: NDArray[np.int8]
    resolution_m: float
    origin: Pose2D


def read_map(path: Path, resolution_m: float) -> GridMap:
    """Read a map, or draw that of a scene or a world at its flying altitude.

    Args:
        path: The YAML file of a map, a scene, or a Gazebo world.
        resolution_m: Size of the cells of a scene's map.

    Raises:
        InputError: Every fault of the file.
    """
    if path.suffix in (".yaml", ".yml"):
        document = read_yaml(path)
        if isinstance(document, dict) and "image" in document:
            found = load_map(document, path)
            return GridMap(found.occupancy, found.fields.resolution_m, found.fields.origin)
    return draw_map(load_scene(path), resolution_m)


def draw_map(scene: Scene, resolution_m: float) -> GridMap:
    """Draw the map of a scene at its flying altitude."""
    drawn = scene_map(scene, resolution_m)
    corner = Pose2D(drawn.spec.origin_x_m, drawn.spec.origin_y_m)
    return GridMap(drawn.occupancy, resolution_m, corner)


def save_map(
    grid: GridMap, stem: Path, occupied_from: int = OCCUPIED_FROM, free_up_to: int = FREE_UP_TO
) -> None:
    """Write ``stem.pgm`` and ``stem.yaml``; read again, every known cell is free or occupied.

    Raises:
        InputError: A file cannot be written.
    """
    cells = grid.occupancy
    pixels = np.full(cells.shape, _UNKNOWN_PIXEL, np.uint8)
    pixels[(cells >= 0) & (cells <= free_up_to)] = _FREE_PIXEL
    pixels[cells >= occupied_from] = _OCCUPIED_PIXEL
    height, width = cells.shape[0], cells.shape[1]
    image = stem.with_name(f"{stem.name}.pgm")
    x_m, y_m, yaw_rad = grid.origin.x_m, grid.origin.y_m, grid.origin.yaw_rad
    text = (
        f"image: {image.name}\nresolution: {grid.resolution_m!r}\n"
        f"origin: [{x_m!r}, {y_m!r}, {yaw_rad!r}]\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    document = stem.with_name(f"{stem.name}.yaml")
    try:
        write_bytes(image, b"P5\n%d %d\n255\n" % (width, height) + pixels[::-1].tobytes())
        write_text(document, text)
    except OSError as error:
        raise InputError([f"{stem}: {reason(error)}, expected a place for a map"]) from error
