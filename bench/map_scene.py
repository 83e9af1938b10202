"""Measure the time to load a large ``map_server`` map and to simulate in it.

    PYTHONPATH=src .venv/bin/python bench/map_scene.py [cells along an edge] [specks per cell]

The map is a building with doors, ragged walls, furniture and specks, in unknown ground.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from PIL import Image

from quad_nav.files.document import read_yaml
from quad_nav.sim.map_file import load_map
from quad_nav.sim.scene_file import load_scene
from quad_nav.sim.simulation import Simulation
from quad_nav.sim.simulation_params import STEPS_PER_S

OCCUPIED, UNKNOWN, FREE = 0, 205, 254


def building(cells: int, specks: float, seed: int = 0) -> np.ndarray:
    """Return the map's image, uint8[cells, cells]."""
    random = np.random.default_rng(seed)
    image = np.full((cells, cells), UNKNOWN, np.uint8)
    edge, room, wall = cells // 20, 200, 4
    image[edge:-edge, edge:-edge] = FREE
    for at in range(edge, cells - edge, room):
        image[at : at + wall, edge:-edge] = OCCUPIED
        image[edge:-edge, at : at + wall] = OCCUPIED
    image[-edge - wall : -edge, edge:-edge] = image[edge:-edge, -edge - wall : -edge] = OCCUPIED
    for at in range(edge + room, cells - edge - room, room):
        for door in range(edge + room // 2, cells - edge, room):
            image[at - 2 : at + wall + 2, door : door + 24] = FREE
            image[door : door + 24, at - 2 : at + wall + 2] = FREE
    for _ in range((cells // room) ** 2 * 4):  # furniture
        row, column = random.integers(edge, cells - edge - 30, 2)
        high, wide = random.integers(4, 30, 2)
        image[row : row + high, column : column + wide] = OCCUPIED
    ragged = image == OCCUPIED  # walls in a LIDAR's map are a cell thicker in places
    beside = (
        np.roll(ragged, 1, 0)
        | np.roll(ragged, -1, 0)
        | np.roll(ragged, 1, 1)
        | np.roll(ragged, -1, 1)
    ) & (image == FREE)
    image[beside & (random.random(image.shape) < 0.1)] = OCCUPIED
    image[(image == FREE) & (random.random(image.shape) < specks)] = OCCUPIED
    return image


def main(cells: int, specks: float) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "building.yaml"
        Image.fromarray(building(cells, specks)).save(path.with_suffix(".pgm"))
        path.write_text(
            "image: building.pgm\nresolution: 0.05\norigin: [-100.0, -100.0, 0.0]\n"
            "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
        )
        began = time.perf_counter()
        scene = load_scene(path)
        loaded = time.perf_counter()
        simulation = Simulation(scene, 2)
        built = time.perf_counter()
        simulation.scan(0)  # compiles
        begun = time.perf_counter()
        for _ in range(STEPS_PER_S):
            simulation.step()
        stepped = time.perf_counter()
        simulation.scan(0)
        scanned = time.perf_counter()
        occupied = int(load_map(read_yaml(path), path).occupied(False).sum())
    print(f"{cells} x {cells} cells, {occupied} occupied: {len(scene.obstacles)} boxes")
    print(
        f"load {loaded - began:.2f} s, build {built - loaded:.2f} s, a simulated second "
        f"{stepped - begun:.2f} s, a scan {1e3 * (scanned - stepped):.1f} ms"
    )


if __name__ == "__main__":
    main(
        int(sys.argv[1]) if len(sys.argv) > 1 else 4000,
        float(sys.argv[2]) if len(sys.argv) > 2 else 0.0003,
    )
