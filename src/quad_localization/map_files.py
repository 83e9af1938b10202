"""Map files of ``map_server``: read one, or draw one from a scene; save one.

Sources of the rules: ``image_loader.cpp`` and ``map_saver.cpp`` of map_server.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from quad_nav.costmap.static import StaticMap
from quad_nav.errors import InputError
from quad_nav.files.document import read_yaml
from quad_nav.files.output import reason, write_bytes, write_text
from quad_nav.grid import GridSpec
from quad_nav.scenario.scene_map import scene_map
from quad_nav.sim.map_file import load_map
from quad_nav.sim.scene_file import load_scene

CELL_M = 0.05
"""Size of the cells of maps that are drawn, or made by slam."""
OCCUPIED_FROM, FREE_UP_TO = 65, 25
"""Occupancies, in percent, from which on and up to which a cell is saved as known."""
_OCCUPIED_PIXEL, _FREE_PIXEL, _UNKNOWN_PIXEL = 0, 254, 205


def read_map(path: Path, resolution_m: float) -> StaticMap:
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
            (height, width), origin = found.occupancy.shape, found.fields.origin
            spec = GridSpec(width, height, found.fields.resolution_m, origin.x_m, origin.y_m)
            return StaticMap(found.occupancy, spec, yaw_rad=origin.yaw_rad)
    return scene_map(load_scene(path), resolution_m)


def save_map(
    grid: StaticMap, stem: Path, occupied_from: int = OCCUPIED_FROM, free_up_to: int = FREE_UP_TO
) -> None:
    """Write ``stem.pgm`` and ``stem.yaml``; read again, every known cell is free or occupied.

    Raises:
        InputError: A file cannot be written.
    """
    cells, spec = grid.occupancy, grid.spec
    pixels = np.full(cells.shape, _UNKNOWN_PIXEL, np.uint8)
    pixels[(cells >= 0) & (cells <= free_up_to)] = _FREE_PIXEL
    pixels[cells >= occupied_from] = _OCCUPIED_PIXEL
    image = stem.with_name(f"{stem.name}.pgm")
    text = (
        f"image: {image.name}\nresolution: {spec.resolution_m!r}\n"
        f"origin: [{spec.origin_x_m!r}, {spec.origin_y_m!r}, {grid.yaw_rad!r}]\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    document = stem.with_name(f"{stem.name}.yaml")
    try:
        header = b"P5\n%d %d\n255\n" % (spec.size_x, spec.size_y)
        write_bytes(image, header + pixels[::-1].tobytes())
        write_text(document, text)
    except OSError as error:
        raise InputError([f"{stem}: {reason(error)}, expected a place for a map"]) from error
